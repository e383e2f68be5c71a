"""Marks the pixels that objects would cover if nothing hid them."""

import ctypes

import numpy as np
from numpy.typing import NDArray
from OpenGL import GL as gl  # noqa: N811

from envgen_usd.models.array_types import BoolArray, FloatArray
from envgen_usd.render.cameras.camera_rig import Camera
from envgen_usd.render.opengl import gpu
from envgen_usd.render.opengl.draw_list import DrawList
from envgen_usd.render.opengl.shader_looks import CutProgram, Looks

MASK_BITS = 32
"""Pixels in a word of a mask."""


class Silhouettes:
    """A mask for each object of a frame. Needs a current context for its whole life."""

    def __init__(self, camera: Camera, draws: DrawList, looks: Looks) -> None:
        """Creates the buffers; they get their sizes with each frame."""
        self._draws, self._looks = draws, looks
        self._programs = CutProgram("mesh.vert", "silhouettes.frag", "OUTLINES")
        self._size = camera.width, camera.height
        self._target = gpu.render_target(self._size, ())
        self._slots, self._masks = (int(gl.glGenBuffers(1)) for _ in range(2))

    def masks(
        self, clip: FloatArray, chosen: BoolArray, slots: NDArray[np.uint32]
    ) -> NDArray[np.uint32]:
        """Draws instances without a depth test.

        Args:
            clip: 4 x 4, from positions relative to the camera to clip space; the draw list already
                looks from there.
            chosen: N, instances in the view.
            slots: Number of the object of each scene object, from 1; 0 for those without a mask.

        Returns:
            Objects x words, a bit for each pixel in the order of their numbers; the first bit is
            that of the first pixel of the last row.
        """
        width, height = self._size
        count, words = int(slots.max(initial=0)), -(-width * height // MASK_BITS)
        masks = np.zeros((max(count, 1), words), np.uint32)
        for binding, (handle, data) in enumerate(((self._slots, slots), (self._masks, masks))):
            gl.glBindBufferBase(gl.GL_SHADER_STORAGE_BUFFER, binding, handle)
            gl.glBufferData(gl.GL_SHADER_STORAGE_BUFFER, data.nbytes, data, gl.GL_STREAM_READ)
        self._target.bind()
        gl.glDisable(gl.GL_DEPTH_TEST)
        sizes = {"image_width": width, "mask_words": words}
        self._programs.set(clip=clip, **sizes, **self._looks.units, **self._draws.units)
        self._draws.draw(
            chosen, lambda m: self._looks.set_cut(self._programs, m), alike=self._looks.alike
        )
        gl.glMemoryBarrier(gl.GL_BUFFER_UPDATE_BARRIER_BIT)
        gl.glBindBuffer(gl.GL_SHADER_STORAGE_BUFFER, self._masks)
        kind, size = gl.GL_SHADER_STORAGE_BUFFER, masks.nbytes
        place = ctypes.c_void_p(gl.glMapBufferRange(kind, 0, size, gl.GL_MAP_READ_BIT))
        ctypes.memmove(masks.ctypes.data, place, size)
        gl.glUnmapBuffer(kind)
        gl.glEnable(gl.GL_DEPTH_TEST)
        return masks[:count]
