"""Reads the images of textures."""

from io import BytesIO

import numpy as np
from PIL import Image

from envgen_usd.errors import EnvgenError
from envgen_usd.image_pixels import UNREADABLE, to_rgba
from envgen_usd.models.array_types import ByteArray
from envgen_usd.render.render_scene import Texture
from envgen_usd.render.stage.resolved_files import read_resolved

_MAX_SIDE = 2048


def read_texture(texture: Texture) -> ByteArray:
    """An image as a new H x W x 4, scaled and biased, bottom row first.

    Raises:
        EnvgenError: The file is missing or no image.
    """
    try:
        with Image.open(BytesIO(read_resolved(texture.path))) as image:
            image.thumbnail((_MAX_SIDE, _MAX_SIDE))
            pixels = _bottom_up(image)
    except UNREADABLE as error:
        raise EnvgenError(f"{texture.path}: is not an image: {error}") from error
    plain = ((1.0,) * 4, (0.0,) * 4), ((2.0, 2.0, 2.0, 1.0), (-1.0, -1.0, -1.0, 0.0))
    if (texture.scale, texture.bias) in plain:
        return pixels
    values = pixels * np.array(texture.scale) + 255.0 * np.array(texture.bias)
    changed: ByteArray = np.round(np.clip(values, 0, 255)).astype(np.uint8)
    return changed


def _bottom_up(image: Image.Image) -> ByteArray:
    """Pixels of an image, H x W x 4, bottom row first."""
    # Pillow holds three colours in four bytes: to hand them out is ten times as fast as to convert.
    is_opaque = image.mode == "RGB"
    whole = image if is_opaque else to_rgba(image)
    data = bytearray(whole.tobytes("raw", "RGBX" if is_opaque else "RGBA", 0, -1))
    pixels: ByteArray = np.frombuffer(data, np.uint8).reshape(image.height, image.width, 4)
    if is_opaque:
        pixels[..., 3] = 255
    return pixels
