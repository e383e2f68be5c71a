"""Textures on the GPU, with mipmaps that hold the coverage of cut-outs."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from OpenGL import GL as gl  # noqa: N811
from PIL import Image

from envgen_usd.models.array_types import ByteArray, FloatArray
from envgen_usd.render.opengl import gpu
from envgen_usd.render.opengl.texture_store import TextureStore
from envgen_usd.render.render_scene import Material, Texture
from envgen_usd.render.stage.texture_images import read_texture


class TextureTable:
    """Textures by use; an image is uploaded once for each use."""

    def __init__(self, kept: Path | None = None) -> None:
        """Starts with a white texture of a single pixel.

        Args:
            kept: Folder for textures as the GPU takes them; `None` keeps none.
        """
        self._handles: dict[tuple[object, ...], int] = {}
        self._means: dict[int, tuple[float, float, float]] = {}
        names = (gl.glGetString(name) for name in (gl.GL_RENDERER, gl.GL_VERSION))
        self._store = TextureStore(kept, " ".join(name.decode() for name in names))
        self._white = _started([np.full((1, 1, 4), 255, np.uint8)], False, (True, True))

    def colour(self, material: Material) -> int:
        """Colour, with the opacity in the fourth channel."""
        base = material.textures.get("diffuse")
        cut = material.textures.get("opacity")
        limit = material.opacity_threshold if cut is not None else 0.0
        srgb = bool(base and base.srgb)
        return self._handle(
            ("colour", base, cut, limit),
            lambda: _cut_out_mipmaps(_colour(base, cut), srgb, limit),
            srgb=srgb,
        )

    def mean(self, handle: int) -> tuple[float, float, float]:
        """Mean colour of a texture of colours, linear RGB."""
        return self._means.get(handle, (1.0, 1.0, 1.0))

    def surface(self, material: Material) -> int:
        """Normal in the first three channels, in -1 to 1, and roughness in the fourth."""
        normal, rough = material.textures.get("normal"), material.textures.get("roughness")
        return self._handle(
            ("surface", normal, rough, material.roughness),
            lambda: [_surface(normal, rough, material.roughness)],
            srgb=False,
        )

    def emission(self, material: Material) -> int:
        """Emitted light; white without a texture."""
        glow = material.textures.get("emissive")
        return self._handle(
            ("emission", glow, None, 0.0),
            lambda: [_colour(glow, None)],
            srgb=bool(glow and glow.srgb),
        )

    def close(self) -> None:
        """Ends the uploads."""
        self._store.close()

    def _handle(
        self,
        key: tuple[str, Texture | None, Texture | None, float],
        made: Callable[[], list[ByteArray]],
        *,
        srgb: bool,
    ) -> int:
        """The texture of a use, from the store or newly made."""
        use, first, second, figure = key
        chosen = first or second
        if chosen is None:
            return self._white
        if key not in self._handles:
            place = self._store.place(use, (first, second), figure)
            known = self._store.find(place)
            handle = self._handles[key] = _started(known or made(), srgb, chosen.repeat)
            levels = known or _mipmaps(only_last=place is None)
            self._means[handle] = _linear(levels[-1][0, 0, :3] / 255.0, srgb)
            if known is None:
                self._store.keep(place, levels)
        return self._handles[key]


def _colour(base: Texture | None, cut: Texture | None) -> ByteArray:
    pixels = read_texture(base) if base is not None else np.full((1, 1, 4), 255, np.uint8)
    if cut is None:
        pixels[..., 3] = 255
        return pixels
    opacity = read_texture(cut)[..., cut.channel]
    pixels = _resized(pixels, opacity.shape[:2])
    pixels[..., 3] = opacity
    return pixels


def _surface(normal: Texture | None, rough: Texture | None, roughness: float) -> ByteArray:
    flat = np.full((1, 1, 4), (128, 128, 255, 255), np.uint8)
    pixels = read_texture(normal) if normal is not None else flat
    values = np.full((1, 1), round(255 * roughness), np.uint8)
    values = read_texture(rough)[..., rough.channel] if rough is not None else values
    shape = max(pixels.shape[:2], values.shape[:2])
    pixels = _resized(pixels, shape)
    pixels[..., 3] = _resized(values, shape)
    return pixels


def _resized(pixels: ByteArray, shape: tuple[int, int]) -> ByteArray:
    if pixels.shape[:2] == shape:
        return pixels
    resized = Image.fromarray(pixels).resize((shape[1], shape[0]), Image.Resampling.BILINEAR)
    return np.array(resized)


def _started(levels: Sequence[ByteArray], srgb: bool, repeat: tuple[bool, bool]) -> int:
    """A new, bound texture with its mipmaps; OpenGL makes them from a single level."""
    handle = int(gl.glGenTextures(1))
    gl.glBindTexture(gl.GL_TEXTURE_2D, handle)
    height, width = levels[0].shape[:2]
    kind = gl.GL_SRGB8_ALPHA8 if srgb else gl.GL_RGBA8
    gl.glTexStorage2D(gl.GL_TEXTURE_2D, max(height, width).bit_length(), kind, width, height)
    gl.glPixelStorei(gl.GL_UNPACK_ALIGNMENT, 1)
    for number, level in enumerate(levels):
        place = (gl.GL_TEXTURE_2D, number, 0, 0, level.shape[1], level.shape[0])
        data = np.ascontiguousarray(level)
        gl.glTexSubImage2D(*place, gl.GL_RGBA, gl.GL_UNSIGNED_BYTE, data)
    if len(levels) == 1:
        gl.glGenerateMipmap(gl.GL_TEXTURE_2D)
    along_s, along_t = (gl.GL_REPEAT if each else gl.GL_CLAMP_TO_EDGE for each in repeat)
    gpu.set_sampling((gl.GL_LINEAR_MIPMAP_LINEAR, gl.GL_LINEAR), (along_s, along_t))
    return handle


def _linear(colour: FloatArray, srgb: bool) -> tuple[float, float, float]:
    """Linear RGB of a colour as a texture holds it."""
    bright = ((colour + 0.055) / 1.055) ** 2.4
    red, green, blue = np.where(colour > 0.04045, bright, colour / 12.92) if srgb else colour
    return float(red), float(green), float(blue)


def _mipmaps(*, only_last: bool) -> list[ByteArray]:
    """All levels of the bound texture, or the last: H x W x 4 each."""
    size = (gl.GL_TEXTURE_WIDTH, gl.GL_TEXTURE_HEIGHT)
    width, height = (int(gl.glGetTexLevelParameteriv(gl.GL_TEXTURE_2D, 0, side)) for side in size)
    gl.glPixelStorei(gl.GL_PACK_ALIGNMENT, 1)
    count, levels = max(height, width).bit_length(), []
    for number in range(count - 1 if only_last else 0, count):
        level = np.empty((max(height >> number, 1), max(width >> number, 1), 4), np.uint8)
        gl.glGetTexImage(gl.GL_TEXTURE_2D, number, gl.GL_RGBA, gl.GL_UNSIGNED_BYTE, level)
        levels.append(level)
    return levels


def _cut_out_mipmaps(pixels: ByteArray, srgb: bool, threshold: float) -> list[ByteArray]:
    """Mipmaps of an image with a cut-out, down to a single pixel; the image alone without one.

    The opacity of the smaller levels is the share of the first level's pixels above the threshold,
    and weights the colours. `cut.glsl` draws that share of a distant surface.
    """
    if threshold <= 0.0:
        return [pixels]
    values = pixels.astype(np.float32) / 255.0
    gamma = 2.2 if srgb else 1.0
    values[..., :3] **= gamma
    levels = [pixels]
    values[..., 3] = values[..., 3] >= threshold
    while max(values.shape[:2]) > 1:
        values = _halved(values)
        level = values.copy()
        level[..., :3] **= 1.0 / gamma
        levels.append(np.round(255.0 * np.clip(level, 0.0, 1.0)).astype(np.uint8))
    return levels


def _halved(values: NDArray[np.float32]) -> NDArray[np.float32]:
    """Means of 2 x 2 pixels; a side of a single pixel stays, and an odd last row is dropped."""
    rows, columns = (max(n // 2, 1) for n in values.shape[:2])
    steps = [min(n, 2) for n in values.shape[:2]]
    blocks = values[: rows * steps[0], : columns * steps[1]]
    blocks = blocks.reshape(rows, steps[0], columns, steps[1], 4)
    weights = blocks[..., 3:] + np.float32(1e-3)
    colours = (blocks[..., :3] * weights).sum(axis=(1, 3)) / weights.sum(axis=(1, 3))
    opacity = blocks[..., 3:].mean(axis=(1, 3))
    return np.concatenate((colours, opacity), axis=-1)
