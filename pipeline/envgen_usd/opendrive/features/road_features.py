"""Places the objects and signals of all roads (chapters 13 and 14).

The road surface contains flat objects (crosswalks, parking bays, stop lines, arrows, islands),
bridges and tunnels; this module skips them.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from envgen_usd.chunks import snap
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.road import Road, RoadNetwork
from envgen_usd.models.road_feature import Pose, RoadFeature, SignalFeature
from envgen_usd.models.road_objects import Origin, RoadObject
from envgen_usd.opendrive.features.barriers import barrier, barrier_element, pieces
from envgen_usd.opendrive.features.building_objects import building, swept_building
from envgen_usd.opendrive.features.object_instances import Instance, instances
from envgen_usd.opendrive.features.object_kinds import FLAT, UNKNOWN, Kind, kind_of
from envgen_usd.opendrive.features.object_outlines import (
    bounding_bodies,
    outline_bodies,
    skeleton_bodies,
)
from envgen_usd.opendrive.features.signal_facing import Facing, facing_of
from envgen_usd.opendrive.features.signal_features import signal_feature
from envgen_usd.opendrive.features.signal_relations import signal_origin, signal_relations
from envgen_usd.opendrive.features.signal_stacks import stack
from envgen_usd.opendrive.features.swept_solids import polygons
from envgen_usd.opendrive.surface_ids import origin_id

SAME_POST = 0.6
"""Metres between a pole and a sign; a nearer pole is left out, for each sign includes a post."""
_PLANTS = {"tree", "bush"}


def road_features(network: RoadNetwork) -> tuple[RoadFeature, ...]:
    """Returns the features for the objects and signals of a network.

    A feature with a template in the asset library has a pose. Buildings have walls, roof and
    ground; barriers, gantries and other bodies have faces. An object of unknown kind has its
    outline's body, or else its bounding body, or else only a pose. Signals have the relations of
    `signal_relations`.

    Args:
        network: The road network.
    """
    features: list[RoadFeature] = []
    facing = facing_of(network.roads.values())
    relations = signal_relations(network.roads)
    for road in network.roads.values():
        if road.signals or road.objects:
            signs = stack(list(_signs(road, network.roads, facing)))
            features += [replace(each, relations=relations[each.id]) for each in signs]
            features += _objects(road, _feet(signs))
    return tuple(features)


def _signs(road: Road, roads: Mapping[str, Road], facing: Facing) -> Iterator[SignalFeature]:
    for number, signal in enumerate(road.signals):
        origin = signal_origin(road, number)
        feature = signal_feature(origin_id(origin), road, signal, roads, facing)
        if feature is not None:
            yield replace(feature, origin=origin)


def _feet(signs: list[SignalFeature]) -> FloatArray:
    return np.array([each.pose.position[:2] for each in signs]).reshape(-1, 2)


def _objects(road: Road, signs: FloatArray) -> Iterator[RoadFeature]:
    for number, road_object in enumerate(road.objects):
        kind = kind_of(road_object)
        if kind.template != FLAT and not road_object.reference:
            origin = Origin(road.id, "object", number, road_object.id)
            for feature in _of_object(origin_id(origin), road, road_object, signs):
                yield replace(feature, origin=origin)


def _of_object(
    name: str, road: Road, road_object: RoadObject, signs: FloatArray
) -> Iterator[RoadFeature]:
    kind = kind_of(road_object)
    for place, group in enumerate(pieces(road_object)):
        bodies = [body for piece in group for body in barrier(road, road_object, piece, kind)]
        if kind.template == "building":
            for part, body in enumerate(bodies):
                yield swept_building(f"{name}_part_{place}_{part}", road, road_object, kind, body)
        elif bodies:
            yield _body(f"{name}_part_{place}", road, road_object, kind, bodies)
    for place, instance in enumerate(instances(road, road_object)):
        if kind.template == "pole" and _near(instance.pose.position, signs):
            continue
        feature = _feature(f"{name}_{place}", road, instance, kind)
        if feature is not None:
            yield feature


def _near(position: FloatArray, feet: FloatArray) -> bool:
    return bool((np.hypot(*(feet - position[:2]).T) < SAME_POST).any())


def _feature(id_: str, road: Road, instance: Instance, kind: Kind) -> RoadFeature | None:
    road_object = instance.road_object
    if kind.template == "building":
        return building(id_, road, instance, kind)
    bodies = [] if kind.template in _PLANTS else skeleton_bodies(road, instance)
    if not bodies and kind.template not in {"tree", "pole"}:
        bodies = outline_bodies(road, instance, kind.height if kind.section else 0.0)
    if not bodies and kind.section:
        bodies = barrier_element(instance, kind)
    if not bodies and kind.template == UNKNOWN:
        bodies = bounding_bodies(instance)
    if bodies:
        return _body(id_, road, road_object, kind, bodies)
    return _standing(id_, road, instance, kind)


def _standing(id_: str, road: Road, instance: Instance, kind: Kind) -> RoadFeature:
    """Returns a feature that an asset shows."""
    road_object, pose = instance.road_object, instance.pose
    across = 2 * road_object.radius
    return RoadFeature(
        id=id_,
        road=road.id,
        source=road_object,
        kind=kind.name or kind.template,
        template=kind.template,
        pose=Pose(
            snap(pose.position),
            round(float(np.arctan2(np.sin(pose.heading), np.cos(pose.heading))), 6),
            round(pose.pitch, 6),
            round(pose.roll, 6),
        ),
        size=(
            road_object.length or across,
            road_object.width or across,
            road_object.height or kind.height,
        ),
    )


def _body(
    id_: str, road: Road, road_object: RoadObject, kind: Kind, bodies: list[FloatArray]
) -> RoadFeature:
    """Returns a feature with an explicit geometry instead of a template."""
    return RoadFeature(
        id=id_,
        road=road.id,
        source=road_object,
        kind=kind.name or kind.template,
        template=kind.section if kind.template == "barrier" else kind.template,
        pose=None,
        parts={"body": polygons(bodies)},
    )
