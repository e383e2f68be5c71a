"""Samples on disk: reads them, and generates missing samples."""

import zipfile
import zlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from envgen_usd.errors import Issue, Severity
from envgen_usd.landuse.network.data.training_sample import Sample
from envgen_usd.whole_files import make_folder, whole_file

S = TypeVar("S", bound=Sample)
_DAMAGES = (
    ValueError,
    KeyError,
    EOFError,
    AttributeError,
    TypeError,
    zipfile.BadZipFile,
    zlib.error,
)
"""Errors that NumPy raises on a file that is no whole archive of arrays."""


def read_samples(  # noqa: PLR0913, PLR0917 - what a stream is
    folder: Path,
    stream: str,
    numbers: range,
    kind: type[S],
    make: Callable[[int], S],
    warn: Callable[[Issue], None] = lambda _: None,
) -> Iterator[S]:
    """Yields samples of a stream; generates and keeps missing and damaged samples.

    Args:
        folder: Folder of the samples; created if missing.
        stream: Name of the stream, including the seed.
        numbers: Positions in the stream.
        kind: Class of the samples.
        make: Generates the sample of a position.
        warn: Called with an issue for each damaged sample.
    """
    make_folder(folder)
    for number in numbers:
        path = folder / f"{stream}_{number}.npz"
        sample = _read(path, kind, warn) if path.exists() else None
        if sample is None:
            _write(make(number), path)
            with np.load(path, allow_pickle=False) as data:
                sample = _sample(data, kind)
        yield sample


def _read(path: Path, kind: type[S], warn: Callable[[Issue], None]) -> S | None:
    """A sample of a file; `None` if its checksums differ or an array is missing."""
    try:
        # NumPy would leave the file of a broken archive open.
        with path.open("rb") as file, np.load(file, allow_pickle=False) as data:
            return _sample(data, kind)
    except _DAMAGES as error:
        text = f"cannot be read: {error}"
        warn(Issue("training.damaged", Severity.WARNING, str(path), text, "sample made again"))
        return None


def _sample(data: Mapping[str, Any], kind: type[S]) -> S:
    return kind(**{field.name: data[field.name] for field in fields(kind)})


def _write(sample: Sample, path: Path) -> None:
    with whole_file(path) as part:
        np.savez_compressed(part, **vars(sample))
