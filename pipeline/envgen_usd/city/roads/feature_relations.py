"""Relations between road features, from the file or from their positions."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace

import numpy as np
import shapely

from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.city_model import CityObject, Placement
from envgen_usd.models.lanes import DRIVEN, WALKED
from envgen_usd.models.road_surface import LaneLine, Patch, RoadSurface

_REGULATES = frozenset(("traffic_sign", "traffic_light"))
_WALKED = WALKED | {"shared"}
SIGN_REACH = 15.0
"""Metres from a sign to the nearest lane that it can hold for."""
_CROSSWALK_REACH = 1.0
"""Largest distance of a crosswalk from its sidewalk, metres; a larger value links more crosswalks.

"""
_SAME_WAY = np.cos(np.radians(60.0))


def with_controls(
    features: Sequence[CityObject],
    near: Iterable[LaneLine],
    abreast: Callable[[LaneLine], Sequence[LaneLine]],
    refer: Callable[[str], str],
) -> tuple[CityObject, ...]:
    """Returns signs and traffic lights with their lanes as ``controls``.

    Lanes from the file take precedence. Otherwise a sign controls the oncoming lanes: the nearest
    lane, and the lanes beside it in the same section. Relations to missing features are dropped.

    Args:
        features: Of the road file; others are returned as they are.
        near: All lanes within `SIGN_REACH` of the features; there may be more.
        abreast: Returns the lanes for vehicles on the same side of a lane's section.
        refer: What a lane, a patch or a feature is referred to by; empty where it is not there.
    """
    known = [_settled(feature, refer) for feature in features]
    facing = {
        index: feature.placement
        for index, feature in enumerate(features)
        if feature.placement is not None and feature.placement.template in _REGULATES
        if "controls" not in feature.relations
    }
    lanes = [lane for lane in near if facing and lane.lane_type in DRIVEN]
    tree = shapely.STRtree([shapely.LineString(lane.points[:, :2]) for lane in lanes])
    for index, placement in facing.items():
        nearest = _faced(placement, lanes, tree)
        ids = [lane.id for lane in abreast(nearest)] if nearest is not None else []
        controls = tuple(filter(None, map(refer, ids)))
        if controls:
            relations = {**known[index].relations, "controls": controls}
            known[index] = replace(known[index], relations=relations)
    return tuple(known)


def _settled(feature: CityObject, refer: Callable[[str], str]) -> CityObject:
    """A feature with relations to existing features only."""
    if not feature.relations:
        return feature
    relations = {
        role: tuple(filter(None, map(refer, ids))) for role, ids in feature.relations.items()
    }
    return replace(feature, relations={role: ids for role, ids in relations.items() if ids})


def crosswalk_links(surface: RoadSurface) -> dict[str, tuple[str, ...]]:
    """Returns the sidewalks of each crosswalk, and the crosswalks of each of these sidewalks.

    Keys and values are patch ids. Without these links, pedestrian routing could not cross roads.
    """
    crosswalks = _plans(surface, "crosswalk")
    plans = _plans(surface, "walk") if crosswalks else {}
    tree, walks = shapely.STRtree(list(plans.values())), list(plans)
    links: dict[str, list[str]] = {}
    for name, shape in crosswalks.items():
        near = tree.query(shape, predicate="dwithin", distance=_CROSSWALK_REACH)
        for walk in (walks[i] for i in sorted(near.tolist())):
            links.setdefault(name, []).append(walk)
            links.setdefault(walk, []).append(name)
    return {name: tuple(others) for name, others in links.items()}


def virtual_links(surface: RoadSurface) -> dict[str, dict[str, tuple[str, ...]]]:
    """Returns the lanes that virtual junctions connect with each lane, by role.

    Traffic may turn into a ``virtualSuccessor`` somewhere along the lane, and may come from a
    ``virtualPredecessor``; ends of lanes do not meet there.
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


def _faced(sign: Placement, lanes: Sequence[LaneLine], tree: shapely.STRtree) -> LaneLine | None:
    """Returns the nearest lane whose traffic sees the face of a sign."""
    place, heading = sign.position[:2], sign.heading
    wanted = -np.array([np.cos(heading), np.sin(heading)])
    near = tree.query(shapely.Point(place), predicate="dwithin", distance=SIGN_REACH)
    distances = []
    for lane in (lanes[i] for i in near.tolist()):
        distance, direction = _beside(lane, place)
        if direction @ wanted >= _SAME_WAY:
            distances.append((distance, lane))
    return min(distances, key=lambda pair: (pair[0], pair[1].id))[1] if distances else None


def _beside(lane: LaneLine, place: FloatArray) -> tuple[float, FloatArray]:
    """Distance of a point from a lane, and the lane's direction there."""
    points = lane.points[:, :2]
    step = np.diff(points, axis=0)
    length = np.maximum((step**2).sum(axis=1), 1e-12)
    share = np.clip(((place - points[:-1]) * step).sum(axis=1) / length, 0.0, 1.0)
    apart = np.linalg.norm(points[:-1] + share[:, None] * step - place, axis=1)
    best = int(apart.argmin())
    direction: FloatArray = step[best] / np.sqrt(length[best])
    return float(apart[best]), direction
