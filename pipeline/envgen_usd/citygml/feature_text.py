"""Writes features of the city as CityGML 3.0 text."""

from collections.abc import Iterator, Mapping
from xml.sax.saxutils import escape

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
from envgen_usd.citygml.gml_geometry_text import GeometryText
from envgen_usd.citygml.shared_text import (
    double_text,
    href,
    implicit_text,
    names_text,
    shell_ids,
    start_tag,
)
from envgen_usd.errors import EnvgenError
from envgen_usd.models.city_model import Attribute, CityObject, Placement, ThematicSurface

_PLACEMENT_SIZE = "placement_size_"
# Elements of the core module use the default namespace.
_GENERIC = (
    "<genericAttribute><gen:{0}><gen:name>{1}</gen:name>"
    "<gen:value>{2}</gen:value></gen:{0}></genericAttribute>"
)


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
    if kind.shape is Shape.SPACE and "spaceType" in feature.attributes:
        yield f"<spaceType>{escape(str(feature.attributes['spaceType']))}</spaceType>"
    for surface in feature.surfaces:
        if surface.kind != "Marking" or not _has_markings(kind):
            yield f"<boundary>{_surface(surface, geometry, feature.solid_lod)}</boundary>"
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
    known = {"name", "description"} | ({"spaceType"} if shape is Shape.SPACE else set())
    return "".join(
        _generic(name, value)
        for name, value in attributes.items()
        if name not in specific and name not in known
    )


def _generic(name: str, value: Attribute) -> str:
    if isinstance(value, str):
        # XML parsers turn a carriage return into a line feed.
        text = escape(value, {"\r": "&#13;"})
        return _GENERIC.format("StringAttribute", escape(name), text)
    if isinstance(value, int):
        return _GENERIC.format("IntAttribute", escape(name), value)
    return _GENERIC.format("DoubleAttribute", escape(name), double_text(value))


def _size(placement: Placement) -> str:
    axes = zip("xyz", placement.size.tolist(), strict=True)
    return "".join(_generic(_PLACEMENT_SIZE + axis, float(extent)) for axis, extent in axes)


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
    tag = f"{attr.prefix}:{attr.name}"
    if attr.type is Type.CODE:
        space = code_space(attr.prefix, kind, attr.name)
        label = f' codeSpace="{space}"' if space else ""
        many = str(value).split(";") if attr.name in ("function", "usage") else [str(value)]
        return "".join(f"<{tag}{label}>{escape(code)}</{tag}>" for code in many)
    if attr.type is Type.HEIGHT:
        return (
            "<con:height><con:Height><con:highReference>highestRoofEdge</con:highReference>"
            "<con:lowReference>lowestGroundPoint</con:lowReference><con:status>estimated"
            f'</con:status><con:value uom="m">{double_text(float(value))}</con:value></con:Height>'
            "</con:height>"
        )
    if attr.type is Type.LENGTH:
        return f'<{tag} uom="m">{double_text(float(value))}</{tag}>'
    if attr.type is Type.LENGTHS:
        return f'<{tag} uom="m">{escape(str(value))}</{tag}>'
    return f"<{tag}>{escape(str(value))}</{tag}>"


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
