"""Images of any kind as pixels of eight bits."""

import numpy as np
from PIL import Image

UNREADABLE = (OSError, SyntaxError, TypeError, ValueError, Image.DecompressionBombError)
"""What Pillow raises on files that are no images, are damaged, or have 179 million pixels."""
_TOP = 65535.0
"""Largest value of grey images of sixteen bits."""


def to_rgba(image: Image.Image) -> Image.Image:
    """Converts an image to RGBA of eight bits.

    Grey images of sixteen bits (modes ``I`` and ``I;16``) and of floats in 0 to 1 (``F``) are
    scaled; Pillow's own conversion would clip them at 255.
    """
    if image.mode.startswith(("I", "F")):
        values = np.asarray(image, np.float64)
        top = _TOP if image.mode.startswith("I") else 1.0
        image = Image.fromarray(np.round(255 * np.clip(values / top, 0, 1)).astype(np.uint8))
    return image.convert("RGBA")
