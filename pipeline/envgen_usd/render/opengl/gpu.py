"""Buffers, shader programs and framebuffers on the GPU. Needs a current context."""

import ctypes
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import resources
from typing import Any

import numpy as np
from numpy.typing import NDArray
from OpenGL import GL as gl  # noqa: N811
from OpenGL.GL import shaders

_INCLUDE = "#include "
NO_DEPTH = 0
"""Depth texture of a target without depth."""
Matrix = NDArray[Any]
Value = float | Sequence[float] | Matrix
Uniforms = Mapping[str, int | float | tuple[float, ...] | NDArray[np.float32]]
"""Values by the names of the uniforms."""
_VECTORS = {2: gl.glUniform2f, 3: gl.glUniform3f, 4: gl.glUniform4f}


class Program:
    """A program of shaders of the package."""

    def __init__(
        self, vertex: str, fragment: str, *names: str, geometry: str | None = None
    ) -> None:
        """Compiles files of ``renders/shaders``, with names defined for the preprocessor."""
        parts = [(vertex, gl.GL_VERTEX_SHADER), (fragment, gl.GL_FRAGMENT_SHADER)]
        if geometry:
            parts.append((geometry, gl.GL_GEOMETRY_SHADER))
        compiled = [shaders.compileShader(_defined(name, names), kind) for name, kind in parts]
        self.handle = int(shaders.compileProgram(*compiled, validate=False))
        self._places: dict[str, int] = {}
        self._values: dict[str, float | tuple[float, ...] | bytes] = {}

    def use(self) -> None:
        """Makes this program current."""
        gl.glUseProgram(self.handle)

    def set(self, **values: Value) -> None:
        """Sets uniforms of the current program: integer, float, vector, matrix, N x 3 vectors.

        A uniform keeps its value; the same value is not sent again.
        """
        self.send(encoded(values))

    def send(self, uniforms: Uniforms) -> None:
        """Sets uniforms of the current program; as `set`, for values that are used often."""
        for name, figures in uniforms.items():
            known = figures if isinstance(figures, int | float | tuple) else figures.tobytes()
            if self._values.get(name) == known:
                continue
            self._values[name] = known
            place = self._places.get(name)
            if place is None:
                place = self._places[name] = gl.glGetUniformLocation(self.handle, name)
            if place < 0:
                continue
            if isinstance(figures, int):
                gl.glUniform1i(place, figures)
            elif isinstance(figures, float):
                gl.glUniform1f(place, figures)
            elif isinstance(figures, tuple):
                _VECTORS[len(figures)](place, *figures)
            else:
                _set_array(place, figures)


def encoded(values: Mapping[str, Value]) -> Uniforms:
    """Values of uniforms as OpenGL takes them, to be sent to several programs."""
    return {name: _figures(value) for name, value in values.items()}


def _figures(value: Value) -> int | float | tuple[float, ...] | NDArray[np.float32]:
    if isinstance(value, int | float):
        return value
    figures = np.asarray(value, np.float32)
    return tuple(figures.tolist()) if figures.ndim == 1 else figures


@dataclass(frozen=True)
class Target:
    """A framebuffer with a texture for each attachment.

    Attributes:
        handle: OpenGL name of the framebuffer.
        size: Width and height, pixels.
        colours: Colour textures.
        depth: Depth texture.
    """

    handle: int
    size: tuple[int, int]
    colours: tuple[int, ...]
    depth: int

    def bind(self) -> None:
        """Makes this framebuffer the draw target."""
        gl.glBindFramebuffer(gl.GL_FRAMEBUFFER, self.handle)
        gl.glViewport(0, 0, *self.size)


def render_target(
    size: tuple[int, int], formats: Sequence[int], depth: int | None = None
) -> Target:
    """A framebuffer with a colour texture for each format, and 32-bit float depth.

    Args:
        size: Width and height, pixels.
        formats: Formats of the colour textures.
        depth: Depth texture of another target to share, or `NO_DEPTH`.
    """
    handle = int(gl.glGenFramebuffers(1))
    gl.glBindFramebuffer(gl.GL_FRAMEBUFFER, handle)
    colours = tuple(_texture(size, kind) for kind in formats)
    places = [gl.GL_COLOR_ATTACHMENT0 + index for index in range(len(formats))]
    for place, texture in zip(places, colours, strict=True):
        gl.glFramebufferTexture(gl.GL_FRAMEBUFFER, place, texture, 0)
    if depth is None:
        depth = _texture(size, gl.GL_DEPTH_COMPONENT32F)
    gl.glFramebufferTexture(gl.GL_FRAMEBUFFER, gl.GL_DEPTH_ATTACHMENT, depth, 0)
    gl.glDrawBuffers(len(places), places or [gl.GL_NONE])
    status = gl.glCheckFramebufferStatus(gl.GL_FRAMEBUFFER)
    if status != gl.GL_FRAMEBUFFER_COMPLETE:
        raise RuntimeError(f"framebuffer is not complete: {status}")
    return Target(handle, size, colours, depth)


def shadow_target(side: int) -> Target:
    """A square framebuffer with a filtered depth-comparison texture for shadows."""
    target = render_target((side, side), ())
    gl.glBindTexture(gl.GL_TEXTURE_2D, target.depth)
    set_sampling((gl.GL_LINEAR, gl.GL_LINEAR), (gl.GL_CLAMP_TO_EDGE, gl.GL_CLAMP_TO_EDGE))
    compare = gl.GL_TEXTURE_COMPARE_MODE, gl.GL_COMPARE_REF_TO_TEXTURE
    gl.glTexParameteri(gl.GL_TEXTURE_2D, *compare)
    gl.glTexParameteri(gl.GL_TEXTURE_2D, gl.GL_TEXTURE_COMPARE_FUNC, gl.GL_LEQUAL)
    return target


def depth_image(size: tuple[int, int]) -> int:
    """A texture for depths in metres, for `fill_depth_image`; width and height in pixels."""
    return _texture(size, gl.GL_R32F)


def fill_depth_image(depth: NDArray[np.float32]) -> None:
    """Fills the bound texture with depths, H x W, first row at the top."""
    height, width = depth.shape
    rows = np.ascontiguousarray(depth[::-1], np.float32)
    gl.glTexSubImage2D(gl.GL_TEXTURE_2D, 0, 0, 0, width, height, gl.GL_RED, gl.GL_FLOAT, rows)


def set_sampling(filters: tuple[int, int], wraps: tuple[int, int]) -> None:
    """Sets the filters (smaller, larger) and the wrap modes (s, t) of the bound texture."""
    names = gl.GL_TEXTURE_MIN_FILTER, gl.GL_TEXTURE_MAG_FILTER
    places = gl.GL_TEXTURE_WRAP_S, gl.GL_TEXTURE_WRAP_T
    for name, value in zip((*names, *places), (*filters, *wraps), strict=True):
        gl.glTexParameteri(gl.GL_TEXTURE_2D, name, value)


def bind_texture(unit: int, texture: int) -> None:
    """Binds a texture to a unit."""
    gl.glActiveTexture(gl.GL_TEXTURE0 + unit)
    gl.glBindTexture(gl.GL_TEXTURE_2D, texture)


def read_pixels(target: Target, attachment: int, layout: int, kind: int) -> NDArray[Any]:
    """An attachment as an array, first row at the top: H x W, or H x W x channels."""
    width, height = target.size
    gl.glBindFramebuffer(gl.GL_READ_FRAMEBUFFER, target.handle)
    gl.glReadBuffer(gl.GL_COLOR_ATTACHMENT0 + attachment)
    types = {gl.GL_UNSIGNED_BYTE: np.uint8, gl.GL_UNSIGNED_INT: np.uint32, gl.GL_FLOAT: np.float32}
    channels = {gl.GL_RGB: (3,), gl.GL_RG_INTEGER: (2,)}.get(layout, ())
    pixels = np.empty((height, width, *channels), types[kind])
    gl.glPixelStorei(gl.GL_PACK_ALIGNMENT, 1)
    gl.glReadPixels(0, 0, width, height, layout, kind, pixels)
    return pixels[::-1]


def buffer(kind: int, data: NDArray[Any]) -> int:
    """A buffer with the given data, bound to its target."""
    handle = int(gl.glGenBuffers(1))
    gl.glBindBuffer(kind, handle)
    gl.glBufferData(kind, max(data.nbytes, 1), data if data.nbytes else None, gl.GL_STATIC_DRAW)
    return handle


def vertex_attribute(  # noqa: PLR0913, PLR0917 - as glVertexAttribPointer
    place: int, dtype: np.dtype[Any], name: str, kind: int, normalised: bool, divisor: int = 0
) -> None:
    """Describes a field of the bound buffer's structure; unsigned integers stay integers."""
    assert dtype.fields is not None
    field, offset = dtype.fields[name][:2]
    width = int(np.prod(field.shape)) if field.shape else 1
    for row in range(max(width // 4, 1)):
        start = ctypes.c_void_p(offset + row * 16)
        gl.glEnableVertexAttribArray(place + row)
        if kind == gl.GL_UNSIGNED_INT:
            gl.glVertexAttribIPointer(place + row, width, kind, dtype.itemsize, start)
        else:
            size = min(width, 4)
            gl.glVertexAttribPointer(place + row, size, kind, normalised, dtype.itemsize, start)
        gl.glVertexAttribDivisor(place + row, divisor)


def _set_array(place: int, value: NDArray[np.float32]) -> None:
    if value.ndim == 2 and value.shape[0] != value.shape[1]:
        gl.glUniform3fv(place, len(value), np.ascontiguousarray(value))
    else:
        setters = {3: gl.glUniformMatrix3fv, 4: gl.glUniformMatrix4fv}
        setters[len(value)](place, 1, gl.GL_TRUE, value)


def _defined(name: str, names: Sequence[str]) -> str:
    """Source of a shader with names defined after its version."""
    version, _, rest = _source(name).partition("\n")
    return "\n".join((version, *(f"#define {defined}" for defined in names), rest))


def _source(name: str) -> str:
    """Source of a shader with its includes expanded."""
    folder = resources.files("envgen_usd.renders") / "shaders"
    lines = (folder / name).read_text(encoding="utf-8").splitlines()
    return "\n".join(
        _source(line.removeprefix(_INCLUDE).strip('"')) if line.startswith(_INCLUDE) else line
        for line in lines
    )


def _texture(size: tuple[int, int], kind: int) -> int:
    texture = int(gl.glGenTextures(1))
    gl.glBindTexture(gl.GL_TEXTURE_2D, texture)
    gl.glTexStorage2D(gl.GL_TEXTURE_2D, 1, kind, *size)
    set_sampling((gl.GL_NEAREST, gl.GL_NEAREST), (gl.GL_CLAMP_TO_EDGE, gl.GL_CLAMP_TO_EDGE))
    return texture
