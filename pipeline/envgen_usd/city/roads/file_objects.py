"""Converts the features of the road file to CityGML features."""

import math

import numpy as np

from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.attribute_values import Attribute
from envgen_usd.models.city_model import CityObject, Placement, ThematicSurface
from envgen_usd.models.polygon_arrays import Polygons
from envgen_usd.models.road_feature import Pose, RoadFeature, SignalFeature
from envgen_usd.models.road_objects import RoadObject
from envgen_usd.models.signals import Signal

STOREY = 3.0
"""Height of a storey, metres; a larger value gives fewer storeys."""
_TRAFFIC, _HABITATION = "1000", "1000"
_FLAT_ROOF = "1000"
_FUNCTIONS = {
    "barrel": "1320",
    "barrier": "1440",
    "beam": "1440",
    "bin": "1200",
    "bollard": "1320",
    "bus_stop": "1110",
    "control_box": "1060",
    "delineator": "1320",
    "emergency_call_box": "1030",
    "fence": "1440",
    "gantry": "1270",
    "guard_rail": "1440",
    "hydrant": "1330",
    "jersey_barrier": "1440",
    "pole": "1270",
    "railing": "1440",
    "sign_post": "1070",
    "street_light": "1150",
    "traffic_cone": "1320",
    "traffic_light": "1080",
    "traffic_light_pole": "1080",
    "traffic_sign": "1070",
}
"""Function of each kind of feature, from the SIG3D code list of ``CityFurniture``."""
_CROWNED = {"tree", "bush"}
_PLANTS = {"hedge", *_CROWNED}
_HEDGE = "hedge_privet"
"""Material of plants with explicit geometry."""
_METAL = {"guard_rail", "railing", "fence", "beam"}
_PARTS = {
    "wall": ("WallSurface", "plaster"),
    "roof": ("RoofSurface", "bitumen"),
    "ground": ("GroundSurface", "concrete"),
}
"""Class and material of a building's parts."""
_VARIANTS = {
    "inverted_triangle": "triangle",
    "diamond": "square",
    "rectangle": "square",
    "cross": "square",
}
"""Nearest of the four shapes of the sign assets, for shapes without an asset."""


def file_object(feature: RoadFeature) -> CityObject:
    """Returns the CityGML feature of an object or a signal.

    Buildings become ``Building`` with walls, roof and ground; trees and bushes become
    ``SolitaryVegetationObject``. Hedges and other plants with explicit geometry become
    ``PlantCover``. Objects of an unknown kind become ``GenericOccupiedSpace``, and all others
    ``CityFurniture``.
    """
    if isinstance(feature, SignalFeature):
        return _signal(feature)
    if feature.template == "building":
        return _building(feature)
    if feature.pose is not None:
        return _standing(feature, feature.pose)
    return _body(feature)


def _signal(feature: SignalFeature) -> CityObject:
    relations = {"controls": feature.relations.lanes}
    if feature.relations.depends_on:
        relations["dependsOn"] = feature.relations.depends_on
    return CityObject(
        feature.id,
        "CityFurniture",
        _signal_attributes(feature),
        placement=_placement(feature, feature.pose, np.array(feature.size)),
        relations=relations,
    )


def _signal_attributes(feature: SignalFeature) -> dict[str, Attribute]:
    signal, face = feature.source, feature.face
    attributes: dict[str, Attribute] = {
        **_codes(feature),
        "face_width": face.width,
        "face_height": face.height,
        "face_lower_edge": face.lower_edge,
        "opendrive_id": signal.id,
        "opendrive_road": feature.road,
        "opendrive_orientation": signal.orientation,
        "opendrive_dynamic": "yes" if signal.dynamic else "no",
    }
    if face.shape:
        attributes["shape"] = _VARIANTS.get(face.shape, face.shape)
        attributes["sign_shape"] = face.shape
    attributes.update(_facts(signal, "name", "type", "subtype", "country", "text", "unit"))
    if math.isfinite(signal.value):
        attributes["opendrive_value"] = signal.value
    return attributes


def _building(feature: RoadFeature) -> CityObject:
    height = feature.size[2]
    surfaces = []
    for part, polygons in feature.parts.items():
        class_, material = _PARTS[part]
        for number in range(len(polygons)):
            numbered = part == "wall" or len(polygons) > 1
            name = f"{feature.id}_{part}_{number}" if numbered else f"{feature.id}_{part}"
            ring = Polygons.of_rings(polygons.rings(number))
            surfaces.append(ThematicSurface(name, class_, ring, 2, material))
    return CityObject(
        feature.id,
        "Building",
        {
            "class": _HABITATION,
            "roofType": _FLAT_ROOF,
            "storeysAboveGround": max(round(height / STOREY), 1),
            "height": height,
            **_object_facts(feature),
        },
        tuple(surfaces),
        solid_lod=2,
    )


def _standing(feature: RoadFeature, pose: Pose) -> CityObject:
    attributes: dict[str, Attribute] = _codes(feature)
    if feature.size[2] > 0:
        attributes["height"] = round(feature.size[2], 3)
    crown = max(feature.size[:2])
    plant = feature.template in _CROWNED
    if plant and crown > 0:
        attributes["crownDiameter"] = round(crown, 3)
    return CityObject(
        feature.id,
        "SolitaryVegetationObject" if plant else _class(feature),
        {**attributes, **_object_facts(feature)},
        placement=_placement(feature, pose, np.round(feature.size, 3)),
    )


def _body(feature: RoadFeature) -> CityObject:
    """Returns a feature with explicit geometry instead of a template."""
    plant = feature.template in _PLANTS
    metal = "metal_galvanised" if feature.template in _METAL else "concrete"
    return CityObject(
        feature.id,
        "PlantCover" if plant else _class(feature),
        {
            **_codes(feature),
            "template": feature.template,
            "material": _HEDGE if plant else metal,
            **_object_facts(feature),
        },
        geometry={"lod2MultiSurface": feature.parts["body"]},
    )


def _class(feature: RoadFeature) -> str:
    """Returns the CityGML class of an object that is no plant and no building."""
    return "GenericOccupiedSpace" if feature.template == "unknown" else "CityFurniture"


def _placement(feature: RoadFeature, pose: Pose, size: FloatArray) -> Placement:
    # CityGML lifts +x where OpenDRIVE lowers it.
    return Placement(pose.position, pose.heading, size, feature.template, -pose.pitch, pose.roll)


def _codes(feature: RoadFeature) -> dict[str, Attribute]:
    function = _FUNCTIONS.get(feature.kind)
    return {"class": _TRAFFIC, "function": function} if function else {}


def _object_facts(feature: RoadFeature) -> dict[str, Attribute]:
    facts = _facts(feature.source, "id", "name", "type", "subtype")
    return {**facts, "opendrive_road": feature.road}


def _facts(source: RoadObject | Signal, *names: str) -> dict[str, Attribute]:
    """Returns attributes of the OpenDRIVE element as generic attributes, without empty strings."""
    texts = {f"opendrive_{name}": getattr(source, name) for name in names}
    return {key: text for key, text in texts.items() if text}
