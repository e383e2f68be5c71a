"""Roofs over any footprint: slopes that rise from all walls, or a flat roof behind a parapet."""

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np
import shapely

from envgen_usd.city.buildings.building_faces import Face, Ring
from envgen_usd.models.array_types import FloatArray

_HIGHEST_RISE = 5.0
"""Largest rise of a roof, metres; a larger value makes roofs of wide houses higher."""
Profile = tuple[tuple[float, float], ...]
"""Points of a roof from the walls to the top: share of the plan around the middle, share of the
rise."""
_STEPS = np.linspace(0.0, 90.0, 7)
PROFILES: Mapping[str, Profile] = {
    "pyramidal": ((1.0, 0.0), (0.0, 1.0)),
    "dome": tuple(
        (float(np.cos(angle)), float(np.sin(angle))) for angle in np.radians(_STEPS).tolist()
    ),
    # Within its walls: a wider onion would reach into what stands beside it.
    "onion": (
        (1.0, 0.0), (0.99, 0.12), (0.93, 0.26), (0.8, 0.39), (0.58, 0.51), (0.36, 0.61),
        (0.2, 0.72), (0.1, 0.85), (0.0, 1.0),
    ),
}  # fmt: skip
"""Roofs that end in a point over the middle."""
_LEAST_RISE = 0.8
"""Least rise of a roof, metres; lower ones are flat."""
_TRIES = np.linspace(1.0, 0.15, 18)
"""Tried depths of the slopes as shares of the largest."""
_PARAPET = 0.25
"""Thickness of a parapet, metres."""


def ring_at(points: FloatArray, height: float) -> Ring:
    """A ring in plan, N x 2, at a height."""
    return [(x, y, height) for x, y in points.tolist()]


def level_face(rings: Sequence[FloatArray], height: float, kind: str, part: str) -> Face:
    """A horizontal face; ground looks down.

    Args:
        rings: Exterior and courts in plan, with the building to the left.
        height: Metres above the floor.
        kind: CityGML class.
        part: Part of the building.
    """
    outer, *courts = (ring_at(ring, height) for ring in rings)
    if kind == "GroundSurface":
        return Face(kind, part, outer[::-1], [court[::-1] for court in courts])
    return Face(kind, part, outer, courts)


def flat_roof(
    rings: Sequence[FloatArray], eaves: float, parapet: float
) -> tuple[list[Face], float]:
    """A flat roof at the height of the eaves, and the height of the walls below it.

    The walls end at the top of the parapet, where there is room for one.

    Args:
        rings: Exterior and courts in plan, with the building to the left.
        eaves: Height of the roof above the floor, metres.
        parapet: Height of the parapet above the roof, metres; 0 without one.
    """
    inner = [moved_inwards(ring, _PARAPET) for ring in rings] if parapet > 0.0 else []
    if not inner or not _is_sound(rings, inner):
        return [level_face(rings, eaves, "RoofSurface", "flat")], eaves
    top = round(eaves + parapet, 3)
    faces = [level_face(inner, eaves, "RoofSurface", "flat")]
    for ring, inside in zip(rings, inner, strict=True):
        out, high, low = ring_at(ring, top), ring_at(inside, top), ring_at(inside, eaves)
        for n in range(len(out)):
            after = (n + 1) % len(out)
            quad = [out[n], out[after], high[after], high[n]]
            faces.append(Face("RoofSurface", "coping", quad))
            back = [high[n], high[after], low[after], low[n]]
            faces.append(Face("WallSurface", "parapet", back))
    return faces, top


def sloped_roof(
    rings: Sequence[FloatArray], eaves: float, slope: float
) -> tuple[list[Face], float] | None:
    """Slopes of one pitch over all walls, level where they end, and the height of their top.

    They reach as far inwards as each side keeps its direction; `None` where that leaves no height.

    Args:
        rings: Exterior and courts in plan, with the building to the left.
        eaves: Height of the walls above the floor, metres.
        slope: Tangent of the pitch.
    """
    inner = _inner_rings(rings, max(slope, 0.1))
    if inner is None:
        return None
    inside, rise = inner
    faces = [level_face(inside, eaves + rise, "RoofSurface", "flat")]
    for ring, within in zip(rings, inside, strict=True):
        low, high = ring_at(ring, eaves), ring_at(within, eaves + rise)
        for n in range(len(low)):
            after = (n + 1) % len(low)
            quad = [low[n], low[after], high[after], high[n]]
            faces.append(Face("RoofSurface", "slope", quad))
    return faces, eaves + rise


def pointed_roof(
    rings: Sequence[FloatArray], eaves: float, rise: float, profile: Profile = PROFILES["pyramidal"]
) -> list[Face]:
    """Slopes from all walls to a point over the middle; none where a wall does not see it.

    Args:
        rings: Exterior and courts in plan, with the building to the left.
        eaves: Height of the walls above the floor, metres.
        rise: Height of the point above the eaves, metres.
        profile: Of the slopes, from the walls to the point.
    """
    ring = rings[0]
    middle = shapely.get_coordinates(shapely.Polygon(ring).centroid)[0]
    (x0, y0), (x1, y1) = (ring - middle).T, (np.roll(ring, -1, axis=0) - middle).T
    away = (x0 * y1 - x1 * y0) / np.hypot(x1 - x0, y1 - y0)
    if len(rings) > 1 or away.min() < 0.2 or rise < _LEAST_RISE:
        return []
    # A ring and its smaller copies have parallel sides, so what lies between them is plane.
    levels = [
        ring_at(middle + share * (ring - middle), eaves + height * rise)
        for share, height in profile[:-1]
    ]
    faces = [
        Face("RoofSurface", "slope", [low[i - 1], low[i], high[i], high[i - 1]])
        for low, high in pairwise(levels)
        for i in range(len(ring))
    ]
    top = (*middle.tolist(), eaves + rise)
    last = levels[-1]
    return faces + [
        Face("RoofSurface", "slope", [last[i - 1], last[i], top]) for i in range(len(ring))
    ]


def _inner_rings(
    rings: Sequence[FloatArray], slope: float
) -> tuple[list[FloatArray], float] | None:
    """Rings moved inwards by the same distance, and the rise there; `None` without room."""
    outer = shapely.Polygon(rings[0], rings[1:])
    widest = 2.0 * outer.area / outer.length
    most = min(_HIGHEST_RISE / slope, 0.98 * widest)
    for share in _TRIES.tolist():
        depth = share * most
        if depth * slope < _LEAST_RISE:
            return None
        moved = [moved_inwards(ring, depth) for ring in rings]
        if _is_sound(rings, moved):
            return moved, round(depth * slope, 3)
    return None


def moved_inwards(ring: FloatArray, depth: float) -> FloatArray:
    """A ring whose sides are moved to their left by the same distance."""
    steps = np.roll(ring, -1, axis=0) - ring
    normals = np.stack([-steps[:, 1], steps[:, 0]], axis=1)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    before = np.roll(normals, 1, axis=0)
    # The corner moves along the sum of both normals until it is as far from both sides.
    both = before + normals
    size = np.maximum((both * normals).sum(1, keepdims=True), 1e-6)
    moved: FloatArray = ring + depth * both / size
    return moved


def _is_sound(rings: Sequence[FloatArray], inner: Sequence[FloatArray]) -> bool:
    """True if moved rings bound an area within the others, and no side has turned."""
    if not all(_keeps(ring, inside) for ring, inside in zip(rings, inner, strict=True)):
        return False
    shape = shapely.Polygon(inner[0], inner[1:])
    outer = shapely.Polygon(rings[0], rings[1:])
    return bool(shape.is_valid and shape.area > 0.5 and outer.contains(shape))


def _keeps(ring: FloatArray, inside: FloatArray) -> bool:
    """True if each side keeps its direction and some length."""
    steps = np.roll(ring, -1, axis=0) - ring
    moved = np.roll(inside, -1, axis=0) - inside
    ahead = (steps * moved).sum(1) / np.linalg.norm(steps, axis=1)
    return bool((ahead > 0.05).all())
