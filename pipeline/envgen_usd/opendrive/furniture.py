"""Objects and signals of all roads as features of the city (chapters 13 and 14).

What lies flat on the road (crosswalks, parking bays, stop lines, arrows, islands) and what the
road itself is part of (bridges, tunnels) belongs to the road surface and not to this.
"""

import re
from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from envgen_usd.chunks import snap
from envgen_usd.models.arrays import FloatArray
from envgen_usd.models.city import Attribute, CityObject, Placement
from envgen_usd.models.road import Road, RoadNetwork
from envgen_usd.models.road_objects import RoadObject
from envgen_usd.opendrive.features.barriers import MATERIALS, barrier, pieces
from envgen_usd.opendrive.features.buildings import building
from envgen_usd.opendrive.features.facing import Facing, facing_of
from envgen_usd.opendrive.features.instances import Instance, instances
from envgen_usd.opendrive.features.kinds import FLAT, UNKNOWN, Kind, kind_of
from envgen_usd.opendrive.features.outlines import outline_bodies, skeleton_bodies
from envgen_usd.opendrive.features.signal_relations import signal_feature_id, signal_relations
from envgen_usd.opendrive.features.signs import sign
from envgen_usd.opendrive.features.solids import polygons
from envgen_usd.opendrive.features.stacks import stack

SAME_POST = 0.6
"""Metres within which a post and a sign, which has a post of its own, are one thing."""
_PLANTS = {"tree", "bush"}


def place_furniture(network: RoadNetwork) -> tuple[CityObject, ...]:
    """Returns the features that the objects and signals of a network stand for.

    Trees and bushes are ``SolitaryVegetationObject``, buildings ``Building`` with walls, roof and
    ground, hedges ``PlantCover``, everything else ``CityFurniture``. What the library has a
    template for gets a placement; barriers, gantries and other bodies get their geometry. Signals
    have the relations of `signal_relations`.

    Args:
        network: The road network.
    """
    found: list[CityObject] = []
    facing = facing_of(network.roads.values())
    names = _names(network)
    relations = signal_relations(network.roads, names)
    for id_, name in names.items():
        road = network.roads[id_]
        if road.signals or road.objects:
            signs = stack(list(_signs(name, road, network.roads, facing)))
            found += [replace(each, relations=relations[each.id]) for each in signs]
            found += _objects(name, road, _feet(signs))
    return tuple(found)


def _signs(
    name: str, road: Road, roads: Mapping[str, Road], facing: Facing
) -> Iterator[CityObject]:
    for number, signal in enumerate(road.signals):
        feature = sign(signal_feature_id(name, number), road, signal, roads, facing)
        if feature is not None:
            yield feature


def _feet(signs: list[CityObject]) -> FloatArray:
    feet = [each.placement.position[:2] for each in signs if each.placement is not None]
    return np.array(feet).reshape(-1, 2)


def _objects(road_name: str, road: Road, signs: FloatArray) -> Iterator[CityObject]:
    for number, thing in enumerate(road.objects):
        kind = kind_of(thing)
        if kind.template == FLAT or thing.reference:
            continue
        name = f"object_{road_name}_{number}"
        for place, group in enumerate(pieces(thing)):
            bodies = [body for piece in group for body in barrier(road, thing, piece, kind)]
            if bodies:
                yield _body(f"{name}_part_{place}", thing, kind, bodies)
        for place, instance in enumerate(instances(road, thing)):
            if kind.template == "pole" and _near(instance.stand.position, signs):
                continue
            feature = _feature(f"{name}_{place}", road, instance, kind)
            if feature is not None:
                yield feature


def _near(position: FloatArray, feet: FloatArray) -> bool:
    return bool((np.hypot(*(feet - position[:2]).T) < SAME_POST).any())


def _feature(name: str, road: Road, instance: Instance, kind: Kind) -> CityObject | None:
    thing = instance.thing
    if kind.template == "building":
        return building(name, road, instance, kind.height)
    bodies = [] if kind.template in _PLANTS else skeleton_bodies(road, instance)
    if not bodies and kind.template not in {"tree", "pole"}:
        bodies = outline_bodies(road, instance)
    if bodies:
        return _body(name, thing, kind, bodies)
    if kind.template in {UNKNOWN, "barrier"}:
        return None
    return _standing(name, instance, kind)


def _standing(name: str, instance: Instance, kind: Kind) -> CityObject:
    thing, stand = instance.thing, instance.stand
    height = thing.height or kind.height
    across = 2 * thing.radius
    size = np.array([thing.length or across, thing.width or across, height])
    placement = Placement(
        snap(stand.position),
        round(float(np.arctan2(np.sin(stand.heading), np.cos(stand.heading))), 6),
        np.round(size, 3),
        kind.template,
        round(-stand.pitch, 6),
        round(stand.roll, 6),
    )
    plant = kind.template in _PLANTS
    own: dict[str, Attribute] = {"height": round(height, 3)}
    if plant and max(size[:2]) > 0:
        own["crownDiameter"] = round(float(max(size[:2])), 3)
    return CityObject(
        name,
        "SolitaryVegetationObject" if plant else "CityFurniture",
        {**_codes(kind, plant), **own, **_attributes(thing)},
        placement=placement,
    )


def _body(name: str, thing: RoadObject, kind: Kind, bodies: list[FloatArray]) -> CityObject:
    """A feature with its own geometry."""
    plant = kind.template in {"hedge", *_PLANTS}
    other = "GenericOccupiedSpace" if kind.template == UNKNOWN else "CityFurniture"
    material = "grass" if plant else MATERIALS.get(kind.section, "concrete")
    attributes: dict[str, Attribute] = {
        **_codes(kind, plant),
        "template": kind.section if kind.template == "barrier" else kind.template,
        "material": material,
        **_attributes(thing),
    }
    return CityObject(
        name,
        "PlantCover" if plant else other,
        attributes,
        geometry={"lod2MultiSurface": polygons(bodies)},
    )


def _codes(kind: Kind, plant: bool) -> dict[str, Attribute]:
    if plant or not kind.function:
        return {}
    return {"class": "1000", "function": kind.function}


def _attributes(thing: RoadObject) -> dict[str, Attribute]:
    texts = {
        "opendrive_id": thing.id,
        "opendrive_name": thing.name,
        "opendrive_type": thing.type,
        "opendrive_subtype": thing.subtype,
    }
    return {key: text for key, text in texts.items() if text}


def _names(network: RoadNetwork) -> dict[str, str]:
    """Part of the features' ids for each road: an NCName, and unique."""
    names: dict[str, str] = {}
    taken: set[str] = set()
    for road in network.roads:
        name = plain = re.sub(r"[^A-Za-z0-9_.-]", "_", road)
        number = 2
        while name in taken:
            name, number = f"{plain}_{number}", number + 1
        taken.add(name)
        names[road] = name
    return names
