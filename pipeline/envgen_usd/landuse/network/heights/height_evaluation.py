"""Evaluates generated heights against the ground truth, on unseen roads."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from envgen_usd.landuse.network.data.height_sample import HEIGHT_CELL, HEIGHT_RAW, HeightSample
from envgen_usd.landuse.network.heights.height_filling import fill_heights
from envgen_usd.landuse.network.heights.height_scenes import make_height_sample, make_height_scene
from envgen_usd.landuse.network.model.generator import Generator, PlainUNet
from envgen_usd.models.array_types import FloatArray

NEAR = 30.0
"""Distance from the road within which the ground counts as near, metres."""


@dataclass(frozen=True)
class HeightWindow:
    """A window for evaluation; its whole land is the hole, and its middle is measured.

    Attributes:
        sample: Ground truth.
        followed: S x S, metres above the reference: the ground with only the hills that the road
            follows. The road gives no information on the remaining hills.
    """

    sample: HeightSample
    followed: NDArray[np.float32]


HeightFill = Callable[[HeightWindow], FloatArray]
"""Generates the heights above the reference, S x S, metres."""


@dataclass(frozen=True)
class HeightScore:
    """Scores of a source of heights, pooled over all cells that are measured, without the road.

    These are the middle halves of windows, since streets around them are known in a map, too.

    Attributes:
        rmse: Root mean square error, m.
        mae: Mean absolute error, m.
        near: `rmse` within `NEAR` of the road.
        slope: Root mean square error of the slope between adjacent cells, %.
    """

    rmse: float
    mae: float
    near: float
    slope: float


def height_windows(count: int, seed: int) -> list[HeightWindow]:
    """The first samples that training never sees."""
    return [_window(number, seed) for number in range(count)]


def score_heights(windows: Sequence[HeightWindow], make: HeightFill) -> HeightScore:
    """Measures a source of heights."""
    squares, absolutes, near, steps = [], [], [], []
    for window in windows:
        sample = window.sample
        cut = slice(sample.side // 4, sample.side - sample.side // 4)
        error = (make(window) - sample.rise)[cut, cut]
        hole = ~sample.road[cut, cut]
        close = sample.raw[HEIGHT_RAW.index("distance")].repeat(2, 0).repeat(2, 1)[cut, cut] < NEAR
        squares.append(np.square(error[hole]))
        absolutes.append(np.abs(error[hole]))
        near.append(np.square(error[hole & close]))
        for axis in (0, 1):
            both = np.delete(hole, -1, axis) & np.delete(hole, 0, axis)
            steps.append(np.square(np.diff(error, axis=axis)[both] / HEIGHT_CELL))
    roots = [float(np.sqrt(np.mean(np.concatenate(part)))) for part in (squares, near, steps)]
    return HeightScore(roots[0], float(np.mean(np.concatenate(absolutes))), roots[1], roots[2])


def by_mean(window: HeightWindow) -> FloatArray:
    """The mean height of the road everywhere."""
    sample = window.sample
    mean = sample.reference[sample.road].mean() if sample.road.any() else sample.reference.mean()
    rise: FloatArray = (mean - sample.reference).astype(np.float64)
    return rise


def by_nearest(window: HeightWindow) -> FloatArray:
    """The height of the nearest point of the road."""
    above: FloatArray = window.sample.raw[HEIGHT_RAW.index("above")].astype(np.float64)
    return above.repeat(2, 0).repeat(2, 1)


def by_membrane(window: HeightWindow) -> FloatArray:
    """The ground interpolated from the road alone: a membrane between roads."""
    return np.zeros(window.sample.rise.shape)


def by_followed(window: HeightWindow) -> FloatArray:
    """The hills that the road follows: an upper bound for any network, not a method."""
    return window.followed.astype(np.float64)


def by_height_network(network: Generator | PlainUNet, seed: int = 0) -> HeightFill:
    """Heights by a trained network."""
    return lambda window: fill_heights(network, [window.sample], [seed])[0].astype(np.float64)


def height_table(scores: Mapping[str, HeightScore]) -> str:
    """Scores as a Markdown table."""
    head = f"| | RMSE, m | MAE, m | RMSE to {NEAR:.0f} m | slope |\n|---|---|---|---|---|\n"
    return head + "\n".join(_row(name, *dataclasses.astuple(one)) for name, one in scores.items())


def _row(name: str, rmse: float, mae: float, near: float, slope: float) -> str:
    return f"| {name} | {rmse:.2f} | {mae:.2f} | {near:.2f} | {100 * slope:.1f} % |"


def _window(number: int, seed: int) -> HeightWindow:
    scene = make_height_scene("unseen", number, seed)
    sample = make_height_sample(scene)
    land = dataclasses.replace(scene.land, bare=scene.land.followed)
    without = make_height_sample(dataclasses.replace(scene, land=land))
    return HeightWindow(sample, without.rise)
