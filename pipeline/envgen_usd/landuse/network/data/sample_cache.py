"""Samples on disk: reads them, and generates missing samples."""

from collections.abc import Callable, Iterator
from dataclasses import fields
from pathlib import Path
from typing import TypeVar

import numpy as np

from envgen_usd.landuse.network.data.training_sample import Sample
from envgen_usd.whole_files import make_folder, whole_file

S = TypeVar("S", bound=Sample)


def read_samples(
    folder: Path, stream: str, numbers: range, kind: type[S], make: Callable[[int], S]
) -> Iterator[S]:
    """Yields samples of a stream; generates and keeps missing samples.

    Args:
        folder: Folder of the samples; created if missing.
        stream: Name of the stream, including the seed.
        numbers: Positions in the stream.
        kind: Class of the samples.
        make: Generates the sample of a position.
    """
    make_folder(folder)
    for number in numbers:
        path = folder / f"{stream}_{number}.npz"
        if not path.exists():
            _write(make(number), path)
        with np.load(path, allow_pickle=False) as data:
            yield kind(**{field.name: data[field.name] for field in fields(kind)})


def _write(sample: Sample, path: Path) -> None:
    with whole_file(path) as part:
        np.savez_compressed(part, **vars(sample))
