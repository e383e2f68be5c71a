"""Roads of CityGML 3.0 in the flat form of 2.0: areas of a road, and a network of lines.

Sections, intersections and traffic spaces have no element in 2.0. Each area names its section and
its space in generic attributes, with the attributes and relations of its space.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.attribute_values import Attribute
from envgen_usd.models.city_model import CityObject, ThematicSurface
from envgen_usd.models.polygon_arrays import Polygons

ROAD_MARKING = "11"
"""SIG3D code list TrafficArea_function: road marking."""
_CODES = frozenset(("class", "function", "usage"))
_SECTIONS = frozenset(("Section", "Intersection"))
_SPACES = frozenset(("TrafficSpace", "AuxiliaryTrafficSpace"))


@dataclass(frozen=True)
class RoadParts:
    """Content of a road in CityGML 2.0.

    Attributes:
        road: The road, with the attributes and relations of its only section or intersection.
        areas: Traffic areas and markings.
        auxiliary: Auxiliary traffic areas.
        lines: Centre lines, each N_i x 3.
    """

    road: CityObject
    areas: tuple[ThematicSurface, ...]
    auxiliary: tuple[ThematicSurface, ...]
    lines: tuple[FloatArray, ...]


def road_parts(road: CityObject) -> RoadParts:
    """Flattens a road. A space without a surface becomes an area without geometry."""
    surfaces = list(_surfaces(road, {}))
    auxiliary = tuple(each for each in surfaces if each.kind.startswith("Auxiliary"))
    areas = tuple(each for each in surfaces if not each.kind.startswith("Auxiliary"))
    lines = [line for part in road.walk() for curves in part.curves.values() for line in curves]
    return RoadParts(_with_section(road), areas, auxiliary, tuple(lines))


def relation_facts(relations: Mapping[str, tuple[str, ...]]) -> dict[str, Attribute]:
    """Returns relations as generic attributes: ids by role, separated by spaces."""
    return {f"relation_{role}": " ".join(ids) for role, ids in relations.items()}


def _with_section(road: CityObject) -> CityObject:
    sections = [child for child in road.children if child.kind in _SECTIONS]
    if len(sections) != 1:
        return road
    (section,) = sections
    return replace(
        road,
        attributes={**section.attributes, **road.attributes},
        relations={**section.relations, **road.relations},
    )


def _surfaces(part: CityObject, around: Mapping[str, Attribute]) -> Iterator[ThematicSurface]:
    """Yields the surfaces of a part and of the parts in it, with what is known of these."""
    facts = dict(around)
    if part.kind in _SECTIONS:
        facts |= {"section": part.id, "section_class": part.kind}
    if part.kind in _SPACES:
        facts |= {"space": part.id, "space_class": part.kind}
        attributes = {name: value for name, value in part.attributes.items() if name not in _CODES}
        facts |= attributes | relation_facts(part.relations)
    for surface in part.surfaces:
        yield _area(surface, facts)
    if part.kind in _SPACES and not part.surfaces:
        codes = {name: part.attributes[name] for name in _CODES & part.attributes.keys()}
        kind = part.kind.replace("Space", "Area")
        yield ThematicSurface(part.id, kind, _NO_POLYGONS, 2, attributes={**facts, **codes})
    for child in part.children:
        yield from _surfaces(child, facts)


def _area(surface: ThematicSurface, facts: Mapping[str, Attribute]) -> ThematicSurface:
    attributes = {**facts, **surface.attributes}
    if surface.kind == "Marking":
        # The class of a marking has no place among the codes of traffic areas.
        kind = attributes.pop("class", None)
        attributes |= {"citygml_class": "Marking", "function": ROAD_MARKING}
        attributes |= {} if kind is None else {"marking_class": kind}
    return replace(surface, attributes=attributes)


_NO_POLYGONS = Polygons(np.empty((0, 3)), np.zeros(1, np.int64), np.zeros(1, np.int64))
