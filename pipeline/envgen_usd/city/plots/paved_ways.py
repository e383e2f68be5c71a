"""Paved ways from the street to the doors and gates of buildings."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import shapely

from envgen_usd.city.city_scene import Scene
from envgen_usd.city.plots.enclosed_plots import Gate
from envgen_usd.models.landuse import LanduseClass, LanduseMap, Plot

_LEAST_WIDTH = 1.6
"""Least width of a way, metres: two cells. A larger value widens narrow ways."""
_BESIDE = 0.4
"""Extra width of a way beyond its gate, metres; a larger value widens ways."""
_REACH = 12.0
"""Largest distance from the frontage to the road, metres.

A larger value connects more ways to the road.
"""
_STRIP = 0.9
"""Largest width of a paved strip between road and plot, metres; wider ones stay green."""
_UNDER_WALL = 0.4
"""Metres that a paved strip reaches behind the frontage, below the wall that stands there."""
_STEP = 0.25
_FREE = (
    LanduseClass.UNKNOWN,
    LanduseClass.GRASS,
    LanduseClass.VERGE,
    LanduseClass.LAWN,
    LanduseClass.RUBBLE,
    LanduseClass.WOOD,
    LanduseClass.SCHOOL,
)


def pave(landuse: LanduseMap, gates: Sequence[Gate], scene: Scene) -> LanduseMap:
    """Returns the landuse of a chunk with a straight way from each gate to the road.

    If the road is too far from the frontage, as for plots in back rows, the way ends at the
    frontage.

    Args:
        landuse: Landuse of the chunk; only open ground is paved.
        gates: Gates of the buildings in and around the chunk.
        scene: Scene of the chunk.
    """
    x, y = landuse.chunk.cell_centres()
    classes = landuse.classes.copy()
    free = np.isin(classes, _FREE)
    for gate in gates:
        way = _way(gate, scene)
        x0, y0, x1, y1 = way.bounds
        columns = slice(*np.searchsorted(x, [x0, x1]).tolist())
        rows = slice(*np.searchsorted(y, [y0, y1]).tolist())
        if columns.start < columns.stop and rows.start < rows.stop:
            inside = shapely.contains_xy(way, x[None, columns], y[rows, None])
            classes[rows, columns][inside & free[rows, columns]] = LanduseClass.ACCESS
    return replace(landuse, classes=classes)


def forecourts(plots: Sequence[Plot], scene: Scene) -> tuple[Gate, ...]:
    """Returns ways as wide as a plot where so little lies before it that nobody would sow grass.

    Args:
        plots: Plots with buildings in and around the chunk.
        scene: Scene of the chunk.
    """
    ways = []
    for plot in plots:
        start, end = plot.frontage
        along = end - start
        width = float(np.hypot(*along))
        into = np.array([-along[1], along[0]]) / width
        foot = (start + end) / 2
        if scene.road.near(foot[None], _STRIP).any():
            ways.append(Gate(foot + _UNDER_WALL * into, foot, width - _BESIDE))
    return tuple(ways)


def _way(gate: Gate, scene: Scene) -> shapely.Polygon:
    out = gate.foot - gate.place
    out /= max(float(np.hypot(*out)), 1e-9)
    steps = np.arange(0.0, _REACH, _STEP)
    on_road = scene.road.near(gate.foot + steps[:, None] * out, _STEP)
    beyond = steps[np.argmax(on_road)] + 2 * _STEP if on_road.any() else 0.0
    line = shapely.LineString([gate.place, gate.foot + beyond * out])
    return line.buffer(max(gate.width + _BESIDE, _LEAST_WIDTH) / 2, cap_style="flat")
