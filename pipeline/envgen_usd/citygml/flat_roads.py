"""Roads of CityGML 3.0 in the flat form of 2.0: areas of a road, and a network of lines."""

from dataclasses import dataclass, replace

from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.attribute_values import Attribute
from envgen_usd.models.city_model import CityObject, ThematicSurface

_ROAD_MARKING = "11"
"""SIG3D code list TrafficArea_function: road marking."""
_OWN = frozenset(("class", "function", "usage", "granularity", "trafficDirection", "spaceType"))


@dataclass(frozen=True)
class RoadParts:
    """Content of a road in CityGML 2.0.

    Attributes:
        areas: Traffic areas and markings, with the attributes of their spaces.
        auxiliary: Auxiliary traffic areas.
        lines: Centre lines, each N_i x 3.
    """

    areas: tuple[ThematicSurface, ...]
    auxiliary: tuple[ThematicSurface, ...]
    lines: tuple[FloatArray, ...]


def road_parts(road: CityObject) -> RoadParts:
    """Collects the surfaces and centre lines of a road, of its sections and of their spaces."""
    areas: list[ThematicSurface] = []
    auxiliary: list[ThematicSurface] = []
    lines: list[FloatArray] = []
    for part in road.walk():
        facts: dict[str, Attribute] = {
            name: value for name, value in part.attributes.items() if name not in _OWN
        }
        for surface in part.surfaces:
            attributes = {**facts, **surface.attributes}
            if surface.kind == "Marking":
                attributes["function"] = _ROAD_MARKING
            known = replace(surface, attributes=attributes)
            (auxiliary if surface.kind == "AuxiliaryTrafficArea" else areas).append(known)
        for curves in part.curves.values():
            lines += curves
    return RoadParts(tuple(areas), tuple(auxiliary), tuple(lines))
