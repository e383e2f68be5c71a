"""Writes images, each whole or not at all.

Images are encoded in memory: a failed write then has the operating system's reason, and no library
prints or hides it.
"""

import struct
from pathlib import Path

import deflate
import numpy as np
from numpy.typing import NDArray

from envgen_usd.models.array_types import ByteArray
from envgen_usd.render.render_scene import Floats
from envgen_usd.whole_files import write_whole

_LEVEL = 1
"""Compression level of PNG and TIFF, 1 to 12 (libdeflate). 2 takes half as long again and saves 6 %
of a picture; level 1 of zlib takes twice as long for the same size. ISA-L takes half as long for
files 5 % larger, but of one picture it once wrote two streams, a byte apart (libdeflate never has,
says its maker: https://github.com/ebiggers/libdeflate/issues/400)."""
_SHORT, _LONG = 3, 4
"""Types of TIFF fields: numbers of 16 and 32 bits."""
_FIELD = struct.Struct("<HHII")
_UNSIGNED, _FLOATS = 1, 3
"""Kinds of samples of TIFF."""
_NO_PREDICTOR, _FLOAT_PREDICTOR = 1, 3
"""Predictors of TIFF: what is compressed are the samples, or their differences by bytes."""
_UNKNOWN_FLOW = 1e10
"""Value of unknown flow in .flo files."""
MOST_FLOW = 1e9
"""Largest known flow in .flo files, pixels; what is larger is unknown."""
_GREY, _TRUECOLOUR = 0, 2
"""Colour types of PNG: one sample a pixel, or red, green and blue."""
_UP = 2
"""Filter of PNG: the difference to the pixel above."""


def write_png(path: Path, pixels: ByteArray | NDArray[np.uint16]) -> None:
    """Writes grey (H x W) or RGB (H x W x 3) images of 8 or 16 bits.

    Each row has the filter Up (ISO/IEC 15948, 9.2). To try all five for each row, as libpng does,
    takes twice as long and saves 1 % of a picture.
    """
    height, width = pixels.shape[:2]
    big = np.ascontiguousarray(pixels, pixels.dtype.newbyteorder(">"))
    rows = big.view(np.uint8).reshape(height, -1)
    filtered = np.empty((height, 1 + rows.shape[1]), np.uint8)
    filtered[:, 0] = _UP
    filtered[0, 1:] = rows[0]
    np.subtract(rows[1:], rows[:-1], out=filtered[1:, 1:])
    colours = _GREY if pixels.ndim == 2 else _TRUECOLOUR
    bits = 8 * pixels.dtype.itemsize
    head = struct.pack(">IIBBBBB", width, height, bits, colours, 0, 0, 0)
    stream = deflate.zlib_compress(filtered.tobytes(), _LEVEL)
    chunks = [_chunk(b"IHDR", head), _chunk(b"IDAT", stream), _chunk(b"IEND", b"")]
    write_whole(path, b"\x89PNG\r\n\x1a\n" + b"".join(chunks))


def write_normals(path: Path, normals: Floats) -> None:
    """Writes unit vectors (H x W x 3) as a PNG of 16 bits: 32768 + 32767 n; 0 for no vector."""
    values = np.round(normals * np.float32(32767.0)) + np.float32(32768.0)
    values[~normals.any(axis=2)] = 0.0
    write_png(path, values.astype(np.uint16))


def _chunk(kind: bytes, content: bytes | bytearray) -> bytes:
    """A chunk of PNG with its length and checksum."""
    check = deflate.crc32(kind + content)
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", check)


def write_depth(path: Path, metres: Floats) -> None:
    """Writes depth (H x W) as a TIFF of 32-bit floats.

    The floating point predictor (Adobe Photoshop TIFF Technical Note 3, 2005) halves the file.
    """
    _write_tiff(path, metres.shape, _predicted(metres), _FLOATS, _FLOAT_PREDICTOR)


def write_instances(path: Path, values: NDArray[np.uint32]) -> None:
    """Writes instance values (H x W) as a TIFF of unsigned numbers of 32 bits."""
    _write_tiff(path, values.shape, values.astype("<u4").tobytes(), _UNSIGNED, _NO_PREDICTOR)


def write_flow(path: Path, flow: Floats) -> None:
    """Writes optical flow (H x W x 2) as Middlebury's .flo; 1e10 where it is NaN.

    Format: Baker and others, "A database and evaluation methodology for optical flow" (2011).
    """
    height, width = flow.shape[:2]
    known = np.where(np.isnan(flow), np.float32(_UNKNOWN_FLOW), flow).astype("<f4")
    write_whole(path, struct.pack("<4sii", b"PIEH", width, height) + known.tobytes())


def _write_tiff(
    path: Path, shape: tuple[int, ...], samples: bytes, kind: int, predictor: int
) -> None:
    """Writes a sample of 32 bits for each pixel, as a strip in a Deflate stream."""
    height, width = shape
    strip = deflate.zlib_compress(samples, _LEVEL)
    fields = (
        (256, _LONG, width),
        (257, _LONG, height),
        (258, _SHORT, 32),  # bits of a sample
        (259, _SHORT, 8),  # Deflate
        (262, _SHORT, 1),  # black is zero
        (273, _LONG, 8),  # where the strip begins: after the header
        (277, _SHORT, 1),  # samples of a pixel
        (278, _LONG, height),  # rows of a strip
        (279, _LONG, len(strip)),
        (317, _SHORT, predictor),
        (339, _SHORT, kind),
    )
    even = len(strip) + len(strip) % 2
    head = struct.pack("<2sHI", b"II", 42, 8 + even)
    table = b"".join(_FIELD.pack(tag, form, 1, value) for tag, form, value in fields)
    directory = struct.pack("<H", len(fields)) + table + bytes(4)
    write_whole(path, head + strip.ljust(even, b"\0") + directory)


def _predicted(values: Floats) -> bytes:
    """Differences of neighbouring bytes, after the bytes of a row are sorted by significance."""
    height, width = values.shape
    big = np.ascontiguousarray(values, ">f4").view(np.uint8).reshape(height, width, 4)
    planes = np.ascontiguousarray(big.transpose(0, 2, 1)).reshape(height, 4 * width)
    planes[:, 1:] -= planes[:, :-1].copy()
    return planes.tobytes()
