"""How near generated landuse comes to the rules."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray

from envgen_usd.landuse.network.batches import window_of
from envgen_usd.landuse.network.classes import BORDER, ROAD, to_channels
from envgen_usd.landuse.network.fields import RAW, expand
from envgen_usd.landuse.network.generator import Generator, PlainUNet
from envgen_usd.landuse.network.measures import (
    confusion_of,
    distances,
    matched,
    mean_iou,
    plot_shapes,
)
from envgen_usd.landuse.network.repair import repair
from envgen_usd.landuse.network.samples import (
    LanduseSample,
    Scene,
    Split,
    make_sample,
    make_scene,
    sample_fields,
)
from envgen_usd.landuse.network.sampling import UNSEEN, draw_chance, fill
from envgen_usd.models.arrays import BoolArray, ByteArray, FloatArray
from envgen_usd.seeds import generator

SIZE = 256
"""Cells along a side of an evaluated window."""
SPLITS: tuple[Split, ...] = ("determined", "random")
"""Streams to evaluate on: landuse follows from the fields, or is drawn."""
CORNER = 126
"""Its first row and column in a sample."""


@dataclass(frozen=True)
class Window:
    """A window to evaluate on, whose whole land is the hole.

    Attributes:
        sample: The truth.
        scene: Where it comes from.
        number: Split, place in it and seed.
    """

    sample: LanduseSample
    scene: Scene
    number: tuple[Split, int, int]


Fill = Callable[[Window, int], ByteArray]
"""Makes the channels of a window, for a number of a draw."""


@dataclass(frozen=True)
class Score:
    """Figures of one way to make landuse, pooled over windows.

    Attributes:
        miou: Mean intersection over union in the hole after repair, over the truth's classes.
        channels: The same before repair, with the line between plots as a class.
        best: `miou` with the best draw of each window.
        diversity: 1 - agreement (mIoU) of two draws.
        plots: Share of plots that are also the other's (F1 at an overlap of a half).
        area: Wasserstein distance of the plots' areas to the truth's, m².
        depth: The same of their depths, m.
        frontage: The same of their frontages, m.
        repaired: Share of cells that repair changes, lines between plots apart.
    """

    miou: float
    channels: float
    best: float
    diversity: float
    plots: float
    area: float
    depth: float
    frontage: float
    repaired: float


def evaluation_windows(split: Split, count: int, seed: int) -> list[Window]:
    """Middle windows of the first samples of a split."""
    return [
        Window(
            window_of(make_sample(split, n, seed), CORNER, CORNER, SIZE),
            make_scene(split, n, seed),
            (split, n, seed),
        )
        for n in range(count)
    ]


def score(windows: Sequence[Window], make: Fill, draws: int) -> Score:
    """Measures one way to make landuse."""
    each = [_measure(window, [make(window, draw) for draw in range(draws)]) for window in windows]
    same, true, made = np.sum([one.matches for one in each], axis=0)
    between = np.sum([one.between for one in each], axis=0)
    best = [max(one.classes, key=mean_iou) for one in each]
    return Score(
        mean_iou(np.sum([one.classes for one in each], axis=(0, 1))),
        mean_iou(np.sum([one.channels for one in each], axis=0)),
        mean_iou(np.sum(best, axis=0)),
        1 - mean_iou(between) if draws > 1 else 0.0,
        float(2 * same / max(1, true + made)),
        *distances([one.true_shapes for one in each], [one.shapes for one in each]),
        float(np.mean([one.repaired for one in each])),
    )


@dataclass(frozen=True)
class _Measured:
    """Counts of one window: of each draw where there is a leading axis, else of the first."""

    classes: FloatArray
    channels: FloatArray
    between: FloatArray
    matches: tuple[int, int, int]
    true_shapes: FloatArray
    shapes: FloatArray
    repaired: float


def _measure(window: Window, made: Sequence[ByteArray]) -> _Measured:
    sample, channels = window.sample, window.sample.channels
    mended = [repair(one) for one in made]
    first, plots = mended[0]
    normals = sample.raw[[RAW.index("normal_x"), RAW.index("normal_y")]]
    changed = (to_channels(first, plots) != made[0]) & ~_line(first, plots, made[0])
    return _Measured(
        np.stack([confusion_of(sample.classes, classes) for classes, _ in mended]),
        confusion_of(channels, made[0], ROAD),
        confusion_of(first, mended[-1][0]),
        matched(sample.plots, plots),
        plot_shapes(sample.plots, normals),
        plot_shapes(plots, normals),
        float(np.mean(changed)),
    )


def _line(classes: ByteArray, plots: np.ndarray, made: ByteArray) -> BoolArray:
    """Cells that are a line between plots before or after repair."""
    line: BoolArray = (to_channels(classes, plots) == BORDER) | (made == BORDER)
    return line


def by_network(
    network: Generator | PlainUNet, passes: Sequence[float] = (), ask: bool = True
) -> Fill:
    """Landuse by a trained network.

    Args:
        network: Trained.
        passes: Shares of cells that are drawn before the rest is filled in.
        ask: Whether fields are told what is asked for, drawn anew for each draw, where the
            window's own are not told.
    """

    def make(window: Window, draw: int) -> ByteArray:
        sample = window.sample
        rng = generator(draw, "landuse", "evaluate", int(sample.classes.sum()))
        chance = draw_chance([rng], sample.channels.shape, passes)
        channels = np.where(sample.channels == ROAD, np.uint8(ROAD), np.uint8(UNSEEN))[None]
        raw = _asked(window, draw) if ask and not window.scene.told else sample.raw
        condition = torch.from_numpy(sample.condition[None])
        fields = expand(torch.from_numpy(raw[None]))
        filled = fill(network, channels, fields, condition, chance)
        return np.asarray(filled[0], dtype=np.uint8)

    return make


def _asked(window: Window, draw: int) -> NDArray[np.float16]:
    scene = dataclasses.replace(window.scene, told=True)
    raw = sample_fields(scene, draw)
    cut = slice(CORNER // 2, (CORNER + SIZE) // 2)
    return raw[:, cut, cut]


def table(scores: Mapping[str, Score]) -> str:
    """Scores as a Markdown table."""
    names = [field.name for field in dataclasses.fields(Score)]
    head = f"| | {' | '.join(names)} |\n|{'---|' * (len(names) + 1)}\n"
    return head + "\n".join(_row(name, one) for name, one in scores.items())


def _row(name: str, one: Score) -> str:
    shares = (one.miou, one.channels, one.best, one.diversity, one.plots)
    sizes = (one.area, one.depth, one.frontage)
    known = ["none" if np.isnan(v) else f"{v:.1f}" for v in sizes]  # no plots to compare
    cells = [*(f"{v:.3f}" for v in shares), *known]
    return f"| {' | '.join([name, *cells, f'{100 * one.repaired:.2f} %'])} |"
