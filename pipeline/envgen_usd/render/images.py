"""Writes images, each whole or not at all."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from envgen_usd.models.arrays import ByteArray
from envgen_usd.render.scene import Floats

_LEVEL = 1
"""Of PNG's compression: fast."""
_ADOBE_DEFLATE = "tiff_adobe_deflate"


def write_png(path: Path, pixels: ByteArray | NDArray[np.uint16]) -> None:
    """Writes grey (H x W, 8 or 16 bits) or RGB (H x W x 3)."""
    image = Image.fromarray(np.ascontiguousarray(pixels))
    write_whole(path, lambda part: image.save(part, "png", compress_level=_LEVEL))


def write_depth(path: Path, metres: Floats) -> None:
    """Writes depth (H x W) as a TIFF of 32-bit floats."""
    image = Image.fromarray(np.ascontiguousarray(metres))
    write_whole(path, lambda part: image.save(part, "tiff", compression=_ADOBE_DEFLATE))


def write_ids(path: Path, ids: NDArray[np.uint32]) -> None:
    """Writes ids below 2^24 (H x W) as RGB: R + 256 G + 65536 B, as COCO's panoptic PNGs."""
    split = np.stack([(ids >> shift) & 255 for shift in (0, 8, 16)], axis=-1)
    write_png(path, split.astype(np.uint8))


def write_text(path: Path, text: str) -> None:
    """Writes a text."""
    write_whole(path, lambda part: part.write_text(text, encoding="utf-8"))


def write_whole(path: Path, write: Callable[[Path], object]) -> None:
    """Lets `write` fill a file beside `path`, and then puts it in its place."""
    part = path.with_name(f".{path.name}.part")
    write(part)
    part.replace(path)
