"""Places where a camera cannot be: inside of or close to what stands on a stage."""

from collections.abc import Iterator

import numpy as np

from envgen_usd.geometry.triangle_distance import nearest_points
from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray
from envgen_usd.render.render_scene import Geometry, Scene

REACH = 0.5
"""Least distance of a camera from all objects, metres; a larger value refuses more places."""
_GROUND = frozenset({"road", "sidewalk", "parking", "terrain", "bridge", "tunnel", "void"})
"""Classes whose upper sides carry a camera, however low it is; others are obstacles."""
_LEVEL = 0.5
"""Least vertical part of the unit normal of a surface that carries; a larger value is flatter."""


def refused_places(scene: Scene, eyes: FloatArray) -> BoolArray:
    """Places inside of something or within `REACH` of it; the ground below is no obstacle.

    A place is inside if the first surface above it shows its inner side. Surfaces with two outer
    sides (leaves) count by their distance only.

    Args:
        scene: Scene, or a part of it that holds everything near and above the places.
        eyes: N x 3, camera positions, world, metres.

    Returns:
        N, True for refused places.
    """
    clearance = Clearance(eyes)
    clearance.add(scene, np.arange(len(eyes)))
    return clearance.refused


class Clearance:
    """Judges places by one part of a stage after another, as `refused_places` does by all."""

    def __init__(self, eyes: FloatArray) -> None:
        """Begins with camera positions (N x 3) in empty space."""
        self._eyes = eyes
        self._close, self._inner = np.zeros((2, len(eyes)), bool)
        self._lowest = np.full(len(eyes), np.inf)

    def add(self, part: Scene, those: IntArray) -> None:
        """Adds what stands near or above some of the places, given by their numbers."""
        for body, near in _bodies_near(part, self._eyes[those]):
            for number in those[near].tolist():
                eye = self._eyes[number]
                corners = body.column(eye)
                if len(corners):
                    self._close[number] |= _is_close(corners, eye, carries=body.carries)
                    height, is_inner = _first_above(corners, eye)
                    if height < self._lowest[number]:
                        self._lowest[number] = height
                        self._inner[number] = is_inner and body.has_outside

    @property
    def refused(self) -> BoolArray:
        """N, True for refused places."""
        return self._close | self._inner


class _Body:
    """The triangles of a geometry at a place.

    Attributes:
        carries: True if its upper sides may be close below a camera.
        has_outside: True if its triangles are visible from outside only.
    """

    def __init__(self, geometry: Geometry, matrix: FloatArray, label: str) -> None:
        """Places the triangles in the world."""
        self.carries = label in _GROUND
        self.has_outside = not geometry.double_sided
        self._points = geometry.points @ matrix[:3, :3].T + matrix[:3, 3]
        mirrored = np.linalg.det(matrix[:3, :3]) < 0.0
        self._triangles = geometry.triangles[:, ::-1] if mirrored else geometry.triangles
        corners = [[self._points[index, axis] for index in self._triangles.T] for axis in range(3)]
        self._low = [np.minimum(np.minimum(a, b), c) for a, b, c in corners[:2]]
        self._high = [np.maximum(np.maximum(a, b), c) for a, b, c in corners]

    def column(self, eye: FloatArray) -> FloatArray:
        """Triangles near a place, and those above it: T x 3 x 3."""
        near = self._high[2] >= eye[2] - REACH
        for axis in range(2):
            near &= self._low[axis] <= eye[axis] + REACH
            near &= self._high[axis] >= eye[axis] - REACH
        corners: FloatArray = self._points[self._triangles[near]]
        return corners


def _bodies_near(scene: Scene, eyes: FloatArray) -> Iterator[tuple[_Body, IntArray]]:
    """Placed geometries with the indices of the places that they are near to or above."""
    order = np.argsort(eyes[:, 0], kind="stable")
    along = eyes[order, 0]
    for use in scene.uses:
        if use.level and use.level.far:
            continue
        geometry = scene.geometries[use.geometry]
        boxes = geometry.boxes(use.matrices)
        low, high = boxes[:, 0] - REACH, boxes[:, 1] + REACH
        first = np.searchsorted(along, low[:, 0])
        last = np.searchsorted(along, high[:, 0], side="right")
        for place in np.flatnonzero(last > first).tolist():
            some = order[first[place] : last[place]]
            y, z = eyes[some, 1], eyes[some, 2]
            near = some[(y >= low[place, 1]) & (y <= high[place, 1]) & (z <= high[place, 2])]
            if len(near):
                scene_object = scene.scene_objects[int(use.scene_objects[place])]
                yield _Body(geometry, use.matrices[place], scene_object.label), near


def _is_close(corners: FloatArray, eye: FloatArray, *, carries: bool) -> bool:
    """True if a triangle (T x 3 x 3) that does not carry the camera is within `REACH`."""
    offsets = nearest_points(corners, eye) - eye
    close = np.linalg.norm(offsets, axis=1) < REACH
    if carries and close.any():
        normals = _normals(corners)
        level = np.abs(normals[:, 2]) >= _LEVEL * np.linalg.norm(normals, axis=1)
        close &= ~(level & (offsets[:, 2] < 0.0))
    return bool(close.any())


def _first_above(corners: FloatArray, eye: FloatArray) -> tuple[float, bool]:
    """Height of the first triangle above a place, and whether it shows its inner side."""
    a, b, c = (corners[:, k, :2] - eye[:2] for k in range(3))
    weights = np.stack([_cross(b, c), _cross(c, a), _cross(a, b)], axis=1)
    area = weights.sum(axis=1)
    hit = ((weights >= 0.0).all(axis=1) | (weights <= 0.0).all(axis=1)) & (area != 0.0)
    heights = (weights[hit] * corners[hit, :, 2]).sum(axis=1) / area[hit]
    heights = np.where(heights >= eye[2], heights, np.inf)
    if not len(heights):
        return np.inf, False
    nearest = int(heights.argmin())
    return float(heights[nearest]), bool(area[hit][nearest] > 0.0)


def _cross(one: FloatArray, other: FloatArray) -> FloatArray:
    """The vertical part of the cross products of plan vectors (N x 2)."""
    product: FloatArray = one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0]
    return product


def _normals(corners: FloatArray) -> FloatArray:
    """Normals of triangles (T x 3 x 3), as long as twice their area."""
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
