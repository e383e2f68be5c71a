"""Evaluates generated landuse against the rules."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray

from envgen_usd.landuse.network.class_repair import repair
from envgen_usd.landuse.network.data.class_channels import BORDER, ROAD, to_channels
from envgen_usd.landuse.network.data.known_fields import RAW, expand
from envgen_usd.landuse.network.data.landuse_scenes import (
    LanduseSample,
    Scene,
    Split,
    make_sample,
    make_scene,
    sample_fields,
)
from envgen_usd.landuse.network.hole_filling import UNSEEN, draw_chance, fill
from envgen_usd.landuse.network.model.generator import Generator, PlainUNet
from envgen_usd.landuse.network.training.landuse_measures import (
    confusion_of,
    distances,
    matched,
    mean_iou,
    plot_shapes,
)
from envgen_usd.landuse.network.training.training_batches import window_of
from envgen_usd.models.array_types import BoolArray, ByteArray, FloatArray
from envgen_usd.seeds import generator

SIZE = 256
"""Side length of an evaluated window, cells."""
SPLITS: tuple[Split, ...] = ("determined", "random")
"""Splits of the evaluation: the fields determine the landuse, or it is random."""
CORNER = 126
"""First row and column of the window in a sample."""


@dataclass(frozen=True)
class Window:
    """A window for evaluation; its whole land is the hole.

    Attributes:
        sample: Ground truth.
        scene: Roads and environment.
        number: Split, position in it and seed.
    """

    sample: LanduseSample
    scene: Scene
    number: tuple[Split, int, int]


Fill = Callable[[Window, int], ByteArray]
"""Generates the channels of a window, given the number of the draw."""


@dataclass(frozen=True)
class Score:
    """Scores of a landuse source, pooled over windows.

    Attributes:
        miou: Mean intersection over union in the hole after repair, over the truth's classes.
        channels: The same before repair, with the line between plots as a class.
        best: `miou` with the best draw of each window.
        diversity: 1 - agreement (mIoU) of two draws.
        plots: F1 score of matched plots, at an intersection over union of one half.
        area: Wasserstein distance between generated and true plot areas, m².
        depth: The same for depths, m.
        frontage: The same for frontages, m.
        repaired: Share of cells that repair changes, without lines between plots.
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
    """Centre windows of the first samples of a split."""
    return [
        Window(
            window_of(make_sample(split, n, seed), CORNER, CORNER, SIZE),
            make_scene(split, n, seed),
            (split, n, seed),
        )
        for n in range(count)
    ]


def score(windows: Sequence[Window], make: Fill, draws: int) -> Score:
    """Measures a landuse source."""
    each = [_measure(window, [make(window, draw) for draw in range(draws)]) for window in windows]
    same, true, generated = np.sum([one.matches for one in each], axis=0)
    between = np.sum([one.between for one in each], axis=0)
    best = [max(one.classes, key=mean_iou) for one in each]
    return Score(
        mean_iou(np.sum([one.classes for one in each], axis=(0, 1))),
        mean_iou(np.sum([one.channels for one in each], axis=0)),
        mean_iou(np.sum(best, axis=0)),
        1 - mean_iou(between) if draws > 1 else 0.0,
        float(2 * same / max(1, true + generated)),
        *distances([one.true_shapes for one in each], [one.shapes for one in each]),
        float(np.mean([one.repaired for one in each])),
    )


@dataclass(frozen=True)
class _Measured:
    """Counts of a window: of each draw along a leading axis, else of the first draw."""

    classes: FloatArray
    channels: FloatArray
    between: FloatArray
    matches: tuple[int, int, int]
    true_shapes: FloatArray
    shapes: FloatArray
    repaired: float


def _measure(window: Window, generated: Sequence[ByteArray]) -> _Measured:
    sample, channels = window.sample, window.sample.channels
    repaired = [repair(one) for one in generated]
    first, plots = repaired[0]
    normals = sample.raw[[RAW.index("normal_x"), RAW.index("normal_y")]]
    changed = (to_channels(first, plots) != generated[0]) & ~_line(first, plots, generated[0])
    return _Measured(
        np.stack([confusion_of(sample.classes, classes) for classes, _ in repaired]),
        confusion_of(channels, generated[0], ROAD),
        confusion_of(first, repaired[-1][0]),
        matched(sample.plots, plots),
        plot_shapes(sample.plots, normals),
        plot_shapes(plots, normals),
        float(np.mean(changed)),
    )


def _line(classes: ByteArray, plots: np.ndarray, generated: ByteArray) -> BoolArray:
    """Cells on a line between plots before or after repair."""
    line: BoolArray = (to_channels(classes, plots) == BORDER) | (generated == BORDER)
    return line


def by_network(
    network: Generator | PlainUNet, passes: Sequence[float] = (), ask: bool = True
) -> Fill:
    """Landuse by a trained network.

    Args:
        network: Trained network.
        passes: Shares of cells that are sampled before the rest is filled in.
        ask: True to draw new requested plots for each draw, in windows whose fields hold none.
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


def _row(name: str, score: Score) -> str:
    shares = (score.miou, score.channels, score.best, score.diversity, score.plots)
    sizes = (score.area, score.depth, score.frontage)
    known = ["none" if np.isnan(v) else f"{v:.1f}" for v in sizes]  # no plots to compare
    cells = [*(f"{v:.3f}" for v in shares), *known]
    return f"| {' | '.join([name, *cells, f'{100 * score.repaired:.2f} %'])} |"
