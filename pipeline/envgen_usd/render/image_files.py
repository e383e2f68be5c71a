"""Writes images, each whole or not at all."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from envgen_usd.models.array_types import ByteArray
from envgen_usd.render.render_scene import Floats
from envgen_usd.whole_files import whole_file

_LEVEL = 1
"""Compression level of PNG, 0 to 9; a larger value makes smaller files more slowly."""
_ADOBE_DEFLATE = "tiff_adobe_deflate"


def write_png(path: Path, pixels: ByteArray | NDArray[np.uint16]) -> None:
    """Writes grey (H x W, 8 or 16 bits) or RGB (H x W x 3) images."""
    image = Image.fromarray(np.ascontiguousarray(pixels))
    with whole_file(path) as part:
        image.save(part, "png", compress_level=_LEVEL)


def write_depth(path: Path, metres: Floats) -> None:
    """Writes depth (H x W) as a TIFF of 32-bit floats."""
    image = Image.fromarray(np.ascontiguousarray(metres))
    with whole_file(path) as part:
        image.save(part, "tiff", compression=_ADOBE_DEFLATE)


def write_ids(path: Path, ids: NDArray[np.uint32]) -> None:
    """Writes ids below 2^24 (H x W) as RGB: R + 256 G + 65536 B, as COCO's panoptic PNGs."""
    split = np.stack([(ids >> shift) & 255 for shift in (0, 8, 16)], axis=-1)
    write_png(path, split.astype(np.uint8))
