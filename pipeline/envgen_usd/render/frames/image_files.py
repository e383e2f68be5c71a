"""Writes images, each whole or not at all.

Images are encoded in memory: a failed write then has the operating system's reason, and no library
prints or hides it.
"""

import struct
import zlib
from io import BytesIO
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from envgen_usd.models.array_types import ByteArray
from envgen_usd.render.render_scene import Floats
from envgen_usd.whole_files import write_whole

_LEVEL = 1
"""Compression level of PNG and TIFF, 0 to 9; a larger value makes smaller files more slowly."""
_SHORT, _LONG = 3, 4
"""Types of TIFF fields: numbers of 16 and 32 bits."""
_FIELD = struct.Struct("<HHII")
_TRUECOLOUR = 2
"""Colour type of PNG: pixels of red, green and blue."""


def write_png(path: Path, pixels: ByteArray | NDArray[np.uint16]) -> None:
    """Writes grey (H x W, 8 or 16 bits) or RGB (H x W x 3) images."""
    image = Image.fromarray(np.ascontiguousarray(pixels))
    with BytesIO() as encoded:
        image.save(encoded, "png", compress_level=_LEVEL)
        write_whole(path, encoded.getvalue())


def write_normals(path: Path, normals: Floats) -> None:
    """Writes unit vectors (H x W x 3) as a PNG of 16 bits: 32768 + 32767 n; 0 for no vector.

    Each row has the filter Sub (ISO/IEC 15948, 9.2): planes become zeros.
    """
    height, width = normals.shape[:2]
    values = np.round(normals * np.float32(32767.0)) + np.float32(32768.0)
    values[~normals.any(axis=2)] = 0.0
    rows = values.astype(">u2").reshape(height, 3 * width).view(np.uint8)
    filtered = np.empty((height, 1 + 6 * width), np.uint8)
    filtered[:, 0] = 1
    filtered[:, 1:7] = rows[:, :6]
    filtered[:, 7:] = rows[:, 6:] - rows[:, :-6]
    head = struct.pack(">IIBBBBB", width, height, 16, _TRUECOLOUR, 0, 0, 0)
    pixels = zlib.compress(filtered.tobytes(), _LEVEL)
    chunks = [_chunk(b"IHDR", head), _chunk(b"IDAT", pixels), _chunk(b"IEND", b"")]
    write_whole(path, b"\x89PNG\r\n\x1a\n" + b"".join(chunks))


def _chunk(kind: bytes, content: bytes) -> bytes:
    """A chunk of PNG with its length and checksum."""
    check = zlib.crc32(kind + content)
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", check)


def write_depth(path: Path, metres: Floats) -> None:
    """Writes depth (H x W) as a TIFF of 32-bit floats.

    The strip is a Deflate stream after the floating point predictor (Adobe Photoshop TIFF Technical
    Note 3, 2005), which halves it.
    """
    height, width = metres.shape
    strip = zlib.compress(_predicted(metres), _LEVEL)
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
        (317, _SHORT, 3),  # floating point predictor
        (339, _SHORT, 3),  # samples are floats
    )
    even = len(strip) + len(strip) % 2
    head = struct.pack("<2sHI", b"II", 42, 8 + even)
    table = b"".join(_FIELD.pack(tag, kind, 1, value) for tag, kind, value in fields)
    directory = struct.pack("<H", len(fields)) + table + bytes(4)
    write_whole(path, head + strip.ljust(even, b"\0") + directory)


def _predicted(values: Floats) -> bytes:
    """Differences of neighbouring bytes, after the bytes of a row are sorted by significance."""
    height, width = values.shape
    big = np.ascontiguousarray(values, ">f4").view(np.uint8).reshape(height, width, 4)
    planes = np.ascontiguousarray(big.transpose(0, 2, 1)).reshape(height, 4 * width)
    planes[:, 1:] -= planes[:, :-1].copy()
    return planes.tobytes()


def write_ids(path: Path, ids: NDArray[np.uint32]) -> None:
    """Writes ids below 2^24 (H x W) as RGB: R + 256 G + 65536 B, as COCO's panoptic PNGs."""
    split = np.stack([(ids >> shift) & 255 for shift in (0, 8, 16)], axis=-1)
    write_png(path, split.astype(np.uint8))
