"""Heights of junctions from their elevation grid (1.8.1, 12.11)."""

import numpy as np

from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.junctions import ElevationGrid, Junction
from envgen_usd.models.plan_view import PlanView
from envgen_usd.opendrive.geometry.curve_evaluation import evaluate

_STEP = 0.5
"""Metres between samples of the reference line; a smaller value projects points more exactly."""


def grid_heights(junction: Junction, points: FloatArray) -> FloatArray:
    """Returns the height of the junction's grid at points, metres; NaN outside the grid.

    The grid's rows lie across the junction's reference line, its columns along it. Heights are
    interpolated bilinearly.

    Args:
        junction: Junction with an elevation grid and a plan view.
        points: N x 2, metres, road frame.
    """
    grid, plan_view = junction.elevation_grid, junction.plan_view
    if grid is None or plan_view is None:
        return np.full(len(points), np.nan)
    s, t = _project(plan_view, points)
    table, middle = _table(grid)
    row, column = (s - grid.start) / grid.spacing, middle + t / grid.spacing
    top, left = np.floor(row).astype(np.int64), np.floor(column).astype(np.int64)
    height = np.zeros(len(points))
    weight = np.zeros(len(points))
    for down in (0, 1):
        for across in (0, 1):
            share = np.abs(1 - down - (row - top)) * np.abs(1 - across - (column - left))
            at = np.clip(top + down, -1, len(table)), np.clip(left + across, -1, table.shape[1])
            value = np.pad(table, 1, constant_values=np.nan)[at[0] + 1, at[1] + 1]
            used = share > 1e-9
            height[used] += share[used] * value[used]
            weight[used] += share[used]
    return np.where(weight > 0.999, height, np.nan)


def grid_lines(junction: Junction) -> FloatArray:
    """Returns the edges of a junction's grid, N x 2 x 2, metres, road frame."""
    grid, plan_view = junction.elevation_grid, junction.plan_view
    if grid is None or plan_view is None:
        return np.empty((0, 2, 2))
    table, middle = _table(grid)
    s = grid.start + grid.spacing * np.arange(len(table), dtype=np.float64)
    x, y, heading = evaluate(plan_view, s)
    t = grid.spacing * (np.arange(table.shape[1]) - middle)
    points = np.stack(
        [x[:, None] - t * np.sin(heading)[:, None], y[:, None] + t * np.cos(heading)[:, None]], -1
    )
    pairs = [
        np.stack([points[:-1], points[1:]], axis=2),
        np.stack([points[:, :-1], points[:, 1:]], axis=2),
    ]
    return np.concatenate([pair.reshape(-1, 2, 2) for pair in pairs])


def _table(grid: ElevationGrid) -> tuple[FloatArray, int]:
    """Returns heights by (row, column) with columns along rising t, and the centre's column."""
    right = max((len(row) for row in grid.right), default=0)
    left = max((len(row) for row in grid.left), default=0)
    table = np.full((len(grid.centre), right + 1 + left), np.nan)
    table[:, right] = grid.centre
    for row, (on_left, on_right) in enumerate(zip(grid.left, grid.right, strict=True)):
        table[row, right + 1 : right + 1 + len(on_left)] = on_left
        table[row, right - len(on_right) : right] = on_right[::-1]
    return table, right


def _project(plan_view: PlanView, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Projects points to (s, t) of a reference line by its nearest chord."""
    length = float(plan_view.s[-1] + plan_view.length[-1])
    s = np.linspace(0.0, length, max(int(np.ceil(length / _STEP)), 1) + 1)
    x, y, _ = evaluate(plan_view, s)
    line = np.column_stack([x, y])
    chord = np.diff(line, axis=0)
    size = np.maximum((chord**2).sum(axis=1), 1e-12)
    apart = points[:, None] - line[None, :-1]
    part = (apart * chord).sum(axis=2) / size
    off = apart - np.clip(part, 0.0, 1.0)[..., None] * chord
    nearest = (off**2).sum(axis=2).argmin(axis=1)
    place = np.arange(len(points))
    along, best = part[place, nearest], chord[nearest]
    beside = apart[place, nearest]
    side = (best[:, 0] * beside[:, 1] - best[:, 1] * beside[:, 0]) / np.sqrt(size[nearest])
    # Beyond its ends the line continues straight.
    inner = np.clip(
        along, np.where(nearest > 0, 0.0, -np.inf), np.where(nearest < len(chord) - 1, 1.0, np.inf)
    )
    return s[nearest] + inner * np.diff(s)[nearest], side
