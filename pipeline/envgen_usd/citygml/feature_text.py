"""Writes features of the city as CityGML 3.0 text."""

from collections.abc import Iterator, Mapping
from xml.sax.saxutils import escape, quoteattr

from envgen_usd.citygml.appearance import appearance_text
from envgen_usd.citygml.code_spaces import code_space
from envgen_usd.citygml.feature_properties import (
    KINDS,
    SPACE_GEOMETRY,
    SURFACE_GEOMETRY,
    Attr,
    Child,
    Kind,
    Ref,
    Shape,
    Type,
)
from envgen_usd.citygml.generic_attributes import generic_text
from envgen_usd.citygml.gml_geometry_text import GeometryText
from envgen_usd.citygml.property_values import property_texts, unit_of
from envgen_usd.citygml.shared_text import (
    href,
    implicit_text,
    is_name,
    names_text,
    shell_ids,
    start_tag,
)
from envgen_usd.errors import EnvgenError
from envgen_usd.models.attribute_values import Attribute
from envgen_usd.models.city_model import CityObject, Placement, ThematicSurface

_PLACEMENT_SIZE = "placement_size_"
_SPACE_TYPE = Attr("core", "spaceType", Type.ENUMERATION)


def feature_text(feature: CityObject, geometry: GeometryText) -> str:
    """Returns a feature with all its parts as an element of CityGML 3.0.

    Args:
        feature: A top-level feature.
        geometry: Formats the coordinates, and tracks their bounds.

    Raises:
        EnvgenError: CityGML lacks the class, or an id is not an NCName.
    """
    return "".join(_object(feature, geometry, appearance_text(feature)))


def _kind(name: str) -> Kind:
    if name not in KINDS:
        raise EnvgenError(f"CityGML 3.0 has no writable class '{name}'")
    return KINDS[name]


def _object(feature: CityObject, geometry: GeometryText, appearance: str = "") -> Iterator[str]:
    kind = _kind(feature.kind)
    start, end = start_tag(kind.prefix, feature.kind, feature.id)
    specific = kind.attributes()
    yield start
    yield names_text(feature.attributes)
    for role, ids in feature.relations.items():
        if not any(isinstance(slot, Ref) and slot.name == role for slot in kind.slots):
            yield from (_relation(role, target) for target in ids)
    yield appearance
    yield _generics(feature.attributes, specific, kind.shape)
    if feature.placement is not None:
        yield _size(feature.placement)
    if kind.shape is Shape.SPACE:
        for text in property_texts(_SPACE_TYPE, feature.attributes.get("spaceType")):
            yield f"<spaceType>{text}</spaceType>"
    for surface in feature.surfaces:
        if surface.kind != "Marking" or not _has_markings(kind):
            yield f"<boundary>{_surface(surface, geometry, feature.solid_lod)}</boundary>"
    block = feature.geometry.get("lod1MultiSurface")
    if kind.shape is Shape.SPACE and block is not None:
        # Spaces of 3.0 have no property for surfaces of LoD1.
        whole = ThematicSurface(f"{feature.id}_lod1", "GenericThematicSurface", block, 1)
        yield f"<boundary>{_surface(whole, geometry, feature.solid_lod)}</boundary>"
    yield from _geometry(feature, kind, geometry)
    yield from _slots(feature, kind, geometry)
    yield end


def _has_markings(kind: Kind) -> bool:
    return any(isinstance(slot, Child) and slot.name == "marking" for slot in kind.slots)


def _relation(role: str, target: str) -> str:
    return (
        f"<relatedTo><CityObjectRelation><relationType>{escape(role)}</relationType>"
        f"<relatedTo {href(target)}/></CityObjectRelation></relatedTo>"
    )


def _generics(
    attributes: Mapping[str, Attribute], specific: Mapping[str, Attr], shape: Shape
) -> str:
    """Attributes that are no properties of the class, or do not suit their property."""
    known = {**specific, "spaceType": _SPACE_TYPE} if shape is Shape.SPACE else specific
    return "".join(
        generic_text(name, value)
        for name, value in attributes.items()
        if not is_name(name, value) and not (name in known and property_texts(known[name], value))
    )


def _size(placement: Placement) -> str:
    axes = zip("xyz", placement.size.tolist(), strict=True)
    return "".join(generic_text(_PLACEMENT_SIZE + axis, float(extent)) for axis, extent in axes)


def _surface(surface: ThematicSurface, geometry: GeometryText, solid_lod: int) -> str:
    kind = _kind(surface.kind)
    start, end = start_tag(kind.prefix, surface.kind, surface.id)
    name = surface.id if surface.lod == solid_lod else ""
    multi_id = f"{surface.id}.ms" if surface.material else ""
    filled = "".join(
        f"<con:fillingSurface>{_surface(opening, geometry, solid_lod)}</con:fillingSurface>"
        for opening in surface.openings
    )
    specific = kind.attributes()
    lod = f"lod{surface.lod}MultiSurface"
    return (
        f"{start}{names_text(surface.attributes)}"
        f"{_generics(surface.attributes, specific, kind.shape)}"
        f"<{lod}>{geometry.multi_surface(surface.polygons, name, multi_id)}</{lod}>"
        f"{''.join(_attributes(surface.kind, specific, surface.attributes))}{filled}{end}"
    )


def _attributes(
    kind: str, specific: Mapping[str, Attr], attributes: Mapping[str, Attribute]
) -> Iterator[str]:
    for attr in specific.values():
        if attr.name in attributes:
            yield _value(kind, attr, attributes[attr.name])


def _value(kind: str, attr: Attr, value: Attribute) -> str:
    texts = property_texts(attr, value)
    tag, label = f"{attr.prefix}:{attr.name}", ""
    if attr.type is Type.CODE:
        space = code_space(attr.prefix, kind, attr.name)
        label = f' codeSpace="{space}"' if space else ""
    elif attr.type in (Type.LENGTH, Type.LENGTHS, Type.HEIGHT):
        label = f" uom={quoteattr(unit_of(value))}"
    if attr.type is Type.HEIGHT:
        return "".join(
            "<con:height><con:Height><con:highReference>highestRoofEdge</con:highReference>"
            "<con:lowReference>lowestGroundPoint</con:lowReference><con:status>estimated"
            f"</con:status><con:value{label}>{text}</con:value></con:Height></con:height>"
            for text in texts
        )
    return "".join(f"<{tag}{label}>{text}</{tag}>" for text in texts)


def _geometry(feature: CityObject, kind: Kind, geometry: GeometryText) -> Iterator[str]:
    order = SURFACE_GEOMETRY if kind.shape is Shape.SURFACE else SPACE_GEOMETRY
    shell = shell_ids(feature)
    solid = f"lod{feature.solid_lod}Solid" if shell else ""
    for name in order if kind.shape is not Shape.RELIEF else ():
        if name == solid:
            yield f"<{name}>{geometry.solid_of_references(shell)}</{name}>"
        elif name in feature.curves:
            yield f"<{name}>{geometry.multi_curve(feature.curves[name])}</{name}>"
        elif name in feature.geometry:
            polygons = feature.geometry[name]
            is_solid = name.endswith("Solid")
            text = geometry.solid(polygons) if is_solid else geometry.multi_surface(polygons)
            yield f"<{name}>{text}</{name}>"
    if feature.placement is not None:
        implicit = implicit_text(feature.placement, geometry)
        yield f"<lod1ImplicitRepresentation>{implicit}</lod1ImplicitRepresentation>"


def _slots(feature: CityObject, kind: Kind, geometry: GeometryText) -> Iterator[str]:
    for slot in kind.slots:
        if isinstance(slot, Attr):
            if slot.name in feature.attributes:
                yield _value(feature.kind, slot, feature.attributes[slot.name])
        elif isinstance(slot, Ref):
            for target in feature.relations.get(slot.name, ()):
                yield f"<{slot.prefix}:{slot.name} {href(target)}/>"
        else:
            yield from _children(feature, slot, geometry)
    if kind.shape is Shape.RELIEF and "tin" in feature.geometry:
        yield f"<dem:tin>{geometry.triangulated_surface(feature.geometry['tin'])}</dem:tin>"


def _children(feature: CityObject, slot: Child, geometry: GeometryText) -> Iterator[str]:
    tag = f"{slot.prefix}:{slot.name}"
    if slot.name == "marking":
        for surface in feature.surfaces:
            if surface.kind == "Marking":
                yield f"<{tag}>{_surface(surface, geometry, feature.solid_lod)}</{tag}>"
    for child in feature.children:
        if child.kind in slot.kinds:
            yield f"<{tag}>{''.join(_object(child, geometry))}</{tag}>"
