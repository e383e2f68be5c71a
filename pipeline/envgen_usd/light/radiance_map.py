"""Reads and writes images of linear radiance (OpenEXR)."""

from pathlib import Path

import numpy as np
import OpenEXR
from numpy.typing import NDArray

from envgen_usd.whole_files import whole_file


def write_radiance_map(path: Path, pixels: NDArray[np.floating]) -> None:
    """Writes linear RGB (H x W x 3) as half floats, whole or not at all."""
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    channels = {"RGB": np.ascontiguousarray(pixels, np.float16)}
    with whole_file(path) as part:
        OpenEXR.File(header, channels).write(str(part))


def read_radiance_map(path: Path) -> NDArray[np.float32]:
    """Reads linear RGB, H x W x 3.

    Raises:
        ValueError: The file is no OpenEXR image of colours.
    """
    try:
        with OpenEXR.File(str(path)) as image:
            # The arrays go with the file.
            pixels = {name: channel.pixels.copy() for name, channel in image.channels().items()}
    except (RuntimeError, OSError) as error:
        raise ValueError("no OpenEXR image") from error
    name = next((name for name in ("RGB", "RGBA") if name in pixels), None)
    if name is None:
        raise ValueError("no channels R, G and B")
    return np.asarray(pixels[name][..., :3], np.float32)
