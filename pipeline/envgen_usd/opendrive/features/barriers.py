"""Barriers: along a road (repeats with distance 0, 13.2), and single straight elements."""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.road import Road
from envgen_usd.models.road_objects import Repeat, RoadObject
from envgen_usd.opendrive.features.object_instances import Instance, at
from envgen_usd.opendrive.features.object_kinds import Kind, element_length
from envgen_usd.opendrive.features.roadside_poses import heading_at, points_beside, sample
from envgen_usd.opendrive.features.swept_solids import flat_triangles, sweep

LONGEST = 50.0
"""Largest length of a feature in metres; a smaller value splits barriers into more features."""
ALONE = 2.0
"""Length in metres of a barrier without a repeat, an outline and a length."""
POST_SPACING = 4.0
"""Metres between the posts of a guard rail; fences and railings have 2 m."""
_SPACINGS = {"guard_rail": POST_SPACING, "railing": 2.0, "fence": 2.0}
_BEHIND = 0.06
"""Metres from the back of a guard rail to the axis of its posts."""
_THICKNESS = {
    "guard_rail": 0.08,
    "jersey": 0.6,
    "railing": 0.05,
    "fence": 0.05,
    "beam": 0.08,
    "wall": 0.3,
    "hedge": 0.6,
}
_JERSEY_ACROSS = (-0.5, 0.5, 0.5, 0.21, 0.13, -0.13, -0.21, -0.5)
_JERSEY_UP = (0.0, 0.0, 0.09, 0.41, 1.0, 1.0, 0.41, 0.09)
_JERSEY = np.column_stack([_JERSEY_ACROSS, _JERSEY_UP])
"""New Jersey profile as shares of width and height."""
_SHEET = 0.12
"""Thickness of a guard rail's sheet as a share of the rail's width."""
_WAVE = np.array(
    [(-0.38, 0.59), (-0.38, 0.605), (0.5, 0.66), (0.5, 0.70), (-0.28, 0.755), (-0.28, 0.835),
     (0.5, 0.89), (0.5, 0.93), (-0.38, 0.985), (-0.38, 1.0)]
)  # fmt: skip
_BEAM = np.concatenate([_WAVE, _WAVE[::-1] - (_SHEET, 0.0)])
"""W-profile of a guard rail (AASHTO M 180) as shares of width and height; it bulges to +across."""
_CLIPPED = np.array(
    [(-0.42, 0.0), (0.42, 0.0), (0.5, 0.3), (0.47, 0.82), (0.34, 1.0), (-0.34, 1.0), (-0.47, 0.82),
     (-0.5, 0.3)]
)  # fmt: skip
"""Profile of a clipped hedge as shares of width and height."""


def pieces(road_object: RoadObject) -> Iterator[list[Repeat]]:
    """Yields groups of continuous repeats of an object, each at most `LONGEST` long."""
    group: list[Repeat] = []
    for repeat in road_object.repeats:
        for piece in _cut(road_object, repeat) if repeat.distance == 0 else ():
            if group and sum(each.length for each in group) + piece.length > LONGEST:
                yield group
                group = []
            group.append(piece)
    if group:
        yield group


def _cut(road_object: RoadObject, repeat: Repeat) -> Iterator[Repeat]:
    count = max(int(np.ceil(repeat.length / LONGEST)), 1)
    shares = np.linspace(0.0, 1.0, count + 1).tolist()
    for start, end in pairwise(shares):
        first, last = at(road_object, repeat, start), at(road_object, repeat, end)
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


def barrier(road: Road, road_object: RoadObject, repeat: Repeat, kind: Kind) -> list[FloatArray]:
    """Returns the bodies of a continuous repeat.

    Width, height, t and z offset run linearly from its start to its end.

    Args:
        road: The road.
        road_object: The object.
        repeat: A repeat with distance 0.
        kind: Kind of the object; gives the section, and the height where the file gives none.

    Returns:
        Triangles of each body (T x 3 x 3, metres); empty for a repeat without length on the road.
    """
    mean_t = float(np.nanmean([*repeat.t, road_object.t]))
    s = sample(road, repeat.s, repeat.s + repeat.length, mean_t)
    if len(s) < 2:
        return []
    section = kind.section or "wall"
    bodies = [
        _sweep(road, s, shape, *_sizes(road_object, repeat, kind, (s - repeat.s) / repeat.length))
        for shape in _sections(section, left=mean_t > 0.0)
    ]
    bodies += _posts(road, road_object, repeat, kind)
    return bodies


def barrier_element(instance: Instance, kind: Kind) -> list[FloatArray]:
    """Returns the bodies of a barrier without a repeat: straight along its own x axis.

    Args:
        instance: The object with its pose.
        kind: Kind of the object; gives the section, and the height where the file gives none.

    Returns:
        Triangles of each body, T x 3 x 3, metres.
    """
    road_object, pose = instance.road_object, instance.pose
    length = element_length(road_object) or ALONE
    width = road_object.width or _THICKNESS[kind.section]
    height = road_object.height or kind.height
    bodies = []
    away = float(np.sign(road_object.t * np.cos(road_object.heading)))
    for section in _sections(kind.section, left=away > 0.0):
        across, up = np.tile(section, (2, 1)).T
        along = np.repeat([-length / 2, length / 2], len(section))
        rings = pose.places(np.column_stack([along, width * across, height * up]))
        bodies.append(sweep(rings.reshape(2, len(section), 3), flat_triangles(section)))
    spacing = _SPACINGS.get(kind.section, np.inf)
    count = max(int(length / spacing), int(np.isfinite(spacing)))
    share = (np.arange(count) + 0.5) / max(count, 1)
    behind = away * (width / 2 + _BEHIND) if kind.section == "guard_rail" else 0.0
    feet = pose.places(np.column_stack([(share - 0.5) * length, share * 0 + behind, share * 0]))
    return bodies + [_post(foot, pose.heading, height * 0.98) for foot in feet]


def _sections(section: str, *, left: bool) -> Iterator[FloatArray]:
    """Yields cross-sections (K x 2) as shares of width (-0.5 to 0.5) and height (0 to 1).

    Guard rails bulge towards the road, which lies to the right of a rail on its `left`.
    """
    if section == "jersey":
        yield _JERSEY
    elif section == "guard_rail":
        yield _BEAM[::-1] * (-1.0, 1.0) if left else _BEAM
    elif section == "hedge":
        yield _CLIPPED
    elif section == "railing":
        yield _box(0.95, 1.0)
        yield _box(0.48, 0.53)
    else:
        yield _box(0.0, 1.0)


def _box(low: float, high: float) -> FloatArray:
    return np.array([(-0.5, low), (0.5, low), (0.5, high), (-0.5, high)])


def _sizes(
    road_object: RoadObject, repeat: Repeat, kind: Kind, share: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Returns t, z offset, width and height at shares (0 to 1) of the repeat, metres."""
    first, last = at(road_object, repeat, 0.0), at(road_object, repeat, 1.0)
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


def _posts(road: Road, road_object: RoadObject, repeat: Repeat, kind: Kind) -> list[FloatArray]:
    spacing = _SPACINGS.get(kind.section)
    if spacing is None:
        return []
    count = max(int(repeat.length / spacing), 1)
    share = (np.arange(count) + 0.5) / count
    s = repeat.s + share * repeat.length
    inside = (s >= 0) & (s <= road.length)
    s, share = s[inside], share[inside]
    t, z, width, height = _sizes(road_object, repeat, kind, share)
    behind = np.sign(t) * (width / 2 + _BEHIND) if kind.section == "guard_rail" else 0.0
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
