"""Writes features of the city as CityGML 2.0 text."""

import re
from collections.abc import Iterator, Mapping
from xml.sax.saxutils import quoteattr

from envgen_usd.citygml.appearance import appearance_text
from envgen_usd.citygml.code_spaces import code_space
from envgen_usd.citygml.feature_properties import KINDS, Attr, Type
from envgen_usd.citygml.feature_properties_2 import (
    OLD_KINDS,
    OTHER_KIND,
    PART_PROPERTIES,
    SURFACES,
    OldKind,
)
from envgen_usd.citygml.flat_roads import RoadParts, relation_facts, road_parts
from envgen_usd.citygml.generic_attributes import generic_text
from envgen_usd.citygml.gml_geometry_text import GeometryText
from envgen_usd.citygml.property_values import property_texts, unit_of
from envgen_usd.citygml.shared_text import (
    implicit_text,
    is_name,
    names_text,
    shell_ids,
    start_tag,
)
from envgen_usd.models.attribute_values import Attribute
from envgen_usd.models.city_model import CityObject, ThematicSurface

_YEAR = re.compile(r"\d{4}(-|$)")
_LEAST_LOD = {"WindowSurface": 3, "DoorSurface": 3}
_SHORT = {"WindowSurface": "Window", "DoorSurface": "Door"}


def feature_text_2(feature: CityObject, geometry: GeometryText) -> str:
    """Returns a feature with all its parts as an element of CityGML 2.0.

    Content that 2.0 lacks is written as its nearest class. Lanes and marks become traffic areas of
    their road, with their section, space and relations as generic attributes. Unknown classes
    become ``GenericCityObject``. Codes, booleans and nulls become texts. A property with two
    geometries keeps the first.

    Args:
        feature: A top-level feature.
        geometry: Formats the coordinates as GML 3.1.1, and tracks their bounds.

    Raises:
        EnvgenError: An id is not an NCName.
    """
    return "".join(_object(feature, geometry, appearance_text(feature, old=True)))


def _object(feature: CityObject, geometry: GeometryText, appearance: str = "") -> Iterator[str]:
    kind = OLD_KINDS.get(feature.kind, OTHER_KIND)
    parts = road_parts(feature) if kind.prefix == "tran" else None
    feature = parts.road if parts is not None else feature
    start, end = start_tag(kind.prefix, kind.name, feature.id)
    yield start
    yield names_text(feature.attributes)
    yield from _generics(feature.kind, feature.attributes, kind)
    yield from _relations(feature)
    if feature.placement is not None:
        for axis, extent in zip("xyz", feature.placement.size.tolist(), strict=True):
            yield generic_text(f"placement_size_{axis}", float(extent), old=True)
    yield appearance
    yield from _attributes(feature.kind, kind, feature.attributes)
    if parts is not None:
        yield from _road(parts, geometry)
        for lod in (1, 2, 3):
            if plain := feature.geometry.get(f"lod{lod}MultiSurface"):
                tag = f"tran:lod{lod}MultiSurface"
                yield f"<{tag}>{geometry.multi_surface(plain)}</{tag}>"
    else:
        for name in kind.geometry:
            yield from _property(name, feature, kind, geometry)
    yield end
    if kind is OTHER_KIND:
        # The class cannot hold parts, so they follow it.
        for child in feature.children:
            yield "</cityObjectMember>\n<cityObjectMember>"
            yield from _object(child, geometry)


def _generics(model_kind: str, attributes: Mapping[str, Attribute], kind: OldKind) -> Iterator[str]:
    """Attributes that are no properties of the class, or do not suit their property."""
    tags = dict(kind.attributes)
    for name, value in attributes.items():
        is_property = name in tags and _texts(model_kind, name, tags[name], value)
        if not is_property and not is_name(name, value):
            yield generic_text(name, value, old=True)


def _slot(model_kind: str, name: str) -> Attr:
    types = KINDS[model_kind].attributes() if model_kind in KINDS else {}
    return types.get(name, Attr("", name, Type.CODE))


def _texts(model_kind: str, name: str, tag: str, value: Attribute) -> tuple[str, ...]:
    """Text of each element of a property; none if the value does not suit its type."""
    if tag.startswith("year"):
        return (value[:4],) if isinstance(value, str) and _YEAR.match(value) else ()
    return property_texts(_slot(model_kind, name), value)


def _relations(feature: CityObject) -> Iterator[str]:
    for name, ids in relation_facts(feature.relations).items():
        yield generic_text(name, ids, old=True)


def _attributes(
    model_kind: str, kind: OldKind, attributes: Mapping[str, Attribute]
) -> Iterator[str]:
    for name, tag in kind.attributes:
        if name not in attributes:
            continue
        value, full, label = attributes[name], f"{kind.prefix}:{tag}", ""
        slot = _slot(model_kind, name)
        if slot.type is Type.CODE:
            space = code_space(kind.prefix, model_kind, name)
            label = f' codeSpace="{space}"' if space else ""
        elif slot.type in (Type.LENGTH, Type.LENGTHS, Type.HEIGHT):
            label = f" uom={quoteattr(unit_of(value))}"
        for text in _texts(model_kind, name, tag, value):
            yield f"<{full}{label}>{text}</{full}>"


def _property(
    name: str, feature: CityObject, kind: OldKind, geometry: GeometryText
) -> Iterator[str]:
    tag = f"{kind.prefix}:{name}"
    if name == "boundedBy":
        # 2.0 has no boundary surfaces below LoD2; a solid of that level holds their polygons.
        levels = {int(role[3]) for role in feature.geometry if role.endswith("Solid")}
        for surface in feature.surfaces:
            if surface.lod > 1 or surface.lod not in levels:
                text = _surface(surface, kind.prefix, geometry, feature.solid_lod)
                yield f"<{tag}>{text}</{tag}>"
    elif name in PART_PROPERTIES:
        for child in feature.children:
            if child.kind == name:
                holder = PART_PROPERTIES[name]
                yield f"<{holder}>{''.join(_object(child, geometry))}</{holder}>"
    elif name.endswith("ImplicitRepresentation"):
        if feature.placement is not None:
            yield f"<{tag}>{implicit_text(feature.placement, geometry)}</{tag}>"
    elif text := _geometry(name, feature, kind, geometry):
        yield f"<{tag}>{text}</{tag}>"


def _geometry(name: str, feature: CityObject, kind: OldKind, geometry: GeometryText) -> str:
    """GML of a geometry property; empty without geometry."""
    if name == "tin":
        return geometry.triangulated_surface(feature.geometry["tin"])
    # Interiors have LoD4 in 2.0.
    lod, wants = name[:4].replace("4", "3"), name[4:]
    has_surfaces = "boundedBy" in kind.geometry
    if wants in ("Solid", "Geometry"):
        shell = shell_ids(feature) if lod == f"lod{feature.solid_lod}" and has_surfaces else []
        if shell:
            return geometry.solid_of_references(shell)
        body = feature.geometry.get(f"{lod}Solid")
        if body is not None and len(body):
            return geometry.solid(body)
    surface, curve = f"{lod}MultiSurface", f"{lod}MultiCurve"
    if wants in ("MultiSurface", "Geometry", "FootPrint") and surface in feature.geometry:
        return geometry.multi_surface(feature.geometry[surface])
    if wants in ("MultiCurve", "Geometry") and curve in feature.curves:
        return geometry.multi_curve(feature.curves[curve])
    plain = wants in ("MultiSurface", "Geometry") and not has_surfaces
    return _plain_surfaces(feature, int(lod[3]), geometry) if plain else ""


def _plain_surfaces(feature: CityObject, lod: int, geometry: GeometryText) -> str:
    """Surfaces of a class that has no boundary surfaces in 2.0, as plain geometry."""
    surfaces = [s for wall in feature.surfaces for s in (wall, *wall.openings) if s.lod == lod]
    members = "".join(
        f"<gml:surfaceMember>{polygon}</gml:surfaceMember>"
        for surface in surfaces
        for polygon in geometry.polygons(surface.polygons)
    )
    return f"<gml:MultiSurface>{members}</gml:MultiSurface>" if members else ""


def _surface(surface: ThematicSurface, prefix: str, geometry: GeometryText, solid_lod: int) -> str:
    known = surface.kind in SURFACES or surface.kind in _SHORT
    name = _SHORT.get(surface.kind, surface.kind if known else "WallSurface")
    start, end = start_tag(prefix, name, surface.id)
    lod = max(surface.lod, _LEAST_LOD.get(surface.kind, 2))
    polygon_name = surface.id if surface.lod == solid_lod else ""
    multi_id = f"{surface.id}.ms" if surface.material else ""
    shape = geometry.multi_surface(surface.polygons, polygon_name, multi_id)
    tag = f"{prefix}:lod{lod}MultiSurface"
    openings = "".join(
        f"<{prefix}:opening>{_surface(opening, prefix, geometry, solid_lod)}</{prefix}:opening>"
        for opening in surface.openings
    )
    old_kind = OldKind(prefix, name, (), ())
    generics = "".join(_generics(surface.kind, surface.attributes, old_kind))
    return f"{start}{names_text(surface.attributes)}{generics}<{tag}>{shape}</{tag}>{openings}{end}"


def _road(parts: RoadParts, geometry: GeometryText) -> Iterator[str]:
    """Traffic areas, auxiliary traffic areas, and the network of centre lines."""
    for tag, kind, surfaces in (
        ("tran:trafficArea", "TrafficArea", parts.areas),
        ("tran:auxiliaryTrafficArea", "AuxiliaryTrafficArea", parts.auxiliary),
    ):
        for surface in surfaces:
            yield f"<{tag}>{_traffic_area(kind, surface, geometry)}</{tag}>"
    if parts.lines:
        elements = "".join(
            f"<gml:element>{geometry.line(line)}</gml:element>" for line in parts.lines
        )
        yield (
            "<tran:lod0Network><gml:GeometricComplex>"
            f"{elements}</gml:GeometricComplex></tran:lod0Network>"
        )


def _traffic_area(kind: str, surface: ThematicSurface, geometry: GeometryText) -> str:
    start, end = start_tag("tran", kind, surface.id)
    names = ("class", "function", "usage", "surfaceMaterial")
    old_kind = OldKind("tran", kind, tuple((name, name) for name in names), ())
    return (
        f"{start}{names_text(surface.attributes)}"
        f"{''.join(_generics(kind, surface.attributes, old_kind))}"
        f"{''.join(_attributes(kind, old_kind, surface.attributes))}"
        f"{_traffic_shape(surface, geometry)}{end}"
    )


def _traffic_shape(surface: ThematicSurface, geometry: GeometryText) -> str:
    if not len(surface.polygons):
        return ""
    multi_id = f"{surface.id}.ms" if surface.material else ""
    lod = f"tran:lod{max(surface.lod, 2)}MultiSurface"
    return f"<{lod}>{geometry.multi_surface(surface.polygons, '', multi_id)}</{lod}>"
