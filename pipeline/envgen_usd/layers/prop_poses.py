"""Poses of assets, from placements and from openings in walls."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.city_model import Placement
from envgen_usd.models.polygon_arrays import Polygons

_UPRIGHT, _LEVEL = 0.1, 0.99
"""Sine of the slope above which an opening is one of a roof, and above which it is level."""


@dataclass(frozen=True)
class Pose:
    """Translation, rotation and scale of a prim.

    Attributes:
        translate: 3, metres, road frame.
        rotate: 3, degrees about x, y, z.
        scale: 3, factors along the asset's axes.
    """

    translate: FloatArray
    rotate: FloatArray
    scale: FloatArray

    def box(self, extent: FloatArray) -> FloatArray:
        """Bounding box (2 x 3, road frame) of a box (2 x 3) in the asset's frame."""
        low, high = extent * self.scale
        rotation = _rotation(self.rotate)
        middle = rotation @ ((low + high) / 2.0) + self.translate
        half = np.abs(rotation) @ np.abs((high - low) / 2.0)
        return np.stack([middle - half, middle + half])


def _rotation(degrees: FloatArray) -> FloatArray:
    """Rotation matrix (for column vectors) of rotateXYZ: first about x, then y, then z."""
    (cx, cy, cz), (sx, sy, sz) = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    about_x = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    about_y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    about_z = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    turned: FloatArray = about_z @ about_y @ about_x
    return turned


def placement_pose(placement: Placement, nominal: FloatArray) -> Pose:
    """Pose of an asset that fills a placement.

    Unspecified (zero) sizes of the placement follow from its height, or else from its width.

    Args:
        placement: Position, orientation and size.
        nominal: 3, nominal size of the asset, metres.
    """
    wanted = np.asarray(placement.size, dtype=np.float64)
    ratio = np.divide(wanted, nominal, out=np.zeros(3), where=(wanted > 0) & (nominal > 0))
    known = ratio[[2, 0, 1]]
    fallback = next((float(value) for value in known if value > 0), 1.0)
    scale = np.where(ratio > 0, ratio, fallback)
    if ratio[0] > 0 and ratio[1] <= 0:
        scale[1] = ratio[0]
    # A placement's pitch lifts +x; a positive rotation about +y lowers it.
    turn = np.degrees([placement.roll, -placement.pitch, placement.heading])
    return Pose(np.asarray(placement.position, dtype=np.float64), turn, scale)


def opening_poses(openings: Sequence[Polygons]) -> list[Pose | None]:
    """Poses of window and door assets (unit box: x width, y outwards, z height) in their openings.

    An opening in a slope, e.g. a roof window, turns the asset about its x.

    Args:
        openings: Each in the plane of its wall or roof, metres.

    Returns:
        A pose that fits the asset to the opening's rectangle; `None` for openings that are level,
        face down, or have no area.
    """
    poses: list[Pose | None] = [None] * len(openings)
    by_size: dict[int, list[int]] = {}
    rings = [polygons.rings(0)[0] if len(polygons) else np.empty((0, 3)) for polygons in openings]
    for number, ring in enumerate(rings):
        by_size.setdefault(len(ring), []).append(number)
    for size, numbers in by_size.items():
        if size > 2:
            for number, pose in zip(
                numbers, _poses(np.stack([rings[n] for n in numbers])), strict=True
            ):
                poses[number] = pose
    return poses


def _poses(rings: FloatArray) -> Iterator[Pose | None]:
    """Poses in openings of equally many corners: N x C x 3."""
    near = rings - rings[:, :1]
    normals = np.cross(near, np.roll(near, -1, axis=1)).sum(axis=1)
    lengths = np.linalg.norm(normals, axis=1)
    units = normals / np.maximum(lengths, 1e-12)[:, None]
    rise = units[:, 2]
    usable = (lengths >= 1e-4) & (rise >= -0.1) & (rise <= _LEVEL)
    outward = units[:, :2] / np.maximum(np.hypot(units[:, 0], units[:, 1]), 1e-12)[:, None]
    # Seen from outside, x points left, so that x, y (outwards) and z (up) are right-handed.
    along = np.stack([outward[:, 1], -outward[:, 0]], axis=1)
    slope = np.where(rise > _UPRIGHT, np.arcsin(np.clip(rise, -1.0, 1.0)), 0.0)
    up = np.column_stack([-np.sin(slope)[:, None] * outward, np.cos(slope)])
    place = (rings[:, :, :2] * along[:, None]).sum(axis=2)
    height = (rings * up[:, None]).sum(axis=2)
    scale = np.stack([np.ptp(place, axis=1), np.ones(len(rings)), np.ptp(height, axis=1)], axis=1)
    first = np.argmin(place, axis=1)
    every = np.arange(len(rings))
    low = rings[every, first] + up * (height.min(axis=1) - height[every, first])[:, None]
    turn = np.zeros((len(rings), 3))
    turn[:, 0], turn[:, 2] = np.degrees(slope), np.degrees(np.arctan2(along[:, 1], along[:, 0]))
    usable &= (scale[:, 0] >= 0.05) & (scale[:, 2] >= 0.05)
    for n, is_usable in enumerate(usable.tolist()):
        yield Pose(low[n], turn[n], scale[n]) if is_usable else None
