"""Opens files that may be packed with gzip or bzip2, with bounds on what they unfold to.

A file is packed if it begins as one, whatever its name. Its content is unfolded while it is read,
never to a disk. Formats that hold several files (zip) are refused.
"""

import bz2
import gzip
import io
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO, cast

from envgen_usd.errors import EnvgenError

LARGEST_CONTENT = 8 << 30
"""Largest content of a packed file, bytes; a larger value lets a small file keep a reader busy."""
LARGEST_WHOLE = 1 << 30
"""Largest content in bytes that a reader may hold in memory as a whole."""
LARGEST_RATIO = 100
"""Largest content in packed sizes; maps and city models have 5 to 49, a bomb has 1000 and more."""
_ALWAYS = 16 << 20
"""Content in bytes below which no ratio is refused."""
_PACKINGS = (".gz", ".bz2")
_GZIP, _BZIP2 = b"\x1f\x8b", b"BZh"
_OTHERS = {b"PK\x03\x04": "zip", b"\xfd7zXZ": "xz", b"(\xb5/\xfd": "zstd"}


def is_packed(path: Path) -> bool:
    """Whether a file begins like a packed one, also of a kind that is refused."""
    with path.open("rb") as file:
        return file.read(8).startswith((_GZIP, _BZIP2, *_OTHERS))


def content_suffix(path: Path) -> str:
    """Suffix of a file's content in lower case: ``.xodr`` for ``map.xodr.gz``."""
    return _unpacked(path).suffix.lower()


def content_stem(path: Path) -> str:
    """Name of a file without the suffixes of its content and its packing."""
    return _unpacked(path).stem


def _unpacked(path: Path) -> Path:
    inner = Path(path.stem)
    return inner if path.suffix.lower() in _PACKINGS and inner.suffix else path


@contextmanager
def open_content(path: Path, most: int = LARGEST_CONTENT) -> Iterator[BinaryIO]:
    """Opens the content of a plain or packed file for reading from begin to end.

    The stream has the attribute ``name``. It cannot be rewound.

    Args:
        path: The file.
        most: Largest content of a packed file, bytes; a plain file has no bound here.

    Yields:
        The stream. It raises `EnvgenError` where the packed content is damaged, larger than
        `most`, or larger than `LARGEST_RATIO` packed sizes.

    Raises:
        EnvgenError: The file is no regular file, or its packing is unknown.
        OSError: The file cannot be opened.
    """
    if path.exists() and not path.is_file():
        raise EnvgenError(f"{path}: not a regular file; give the path of a file")
    with path.open("rb") as file:
        begin = file.peek(8)[:8]
        kind = next((name for mark, name in _OTHERS.items() if begin.startswith(mark)), None)
        if kind:
            raise EnvgenError(
                f"{path}: is a {kind} archive; unpack it, or pack the file with gzip or bzip2"
            )
        if begin.startswith(_GZIP):
            unfolded: BinaryIO = cast("BinaryIO", gzip.GzipFile(fileobj=file))
        elif begin.startswith(_BZIP2):
            unfolded = cast("BinaryIO", bz2.BZ2File(file))
        else:
            yield file
            return
        bound = min(most, max(_ALWAYS, LARGEST_RATIO * path.stat().st_size))
        with io.BufferedReader(_Bounded(path, unfolded, bound), 1 << 16) as stream:
            yield stream


def read_content(path: Path, most: int = LARGEST_CONTENT) -> bytes:
    """Content of a plain or packed file; see `open_content`."""
    with open_content(path, most) as stream:
        return stream.read()


def check_content(path: Path, most: int = LARGEST_CONTENT) -> None:
    """Refuses a packed file beyond the bounds, for a library that unfolds it by itself.

    Raises:
        EnvgenError: As in `open_content`, or the file cannot be opened.
    """
    try:
        if is_packed(path):
            with open_content(path, most) as stream:
                while stream.read(1 << 20):
                    pass
    except OSError as error:
        raise EnvgenError(f"{path}: cannot be read: {error.strerror or error}") from error


class _Bounded(io.RawIOBase):
    """The content of a packed file, up to a bound."""

    def __init__(self, path: Path, unfolded: BinaryIO, bound: int) -> None:
        super().__init__()
        self.name = str(path)
        self._unfolded = unfolded
        self._bound = bound
        self._read = 0

    def readable(self) -> bool:
        """True."""
        return True

    def readinto(self, buffer: memoryview) -> int:  # type: ignore[override]
        """Reads the next bytes; 0 at the end."""
        try:
            block = self._unfolded.read(len(buffer))
        except (EOFError, OSError, zlib.error) as error:
            fault = str(error).rstrip(".") or type(error).__name__
            raise EnvgenError(
                f"{self.name}: the packed content is damaged ({fault}); get the file again"
            ) from error
        self._read += len(block)
        if self._read > self._bound:
            raise EnvgenError(
                f"{self.name}: unfolds to more than {self._bound >> 20} MiB, refused; unpack it "
                "yourself if you trust it, and give the plain file"
            )
        buffer[: len(block)] = block
        return len(block)
