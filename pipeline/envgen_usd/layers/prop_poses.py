"""Poses of assets, from placements and from openings in walls."""

import math
from dataclasses import dataclass

import numpy as np

from envgen_usd.assets.polygon_mesh import face_normals
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
        corners = np.stack(np.meshgrid(*extent.T, indexing="ij"), axis=-1).reshape(-1, 3)
        turned = (corners * self.scale) @ _rotation(self.rotate).T + self.translate
        return np.stack([turned.min(axis=0), turned.max(axis=0)])


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


def opening_pose(polygons: Polygons) -> Pose | None:
    """Pose of a window or door asset (unit box: x width, y outwards, z height) in its opening.

    An opening in a slope, e.g. a roof window, turns the asset about its x.

    Args:
        polygons: The opening in the plane of its wall or roof, metres.

    Returns:
        Pose that fits the asset to the opening's rectangle; `None` for openings that are level,
        face down, or have no area.
    """
    if not len(polygons):
        return None
    ring = polygons.rings(0)[0]
    normal = face_normals(ring, np.array([len(ring)]), np.arange(len(ring)))[0]
    length = float(np.linalg.norm(normal))
    if length < 1e-4 or not -0.1 * length <= normal[2] <= _LEVEL * length:
        return None
    outward = np.array([normal[0], normal[1]]) / math.hypot(normal[0], normal[1])
    # Seen from outside, x points left, so that x, y (outwards) and z (up) are right-handed.
    along = np.array([outward[1], -outward[0], 0.0])
    slope = math.asin(normal[2] / length) if normal[2] > _UPRIGHT * length else 0.0
    up = np.append(-math.sin(slope) * outward, math.cos(slope))
    place, rise = ring @ along, ring @ up
    scale = np.array([np.ptp(place), 1.0, np.ptp(rise)])
    if scale[0] < 0.05 or scale[2] < 0.05:
        return None
    corner = ring[int(np.argmin(place))]
    low = corner + up * (rise.min() - corner @ up)
    heading = math.degrees(math.atan2(along[1], along[0]))
    return Pose(low, np.array([math.degrees(slope), 0.0, heading]), scale)
