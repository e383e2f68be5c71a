"""Relations between features of the road: those of the file, and those that follow from places."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import shapely

from envgen_usd.models.arrays import FloatArray
from envgen_usd.models.city import CityObject
from envgen_usd.models.lanes import DRIVEN
from envgen_usd.models.surface import LaneLine, Patch, RoadSurface

_REGULATES = frozenset(("traffic_sign", "traffic_light"))
_WALKED = frozenset(("sidewalk", "walking", "shared"))
_SIGN_REACH = 15.0
"""Metres from a sign to the nearest lane that it can hold for."""
_CROSSWALK_REACH = 1.0
"""Metres from a crosswalk to the sidewalk that it leads to."""
_SAME_WAY = np.cos(np.radians(60.0))


def with_controls(
    furniture: Sequence[CityObject], surface: RoadSurface, refer: Callable[[str], str]
) -> tuple[CityObject, ...]:
    """Returns signs and traffic lights with the lanes that they hold for as ``controls``.

    Where the file says which lanes these are, the features have them already, and there is no
    other. Else a sign faces the traffic that it holds for: of the lanes that run against its face,
    the nearest and those beside it in the same section. Relations to what the city does not hold
    are left out.

    Args:
        furniture: Features; others are returned as they are.
        surface: The road.
        refer: What a lane, a patch or a feature is referred to by; empty where it is not there.
    """
    known = [_settled(thing, refer) for thing in furniture]
    facing = [i for i, thing in enumerate(furniture) if _regulates(thing)]
    facing = [i for i in facing if "controls" not in furniture[i].relations]
    lanes = [lane for lane in surface.lanes if facing and lane.lane_type in DRIVEN]
    tree = shapely.STRtree([shapely.LineString(lane.points[:, :2]) for lane in lanes])
    for index in facing:
        ids = _controlled(furniture[index], lanes, tree)
        controls = tuple(filter(None, map(refer, ids)))
        if controls:
            relations = {**known[index].relations, "controls": controls}
            known[index] = replace(known[index], relations=relations)
    return tuple(known)


def _settled(thing: CityObject, refer: Callable[[str], str]) -> CityObject:
    """A feature whose relations lead to what there is."""
    if not thing.relations:
        return thing
    found = {role: tuple(filter(None, map(refer, ids))) for role, ids in thing.relations.items()}
    return replace(thing, relations={role: ids for role, ids in found.items() if ids})


def crosswalk_links(surface: RoadSurface) -> dict[str, tuple[str, ...]]:
    """Returns for each crosswalk the sidewalks that it leads to, and for these the crosswalks.

    Keys and values are ids of patches. Without these links no pedestrian could be routed over a
    road.
    """
    plans = {kind: _plans(surface, kind) for kind in ("crosswalk", "walk")}
    links: dict[str, list[str]] = {}
    if plans["crosswalk"] and plans["walk"]:
        tree = shapely.STRtree(list(plans["walk"].values()))
        walks = list(plans["walk"])
        for name, shape in plans["crosswalk"].items():
            near = tree.query(shape, predicate="dwithin", distance=_CROSSWALK_REACH)
            for walk in (walks[i] for i in sorted(near.tolist())):
                links.setdefault(name, []).append(walk)
                links.setdefault(walk, []).append(name)
    return {name: tuple(others) for name, others in links.items()}


def virtual_links(surface: RoadSurface) -> dict[str, dict[str, tuple[str, ...]]]:
    """Returns for each lane those that virtual junctions connect it with, by role.

    ``virtualSuccessor`` are lanes to which traffic may turn somewhere along the lane, and
    ``virtualPredecessor`` those from which it may come; ends of lanes do not meet there.
    """
    links: dict[str, dict[str, tuple[str, ...]]] = {}
    for before, after in (way for junction in surface.junctions for way in junction.ways):
        for lane, role, other in (
            (before, "virtualSuccessor", after),
            (after, "virtualPredecessor", before),
        ):
            roles = links.setdefault(lane, {})
            roles[role] = (*roles.get(role, ()), other)
    return links


def _plans(surface: RoadSurface, kind: str) -> dict[str, shapely.Geometry]:
    """Patches in plan."""
    chosen = {index: patch.id for index, patch in enumerate(surface.patches) if _is(patch, kind)}
    inside = np.flatnonzero(np.isin(surface.triangle_patch, list(chosen)))
    corners = surface.vertices[:, :2][surface.triangles[inside]]
    shapes: dict[str, list[shapely.Geometry]] = {}
    for triangle, index in zip(shapely.polygons(corners), inside, strict=True):
        name = chosen[int(surface.triangle_patch[index])]
        shapes.setdefault(name, []).append(triangle)
    return {name: shapely.MultiPolygon(parts) for name, parts in shapes.items()}


def _is(patch: Patch, kind: str) -> bool:
    if kind == "crosswalk":
        return patch.kind == "crosswalk"
    return patch.kind == "lane" and patch.lane_type in _WALKED


def _regulates(thing: CityObject) -> bool:
    return thing.placement is not None and thing.placement.template in _REGULATES


def _controlled(sign: CityObject, lanes: Sequence[LaneLine], tree: shapely.STRtree) -> list[str]:
    assert sign.placement is not None
    place, heading = sign.placement.position[:2], sign.placement.heading
    wanted = -np.array([np.cos(heading), np.sin(heading)])
    near = tree.query(shapely.Point(place), predicate="dwithin", distance=_SIGN_REACH)
    distances = []
    for lane in (lanes[i] for i in near.tolist()):
        distance, direction = _beside(lane, place)
        if direction @ wanted >= _SAME_WAY:
            distances.append((distance, lane))
    if not distances:
        return []
    _, nearest = min(distances, key=lambda pair: (pair[0], pair[1].id))
    side = nearest.lane > 0
    return [
        lane.id
        for lane in lanes
        if (lane.road, lane.section, lane.lane > 0) == (nearest.road, nearest.section, side)
    ]


def _beside(lane: LaneLine, place: FloatArray) -> tuple[float, FloatArray]:
    """Distance of a place from a lane, and the lane's direction there."""
    points = lane.points[:, :2]
    step = np.diff(points, axis=0)
    length = np.maximum((step**2).sum(axis=1), 1e-12)
    share = np.clip(((place - points[:-1]) * step).sum(axis=1) / length, 0.0, 1.0)
    apart = np.linalg.norm(points[:-1] + share[:, None] * step - place, axis=1)
    best = int(apart.argmin())
    direction: FloatArray = step[best] / np.sqrt(length[best])
    return float(apart[best]), direction
