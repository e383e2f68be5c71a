"""Draws the lanes around the camera from above: what wears along lanes reads this map."""

from collections.abc import Mapping, Sequence
from zlib import crc32

import numpy as np
from OpenGL import GL as gl  # noqa: N811

from envgen_usd.models.array_types import FloatArray
from envgen_usd.render.cameras.camera_pose import Pose
from envgen_usd.render.opengl import gpu
from envgen_usd.render.render_scene import Lane

SIDE = 256.0
"""Side of the map, metres; beyond it lanes do not wear."""
_TEXELS = 512
_AHEAD = 90.0
"""Distance of the map's middle from the camera, metres, in the direction of the view."""
_HALF_WIDTH = 2.1
"""Metres to which a lane reaches from its centre line; a larger value wears wider lanes."""
_START = 4096.0
"""Metres over which the starts of lanes spread, so that no two wear alike."""
_VERTEX = np.dtype([("place", "<f4", 3), ("lane", "<f4", 2), ("direction", "<f4", 2)])


class LaneMap:
    """Place along and across the nearest lane, its direction and its height, around the camera."""

    def __init__(self, lanes: Sequence[Lane]) -> None:
        """Compiles the program; `lanes` are those of the scene."""
        self._ribbons = lane_ribbons(lanes)
        self._middles = self._ribbons[..., :2].mean(axis=1)
        self._program = gpu.Program("lane_map.vert", "lane_map.frag")
        self._target = gpu.render_target((_TEXELS, _TEXELS), (gl.GL_RGBA32UI,))
        self._array = int(gl.glGenVertexArrays(1))
        self._corner = np.zeros(2)

    def draw(self, pose: Pose) -> None:
        """Draws the lanes around a camera and ahead of it."""
        eye, ahead = pose.matrix[:3, 3], pose.matrix[:2, 2]
        self._corner = _AHEAD * ahead - SIDE / 2
        self._target.bind()
        gl.glDepthMask(True)
        far = np.array([0, 0, 0, np.float32(1e9).view(np.uint32)], np.uint32)
        gl.glClearBufferuiv(gl.GL_COLOR, 0, far)
        gl.glClearBufferfv(gl.GL_DEPTH, 0, np.ones(1, np.float32))
        place = self._middles - eye[:2] - self._corner
        shown = ((place > -20.0) & (place < SIDE + 20.0)).all(axis=1)
        if not shown.any():
            return
        gl.glBindVertexArray(self._array)
        count, vertices = _upload(self._ribbons[shown], eye)
        gl.glEnable(gl.GL_DEPTH_TEST)
        gl.glDepthFunc(gl.GL_LESS)
        self._program.use()
        self._program.set(corner=(*self._corner, SIDE))
        gl.glDrawArrays(gl.GL_TRIANGLES, 0, count)
        gl.glDeleteBuffers(1, [vertices])

    def bind(self, unit: int) -> Mapping[str, gpu.Value]:
        """Binds the map to a unit, and returns the uniforms of ``surface_wear.glsl``."""
        gpu.bind_texture(unit, self._target.colours[0])
        return {"lane_map": unit, "lane_map_corner": (*self._corner, SIDE / _TEXELS)}


def lane_ribbons(lanes: Sequence[Lane]) -> FloatArray:
    """Quadrilaterals along all lanes.

    Returns:
        N x 4 x 7: x, y, z (world), s, t, and the direction (x, y), at the right and the left of the
        start of each segment, then of its end. s and t are metres along the lane and to its left.
    """
    parts = [_ribbon(lane) for lane in lanes]
    return np.concatenate(parts) if parts else np.empty((0, 4, 7))


def _ribbon(lane: Lane) -> FloatArray:
    """N x 4 x 7 of a lane; neighbours share their corners, so that bends leave no gap."""
    step = np.diff(lane.points[:, :2], axis=0)
    length = np.hypot(step[:, 0], step[:, 1])
    kept = length > 1e-6
    points = lane.points[np.concatenate(([True], kept))]
    step, length = step[kept], length[kept]
    if not len(step):
        return np.empty((0, 4, 7))
    along = step / length[:, None]
    start = _START * (crc32(lane.id.encode()) % 1024) / 1024
    s = start + np.concatenate(([0.0], np.cumsum(length)))
    mean = np.concatenate((along[:1], along[:-1] + along[1:], along[-1:]))
    mean /= np.maximum(np.linalg.norm(mean, axis=1, keepdims=True), 1e-6)
    left = np.stack((-mean[:, 1], mean[:, 0]), axis=1)
    corners = np.empty((len(step), 4, 7))
    for number, (end, side) in enumerate(((0, -1), (0, 1), (1, -1), (1, 1))):
        own = slice(end, end + len(step))
        corners[:, number, :2] = points[own, :2] + side * _HALF_WIDTH * left[own]
        corners[:, number, 2] = points[own, 2]
        corners[:, number, 3] = s[own]
        corners[:, number, 4] = side * _HALF_WIDTH
    corners[:, :, 5:] = along[:, None]
    return corners


def _upload(ribbons: FloatArray, eye: FloatArray) -> tuple[int, int]:
    """Uploads two triangles a quadrilateral; returns the number of vertices and the buffer."""
    corners = ribbons[:, (0, 1, 2, 2, 1, 3)].reshape(-1, 7)
    vertices = np.empty(len(corners), _VERTEX)
    vertices["place"] = corners[:, :3] - eye
    vertices["lane"], vertices["direction"] = corners[:, 3:5], corners[:, 5:]
    handle = gpu.buffer(gl.GL_ARRAY_BUFFER, vertices)
    for place, name in enumerate(_VERTEX.names or ()):
        gpu.vertex_attribute(place, _VERTEX, name, gl.GL_FLOAT, False)
    return len(vertices), handle
