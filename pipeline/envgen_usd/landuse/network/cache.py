"""Samples on disk: reads them, and writes those that are missing."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from envgen_usd.landuse.network.samples import Sample, Split, make_sample


def read_samples(folder: Path, split: Split, numbers: range, seed: int) -> Iterator[Sample]:
    """Yields samples of a stream; makes and keeps those that the folder does not hold.

    Args:
        folder: Where samples are kept; it is made if it does not exist.
        split: Stream.
        numbers: Places in the stream.
        seed: Seed of the stream.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for number in numbers:
        path = folder / f"{split}_{seed}_{number}.npz"
        if not path.exists():
            _write(make_sample(split, number, seed), path)
        yield _read(path)


def _write(sample: Sample, path: Path) -> None:
    part = path.with_suffix(".part")
    with part.open("wb") as file:
        np.savez_compressed(
            file,
            classes=sample.classes,
            plots=sample.plots,
            raw=sample.raw,
            condition=sample.condition,
        )
    part.replace(path)


def _read(path: Path) -> Sample:
    with np.load(path, allow_pickle=False) as data:
        return Sample(data["classes"], data["plots"], data["raw"], data["condition"])
