"""Reads CityGML elements as features of the model."""

from collections import defaultdict
from dataclasses import dataclass, field
from functools import cache

import numpy as np
from lxml import etree

from envgen_usd.citygml.appearance import THEME
from envgen_usd.citygml.feature_properties import KINDS, Attr, Child, Kind, Ref, Shape
from envgen_usd.citygml.generic_attributes import read_generics
from envgen_usd.citygml.gml_geometry_read import GeometryReader
from envgen_usd.citygml.implicit_pose import angles
from envgen_usd.citygml.implicit_templates import placed_shape
from envgen_usd.citygml.property_values import read_property
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.attribute_values import Attribute, as_number
from envgen_usd.models.city_model import CityObject, Placement, ThematicSurface
from envgen_usd.models.polygon_arrays import Polygons
from envgen_usd.xml_events import local_name

_GML_ID = "{http://www.opengis.net/gml/3.2}id"
_HREF = "{http://www.w3.org/1999/xlink}href"
_GENERIC = "GenericThematicSurface"
_SIZE = tuple(f"placement_size_{axis}" for axis in "xyz")


@dataclass
class _Parts:
    """Parts of a feature read so far."""

    attributes: dict[str, Attribute] = field(default_factory=dict)
    surfaces: list[ThematicSurface] = field(default_factory=list)
    solid_lod: int = -1
    geometry: dict[str, Polygons] = field(default_factory=dict)
    curves: dict[str, tuple[FloatArray, ...]] = field(default_factory=dict)
    placement: Placement | None = None
    relations: dict[str, list[str]] = field(default_factory=lambda: defaultdict(list))
    children: list[CityObject] = field(default_factory=list)


class FeatureReader:
    """Reads features, and the surface materials of their appearances.

    Attributes:
        faults: Attributes that are not of their type; they are read as texts.
    """

    def __init__(self, geometry: GeometryReader) -> None:
        """Starts with the reader of coordinates."""
        self._geometry = geometry
        self._materials: dict[str, str] = {}
        self.faults: list[str] = []

    def feature(self, element: etree._Element) -> CityObject:
        """Returns the feature of an element with all its parts."""
        name = local_name(element)
        kind = KINDS.get(name, KINDS["GenericOccupiedSpace"])
        slots = {slot.name: slot for slot in kind.slots}
        parts = _Parts()
        for child in element:
            self._property(child, slots.get(local_name(child)), kind, parts)
        parts.attributes |= read_generics(element, self.faults)
        extents = [as_number(parts.attributes.pop(axis, 0.0)) for axis in _SIZE]
        placement = parts.placement
        if placement is not None:
            size = np.array(extents, dtype=np.float64)
            placement = Placement(**{**vars(placement), "size": size})
        return CityObject(
            id=element.get(_GML_ID, ""),
            kind=name,
            attributes=parts.attributes,
            surfaces=tuple(parts.surfaces),
            solid_lod=parts.solid_lod,
            geometry=parts.geometry,
            curves=parts.curves,
            placement=placement,
            relations={role: tuple(ids) for role, ids in parts.relations.items()},
            children=tuple(parts.children),
        )

    def _property(self, element: etree._Element, slot: object, kind: Kind, parts: _Parts) -> None:
        name = local_name(element)
        href = element.get(_HREF)
        if isinstance(slot, Ref) and href is not None:
            parts.relations[name].append(href.removeprefix("#"))
        elif isinstance(slot, Child | Ref):
            self._children(element, parts)
        elif isinstance(slot, Attr):
            read_property(element, slot, parts.attributes, self.faults)
        elif name == "boundary":
            parts.surfaces += [self._surface(child) for child in element]
        elif name == "relatedTo":
            role, target = _relation(element)
            parts.relations[role].append(target)
        elif name == "appearance":
            self._appearance(element)
        elif name.startswith("lod") or name == "tin":
            self._shape(element, name, parts)
        elif kind.shape is Shape.SPACE or name != "spaceType":
            _common(element, name, parts.attributes)

    def _children(self, element: etree._Element, parts: _Parts) -> None:
        for child in element:
            is_line = child.find("{*}lod0MultiCurve") is not None
            if local_name(child) == "Marking" and not is_line:
                parts.surfaces.append(self._surface(child))
            else:
                parts.children.append(self.feature(child))

    def _surface(self, element: etree._Element) -> ThematicSurface:
        name = _surface_kind(local_name(element))
        known = KINDS[name].attributes()
        attributes: dict[str, Attribute] = {}
        openings: list[ThematicSurface] = []
        lod, polygons, material = 0, Polygons.of_rings([]), ""
        for child in element:
            role = local_name(child)
            if role in known:
                read_property(child, known[role], attributes, self.faults)
            elif role.endswith("MultiSurface"):
                lod, polygons = int(role[3]), self._geometry.polygons(child)
                target = next((found.get(_GML_ID, "") for found in child), "")
                material = self._materials.get(target, "")
            elif role == "fillingSurface":
                openings += [self._surface(opening) for opening in child]
            else:
                _common(child, role, attributes)
        attributes |= read_generics(element, self.faults)
        return ThematicSurface(
            element.get(_GML_ID, ""), name, polygons, lod, material, attributes, tuple(openings)
        )

    def _shape(self, element: etree._Element, name: str, parts: _Parts) -> None:
        if name.endswith("ImplicitRepresentation"):
            self._implicit(element, f"{name[:4]}MultiSurface", parts)
        elif name.endswith("Curve"):
            parts.curves[name] = self._geometry.curves(element)
        elif name.endswith("Solid") and next(element.iter("{*}Polygon"), None) is None:
            parts.solid_lod = int(name[3])
        elif name.endswith("Solid"):
            parts.geometry[name] = self._geometry.solids(element)
        else:
            parts.geometry[name] = self._geometry.polygons(element)

    def _implicit(self, element: etree._Element, name: str, parts: _Parts) -> None:
        """Implicit geometry: a shape if it contains relative geometry, else a pose."""
        point = next(element.iter("{*}referencePoint"), None)
        shape = None if point is None else placed_shape(element, self._geometry.point(point))
        if shape is None or not len(shape):
            parts.placement = self._placement(element)
        else:
            parts.geometry[name] = shape

    def _placement(self, element: etree._Element) -> Placement | None:
        matrix = next(element.iter("{*}transformationMatrix"), None)
        point = next(element.iter("{*}referencePoint"), None)
        if matrix is None or point is None:
            return None
        values = np.array((matrix.text or "").split(), dtype=np.float64).reshape(4, 4)
        heading, pitch, roll = angles(values[:3, :3])
        template = next(element.iter("{*}libraryObject"), None)
        return Placement(
            position=self._geometry.point(point),
            heading=heading,
            size=np.zeros(3),
            template="" if template is None else template.text or "",
            pitch=pitch,
            roll=roll,
        )

    def _appearance(self, element: etree._Element) -> None:
        theme = next(element.iter("{*}theme"), None)
        if theme is None or theme.text != THEME:
            return
        for material in element.iter("{*}X3DMaterial"):
            name = material.findtext("{*}name") or ""
            for target in material.iter("{*}target"):
                self._materials[(target.text or "").removeprefix("#")] = name


@cache
def _surface_kind(name: str) -> str:
    """The class of a surface; for one of an extension that which it ends in, or a generic one."""
    surfaces = [kind for kind, known in KINDS.items() if known.shape is Shape.SURFACE]
    return next(
        (kind for kind in (name, *surfaces) if kind in KINDS and name.endswith(kind)), _GENERIC
    )


def _common(element: etree._Element, name: str, attributes: dict[str, Attribute]) -> None:
    if name not in ("name", "description", "spaceType"):
        return
    text = element.text or ""
    before = attributes.get(name)
    if name != "name" or before is None:
        attributes[name] = text
    else:
        attributes[name] = (*(before if isinstance(before, tuple) else (before,)), text)


def _relation(element: etree._Element) -> tuple[str, str]:
    role = next(element.iter("{*}relationType"), None)
    target = next((e.get(_HREF) for e in element.iter("{*}relatedTo") if e.get(_HREF)), "")
    return ("" if role is None else role.text or ""), (target or "").removeprefix("#")
