"""Barriers that follow a road: guard rails, walls, fences (repeats with distance 0, 13.2)."""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from envgen_usd.models.arrays import FloatArray
from envgen_usd.models.road import Road
from envgen_usd.models.road_objects import Repeat, RoadObject
from envgen_usd.opendrive.features.instances import at
from envgen_usd.opendrive.features.kinds import Kind
from envgen_usd.opendrive.features.poses import heading_at, points_beside, sample
from envgen_usd.opendrive.features.solids import flat_triangles, sweep

LONGEST = 50.0
"""Metres that one feature is long, so that each lies in the part of the map that shows it."""
POST_SPACING = 4.0
"""Metres between the posts of a guard rail, 2 m for fences and railings."""
MATERIALS = {
    "guard_rail": "metal_galvanised",
    "jersey": "concrete",
    "railing": "metal_galvanised",
    "fence": "metal_galvanised",
    "beam": "metal_galvanised",
    "wall": "concrete",
}
_THICKNESS = {
    "guard_rail": 0.08,
    "jersey": 0.6,
    "railing": 0.05,
    "fence": 0.05,
    "beam": 0.08,
    "wall": 0.3,
}
_JERSEY_ACROSS = (-0.5, 0.5, 0.5, 0.21, 0.13, -0.13, -0.21, -0.5)
_JERSEY_UP = (0.0, 0.0, 0.09, 0.41, 1.0, 1.0, 0.41, 0.09)
_JERSEY = np.column_stack([_JERSEY_ACROSS, _JERSEY_UP])
"""New Jersey profile, as shares of width and height."""


def pieces(thing: RoadObject) -> Iterator[list[Repeat]]:
    """Continuous repeats of an object, cut and gathered to groups of at most `LONGEST`."""
    group: list[Repeat] = []
    for repeat in thing.repeats:
        for piece in _cut(thing, repeat) if repeat.distance == 0 else ():
            if group and sum(each.length for each in group) + piece.length > LONGEST:
                yield group
                group = []
            group.append(piece)
    if group:
        yield group


def _cut(thing: RoadObject, repeat: Repeat) -> Iterator[Repeat]:
    count = max(int(np.ceil(repeat.length / LONGEST)), 1)
    shares = np.linspace(0.0, 1.0, count + 1).tolist()
    for start, end in pairwise(shares):
        first, last = at(thing, repeat, start), at(thing, repeat, end)
        yield Repeat(
            repeat.s + start * repeat.length,
            (end - start) * repeat.length,
            0.0,
            (first["t"], last["t"]),
            (first["z_offset"], last["z_offset"]),
            (first["width"], last["width"]),
            (first["height"], last["height"]),
            (first["length"], last["length"]),
            (first["radius"], last["radius"]),
        )


def barrier(road: Road, thing: RoadObject, repeat: Repeat, kind: Kind) -> list[FloatArray]:
    """Bodies of a continuous repeat.

    Width, height, t and z offset run linearly from its start to its end.

    Args:
        road: The road.
        thing: The object.
        repeat: A repeat with distance 0.
        kind: Kind of the object; its section and height hold where the file gives none.

    Returns:
        Triangles of each body (T x 3 x 3), none if the repeat has no length on the road.
    """
    mean_t = float(np.nanmean([*repeat.t, thing.t]))
    s = sample(road, repeat.s, repeat.s + repeat.length, mean_t)
    if len(s) < 2:
        return []
    section = kind.section or "wall"
    bodies = [
        _sweep(road, s, shape, *_sizes(thing, repeat, kind, (s - repeat.s) / repeat.length))
        for shape in _sections(section)
    ]
    bodies += _posts(road, thing, repeat, kind)
    return bodies


def _sections(section: str) -> Iterator[FloatArray]:
    """Cross-sections (K x 2) as shares of width (-0.5 to 0.5) and height (0 to 1)."""
    if section == "jersey":
        yield _JERSEY
    elif section == "guard_rail":
        yield _box(0.59, 1.0)
    elif section == "railing":
        yield _box(0.95, 1.0)
        yield _box(0.48, 0.53)
    else:
        yield _box(0.0, 1.0)


def _box(low: float, high: float) -> FloatArray:
    return np.array([(-0.5, low), (0.5, low), (0.5, high), (-0.5, high)])


def _sizes(
    thing: RoadObject, repeat: Repeat, kind: Kind, share: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """t, z offset, width and height at shares (0 to 1) of the repeat."""
    first, last = at(thing, repeat, 0.0), at(thing, repeat, 1.0)
    between = {name: first[name] + (last[name] - first[name]) * share for name in first}
    width, height = between["width"], between["height"]
    width = np.where(width > 0, width, _THICKNESS[kind.section or "wall"])
    height = np.where(height > 0, height, kind.height or 1.0)
    return between["t"], between["z_offset"], width, height


def _sweep(  # noqa: PLR0913, PLR0917 - the four sizes belong together
    road: Road,
    s: FloatArray,
    section: FloatArray,
    t: FloatArray,
    z: FloatArray,
    width: FloatArray,
    height: FloatArray,
) -> FloatArray:
    across, up = section.T
    s_all = np.repeat(s, len(section))
    t_all = (t[:, None] + width[:, None] * across).ravel()
    base = points_beside(road, s_all, t_all, np.repeat(z, len(section)))
    base[:, 2] += (height[:, None] * up).ravel()
    return sweep(base.reshape(len(s), len(section), 3), flat_triangles(section))


def _posts(road: Road, thing: RoadObject, repeat: Repeat, kind: Kind) -> list[FloatArray]:
    spacing = {"guard_rail": POST_SPACING, "railing": 2.0, "fence": 2.0}.get(kind.section)
    if spacing is None:
        return []
    count = max(int(repeat.length / spacing), 1)
    share = (np.arange(count) + 0.5) / count
    s = repeat.s + share * repeat.length
    inside = (s >= 0) & (s <= road.length)
    s, share = s[inside], share[inside]
    t, z, width, height = _sizes(thing, repeat, kind, share)
    behind = np.sign(t) * (width / 2 + 0.06) if kind.section == "guard_rail" else 0.0
    foot = points_beside(road, s, t + behind, z)
    return [
        _post(place, heading, tall)
        for place, heading, tall in zip(foot, heading_at(road, s), height * 0.98, strict=True)
    ]


def _post(foot: FloatArray, heading: float, height: float) -> FloatArray:
    ring = np.array([(-0.05, -0.05), (0.05, -0.05), (0.05, 0.05), (-0.05, 0.05)])
    turn = np.array([[np.cos(heading), -np.sin(heading)], [np.sin(heading), np.cos(heading)]])
    low = np.column_stack([foot[:2] + ring @ turn.T, np.full(4, foot[2])])
    return sweep(
        np.stack([low, low + np.array([0.0, 0.0, height])]), np.array([(0, 1, 2), (0, 2, 3)])
    )
