"""Figures of a data set: shares of the classes, histograms of depths and of instances."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from envgen_usd.datasets.dataset_index import IndexedFrame
from envgen_usd.datasets.frame_files import read_image
from envgen_usd.label_taxonomy import labels
from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.render.frames.label_images import INSTANCE_FACTOR

MOST = 1000
"""Largest number of frames that are counted; a larger value is more exact and takes longer."""
DEPTHS = np.concatenate(([0.0], np.geomspace(2.0, 1024.0, 10)))
"""Borders of the depth histogram, metres; beyond the last is one more bin."""
_THREADS = 2


@dataclass(frozen=True)
class FrameStatistics:
    """Figures of the counted frames.

    Attributes:
        counted: Number of the counted frames.
        shares: Share of the pixels of each class, by split and name of the class.
        depths: Share of the pixels with a surface in each bin of `DEPTHS`; empty without depth.
        instances: Number of visible instances of each counted frame; empty without instances.
        classes: Number of different instances by class name.
    """

    counted: int
    shares: dict[str, dict[str, float]]
    depths: FloatArray
    instances: IntArray
    classes: dict[str, int]


@dataclass(frozen=True)
class _Counts:
    """Counts of a frame: pixels by class id, pixels by depth, and instance values."""

    classes: IntArray
    depths: IntArray
    values: IntArray


def frame_statistics(
    folder: Path,
    frames: Sequence[IndexedFrame],
    progress: Callable[[str, int, int], None] = lambda *_: None,
) -> FrameStatistics:
    """Counts at most `MOST` frames, evenly spread over all.

    Args:
        folder: Folder of the data set.
        frames: Its frames.
        progress: Called with the step's name, the parts done and the total.
    """
    steps = np.linspace(0, len(frames) - 1, min(MOST, len(frames))).round().astype(int)
    chosen = [frames[index] for index in steps.tolist()]
    counts: list[_Counts] = []
    with ThreadPoolExecutor(_THREADS) as pool:
        for number, each in enumerate(pool.map(lambda frame: _count(folder, frame), chosen)):
            counts.append(each)
            progress("count pixels", number + 1, len(chosen))
    towns: dict[tuple[str, int], None] = {}
    for frame, each in zip(chosen, counts, strict=True):
        town = f"{frame.road} {frame.country} {frame.area} {frame.seed}"
        towns.update(dict.fromkeys((town, value) for value in each.values.tolist()))
    named = {entry.id: entry.name for entry in labels()}
    classes = [named[value // INSTANCE_FACTOR] for _, value in towns]
    depths = np.sum([each.depths for each in counts], axis=0, dtype=np.float64)
    has_values = any((folder / frame.file("instance")).is_file() for frame in chosen[:1])
    return FrameStatistics(
        counted=len(chosen),
        shares=_shares([frame.split for frame in chosen], counts),
        depths=depths / depths.sum() if depths.any() else np.empty(0),
        instances=np.array([len(each.values) for each in counts if has_values], np.int64),
        classes={name: classes.count(name) for name in sorted(set(classes))},
    )


def _count(folder: Path, frame: IndexedFrame) -> _Counts:
    """Counts a frame; kinds that are no output count as nothing."""

    def image(kind: str) -> IntArray | FloatArray | None:
        path = folder / frame.file(kind)
        return read_image(path) if path.is_file() else None

    semantic, depth, values = image("semantic"), image("depth"), image("instance")
    nothing = np.zeros(0, np.int64)
    bins = np.append(DEPTHS, np.inf)
    seen = nothing if values is None else np.unique(values).astype(np.int64)
    return _Counts(
        np.zeros(256, np.int64)
        if semantic is None
        else np.bincount(semantic.reshape(-1), minlength=256),
        np.zeros(len(bins) - 1, np.int64)
        if depth is None
        else np.histogram(depth[depth > 0.0], bins)[0],
        seen[seen % INSTANCE_FACTOR > 0],
    )


def _shares(splits: Sequence[str], counts: Sequence[_Counts]) -> dict[str, dict[str, float]]:
    shares = {}
    for split in dict.fromkeys(splits):
        total = np.sum(
            [c.classes for s, c in zip(splits, counts, strict=True) if s == split], axis=0
        )
        pixels = max(int(total.sum()), 1)
        shares[split] = {entry.name: float(total[entry.id]) / pixels for entry in labels()}
    return shares
