"""Heads: skull, jaw, nose, ears, eyes, neck, and hair that follows a hairline."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from envgen_usd.assets.people.lofted_forms import Loft, joined, star
from envgen_usd.assets.people.pose_skeleton import Skeleton
from envgen_usd.assets.polygon_mesh import Mesh
from envgen_usd.models.array_types import FloatArray

# Ellipsoids of a man's head about the middle between the ears: middle and radii, metres.
_SKULL = np.array(
    [
        [[-0.010, 0.0, 0.024], [0.098, 0.076, 0.088]],
        [[0.030, 0.0, -0.030], [0.060, 0.060, 0.060]],
        [[0.036, 0.0, -0.066], [0.044, 0.044, 0.042]],
        [[0.058, 0.0, -0.092], [0.024, 0.026, 0.018]],
        [[0.072, 0.0, 0.016], [0.018, 0.046, 0.012]],
        [[0.070, 0.0, -0.060], [0.021, 0.026, 0.016]],
    ]
)
_NOSE = np.array(
    [
        [[0.091, 0.0, -0.004], [0.012, 0.010, 0.022]],
        [[0.100, 0.0, -0.024], [0.017, 0.014, 0.013]],
    ]
)
_MELT = 0.016
"""Distance over which the parts of a head melt into one another, metres."""
_STEPS = 24
"""Halvings of the search for the surface; a larger value finds it more exactly."""
_FACE = np.radians([-140, -100, -68, -42, -22, -8, 8, 22, 42, 68, 100, 140, 180])
_PARALLELS = np.radians([-64, -50, -40, -31, -22, -14, -5, 7, 20, 40, 64])
_AZIMUTH = np.radians([0, 25, 45, 62, 80, 98, 120, 150, 180])


@dataclass(frozen=True)
class Hair:
    """Hair, or what covers a head.

    Attributes:
        line: Elevation of its lower edge at `_AZIMUTH` from the front to the back, degrees.
        thick: Thickness, metres.
        mane: Drop of long hair below the middle of the head, metres; 0 for short hair.
        bun: Radius of a bun, or of the root of a tail, metres; 0 for neither.
        tail: Length of a tail, metres.
        visor: True for a helmet that covers the face, with a dark visor.
    """

    line: tuple[float, ...]
    thick: float = 0.018
    mane: float = 0.0
    bun: float = 0.0
    tail: float = 0.0
    visor: bool = False


SHORT = Hair((47, 46, 40, 22, -8, -22, -36, -44, -46), 0.013)
FULL = Hair((44, 42, 34, 12, -16, -38, -50, -54, -54), 0.019)
RECEDING = Hair((66, 62, 44, 20, -6, -22, -36, -44, -46), 0.011)
LONG = Hair((46, 42, 28, 2, -40, -70, -80, -80, -80), 0.022, mane=0.24)
BOB = Hair((42, 40, 30, 6, -42, -60, -66, -66, -66), 0.026, mane=0.13)
TIED = Hair((46, 44, 36, 18, -10, -26, -40, -46, -46), 0.014, bun=0.030, tail=0.20)
BUN = Hair((46, 44, 36, 18, -10, -26, -40, -46, -46), 0.014, bun=0.040)
HELMET = Hair((38, 36, 30, 20, 8, -4, -12, -18, -20), 0.036)
FULL_FACE = Hair((-70, -70, -70, -66, -62, -60, -58, -56, -56), 0.042, visor=True)
BEANIE = Hair((30, 28, 22, 12, 2, -8, -18, -26, -28), 0.022)


def _distance(points: FloatArray, parts: FloatArray) -> FloatArray:
    """Signed distance (N) to ellipsoids (P x 2 x 3) that melt together, about metres."""
    offset = points[:, None] - parts[:, 0]
    near = np.linalg.norm(offset / parts[:, 1], axis=2)
    slope = np.linalg.norm(offset / parts[:, 1] ** 2, axis=2)
    each = near * (near - 1.0) / np.maximum(slope, 1e-9)
    total: FloatArray = each[:, 0]
    for k in range(1, each.shape[1]):
        share = np.maximum(_MELT - np.abs(total - each[:, k]), 0.0) / _MELT
        total = np.minimum(total, each[:, k]) - share**2 * _MELT / 4.0
    return total


def _reach(directions: FloatArray, parts: FloatArray) -> FloatArray:
    """Distance (N) of the surface from the middle in each direction, by halving; read only."""
    return _halved(directions.tobytes(), parts.tobytes())


@lru_cache(maxsize=128)
def _halved(directions: bytes, parts: bytes) -> FloatArray:
    """`_reach` by the content of its arrays: a head is the same in all poses of a body."""
    towards, ellipsoids = np.frombuffer(directions), np.frombuffer(parts)
    towards, ellipsoids = towards.reshape(-1, 3), ellipsoids.reshape(-1, 2, 3)
    low, high = np.full(len(towards), 0.02), np.full(len(towards), 0.45)
    for _ in range(_STEPS):
        middle = (low + high) / 2.0
        inside = _distance(towards * middle[:, None], ellipsoids) < 0.0
        low, high = np.where(inside, middle, low), np.where(inside, high, middle)
    found: FloatArray = (low + high) / 2.0
    found.flags.writeable = False
    return found


def _covered(directions: FloatArray, hair: Hair) -> FloatArray:
    """1 for directions (N x 3) above the hairline, 0 below, between in a band of 12 degrees."""
    azimuth = np.abs(np.arctan2(directions[:, 1], directions[:, 0]))
    elevation = np.degrees(np.arcsin(np.clip(directions[:, 2], -1.0, 1.0)))
    line = np.interp(azimuth, _AZIMUTH, hair.line)
    share: FloatArray = np.clip((elevation - line) / 12.0 + 0.5, 0.0, 1.0)
    return share


def head_meshes(skeleton: Skeleton) -> tuple[Mesh, Mesh]:
    """Head with ears and neck: near and far."""
    size = skeleton.build.head
    parts = np.concatenate([_SKULL, _NOSE]) * size

    def reach(directions: FloatArray) -> FloatArray:
        return _reach(directions, parts)

    near = star(skeleton.skull, skeleton.head, reach, _FACE, _PARALLELS)
    angles = np.radians([-150, -90, -30, 30, 90, 150])
    far = star(skeleton.skull, skeleton.head, reach, angles, np.radians([-45, 5]))
    ears = [_ear(skeleton, sign, size) for sign in (1.0, -1.0)]
    neck = _neck(skeleton)
    return joined([near, *ears, neck.mesh(7)]), far


def _ear(skeleton: Skeleton, sign: float, size: float) -> Mesh:
    """A flat ear, a little open to the front."""
    heights = np.array([-0.036, -0.024, 0.004, 0.022, 0.029]) * size
    depth = np.array([0.003, 0.011, 0.018, 0.015, 0.004]) * size
    middle = np.stack([-0.012 - 0.15 * heights, np.full(5, sign * 0.076 * size), heights], axis=1)
    frame = skeleton.head
    ones = np.ones((5, 1))
    back = frame @ np.array([-0.9, 0.42 * sign, 0.0])
    out = frame @ np.array([0.42 * sign, 0.9, 0.0])
    sections = np.stack([np.full(5, 0.007 * size), depth, depth, np.full(5, 2.0)], axis=1)
    loft = Loft(skeleton.skull + middle @ frame.T, ones * out, -ones * back, sections)
    return loft.mesh(5)


def _neck(skeleton: Skeleton) -> Loft:
    build = skeleton.build
    girth = build.scale * (0.4 + 0.6 * build.limbs) * (0.5 + 0.5 * build.head)
    low = skeleton.of_chest(-0.01 * build.scale, 0.0, 0.825)
    high = skeleton.skull + skeleton.head @ np.array([-0.012, 0.0, -0.03])
    share = np.array([0.0, 0.3, 0.55, 0.8, 1.0])[:, None]
    centres = low + share * (high - low)
    sections = np.array(
        [[0.085, 0.060, 0.075, 2], [0.064, 0.056, 0.066, 2], [0.057, 0.055, 0.060, 2],
         [0.055, 0.055, 0.056, 2], [0.050, 0.045, 0.050, 2]]
    )  # fmt: skip
    sections[:, :3] *= girth
    axis = (high - low) / np.linalg.norm(high - low)
    left = skeleton.chest[:, 1]
    front = np.cross(left, axis)
    ones = np.ones((5, 1))
    return Loft(centres, ones * left, ones * front, sections)


def hair_meshes(skeleton: Skeleton, hair: Hair) -> tuple[Mesh, Mesh]:
    """Hair of the head with brows: near and far."""
    size = skeleton.build.head
    skull = _SKULL * size
    strands = skull
    if hair.mane:
        drop = hair.mane * size
        mane = np.array([[[-0.050 * size, 0.0, -0.45 * drop], [0.060, 0.088 * size, 0.62 * drop]]])
        strands = np.concatenate([skull, mane])

    def reach(directions: FloatArray) -> FloatArray:
        cover = _covered(directions, hair)
        bare = _reach(directions, skull)
        full = _reach(directions, strands) + hair.thick * size
        covered: FloatArray = np.where(cover > 0.0, bare + (full - bare) * cover, bare)
        return covered - 0.010 * (1.0 - cover)

    meridians = np.radians(np.arange(-153, 181, 27))
    parallels = np.radians([-68, -46, -28, -10, 8, 24, 38, 52, 72])
    near = [star(skeleton.skull, skeleton.head, reach, meridians, parallels)]
    near += [_brow(skeleton, sign, size, high=True) for sign in (1.0, -1.0)]
    near += _tied(skeleton, hair, size)
    if hair.visor:
        # Nothing of the face shows.
        near = near[:1]
    angles = np.radians([-150, -90, -30, 30, 90, 150])
    far = star(skeleton.skull, skeleton.head, reach, angles, np.radians([-40, 15, 50]))
    return joined(near), far


def eye_meshes(skeleton: Skeleton) -> list[Mesh]:
    """The dark of both eyes with the lashes."""
    return [_brow(skeleton, sign, skeleton.build.head, high=False) for sign in (1.0, -1.0)]


def visor_mesh(skeleton: Skeleton, hair: Hair) -> Mesh:
    """The visor of a helmet: it stands out of the shell before the eyes."""
    size = skeleton.build.head

    def reach(directions: FloatArray) -> FloatArray:
        azimuth = np.degrees(np.abs(np.arctan2(directions[:, 1], directions[:, 0])))
        elevation = np.degrees(np.arcsin(directions[:, 2]))
        window = np.minimum((72.0 - azimuth) / 6.0, (17.0 - np.abs(elevation - 4.0)) / 4.0)
        lift = hair.thick + 0.012 * np.clip(window, -3.0, 1.0)
        total: FloatArray = _reach(directions, _SKULL * size) + lift * size
        return total

    meridians = np.radians([-100, -74, -66, -44, -22, 0, 22, 44, 66, 74, 100, 180])
    parallels = np.radians([-60, -17, -9, 4, 17, 25, 60])
    return star(skeleton.skull, skeleton.head, reach, meridians, parallels)


def _brow(skeleton: Skeleton, sign: float, size: float, *, high: bool) -> Mesh:
    """A brow or, below it, the dark of an eye with its lashes."""
    along = np.array([-1.0, 0.0, 1.0])
    z = 0.020 - 0.004 * along**2 if high else np.full(3, 0.001)
    place = np.stack([np.full(3, 0.085), sign * 0.033 + 0.0145 * along, z], axis=1)
    away = np.linalg.norm(place, axis=1, keepdims=True)
    middle = place / away * _reach(place / away, _SKULL)[:, None] * size
    ones, frame = np.ones((3, 1)), skeleton.head
    wide = np.array([0.45, 1.0, 0.45]) * size * (0.0034 if high else 0.0050)
    deep = np.full(3, 0.0022 * size)
    sections = np.stack([wide, deep, deep, np.full(3, 2.0)], axis=1)
    loft = Loft(skeleton.skull + middle @ frame.T, ones * frame[:, 2], ones * frame[:, 0], sections)
    return loft.mesh(4)


def _tied(skeleton: Skeleton, hair: Hair, size: float) -> list[Mesh]:
    """A bun or a tail at the back of the head."""
    if not hair.bun:
        return []
    length = max(hair.tail, 2.0 * hair.bun)
    share = np.array([0.0, 0.12, 0.35, 0.65, 0.9, 1.0])
    girth = hair.bun * np.array([0.3, 0.9, 1.0, 0.8 if hair.tail else 1.0, 0.5, 0.1])
    x = -0.098 - 0.035 * np.sin(np.pi * np.minimum(share * 1.6, 1.0)) - 0.01
    z = 0.045 + (0.4 * hair.bun if not hair.tail else 0.0) - share * length
    middle = np.stack([x, np.zeros(6), z], axis=1) * size
    ones, frame = np.ones((6, 1)), skeleton.head
    sections = np.stack([girth, girth, girth, np.full(6, 2.0)], axis=1) * [size, size, size, 1.0]
    loft = Loft(skeleton.skull + middle @ frame.T, ones * frame[:, 1], ones * frame[:, 0], sections)
    return [loft.mesh(8)]
