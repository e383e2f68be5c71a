"""Samples on disk: reads them, and writes those that are missing."""

from collections.abc import Callable, Iterator
from dataclasses import fields
from pathlib import Path
from typing import TypeVar

import numpy as np

from envgen_usd.landuse.network.sample import Sample

S = TypeVar("S", bound=Sample)


def read_samples(
    folder: Path, stream: str, numbers: range, kind: type[S], make: Callable[[int], S]
) -> Iterator[S]:
    """Yields samples of a stream; makes and keeps those that the folder does not hold.

    Args:
        folder: Where samples are kept; it is made if it does not exist.
        stream: Name of the stream, seed included.
        numbers: Places in the stream.
        kind: Class of the samples.
        make: Makes the sample of a place.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for number in numbers:
        path = folder / f"{stream}_{number}.npz"
        if not path.exists():
            _write(make(number), path)
        with np.load(path, allow_pickle=False) as data:
            yield kind(**{field.name: data[field.name] for field in fields(kind)})


def _write(sample: Sample, path: Path) -> None:
    part = path.with_suffix(".part")
    with part.open("wb") as file:
        np.savez_compressed(file, **vars(sample))
    part.replace(path)
