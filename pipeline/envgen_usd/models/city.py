"""The semantic city: a tree of CityGML features with their geometry.

Feature, surface and property names are those of OGC CityGML 3.0 (20-010), so that the model reads
like the standard, whoever wrote the file.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import TypeAlias

from envgen_usd.errors import Issue
from envgen_usd.models.arrays import FloatArray
from envgen_usd.models.polygons import Polygons

Attribute: TypeAlias = str | int | float
CONSTRUCTIONS = frozenset(
    f"{construction}{part}"
    for construction in ("Building", "Bridge", "Tunnel", "OtherConstruction")
    for part in ("", "Part", "Installation", "ConstructiveElement")
)
"""Classes that are shaped by their geometry: a template of theirs stands for no asset."""


@dataclass(frozen=True)
class ThematicSurface:
    """A bounding surface of a feature, or an opening that fills a part of one.

    Attributes:
        id: gml:id, unique over all maps.
        kind: CityGML class: ``WallSurface``, ``RoofSurface``, ``GroundSurface``,
            ``OuterFloorSurface``, ``WindowSurface``, ``DoorSurface``, ``TrafficArea``,
            ``AuxiliaryTrafficArea``, ``Marking``, ...
        polygons: Geometry, without the holes' fillings.
        lod: Level of detail of the geometry, 0 to 3.
        material: Name of a material of the asset library, empty where none is known; written as
            an appearance theme.
        attributes: ``class``, ``function``, ``usage``, ``surfaceMaterial`` and generic ones.
        openings: Windows and doors that fill holes of this surface.
    """

    id: str
    kind: str
    polygons: Polygons
    lod: int
    material: str = ""
    attributes: Mapping[str, Attribute] = field(default_factory=dict)
    openings: tuple["ThematicSurface", ...] = ()


@dataclass(frozen=True)
class Placement:
    """Where a template stands (CityGML implicit geometry): a pose in place of a geometry.

    Attributes:
        position: 3, metres, road frame; the middle of the template's foot.
        heading: Radians, counter-clockwise from +x; the template's +x looks there.
        pitch: Radians, positive lifts +x.
        roll: Radians about +x.
        size: 3, extent in metres along the template's x, y, z; zero where it is not known.
        template: Kind of asset, e.g. ``street_light``, ``tree``, ``traffic_sign``, ``bench``.
    """

    position: FloatArray
    heading: float
    size: FloatArray
    template: str
    pitch: float = 0.0
    roll: float = 0.0


@dataclass(frozen=True)
class CityObject:
    """A feature of the city.

    Attributes:
        id: gml:id, unique over all maps and stable over rebuilds (an NCName).
        kind: CityGML class: ``Building``, ``BuildingPart``, ``Road``, ``Section``,
            ``Intersection``, ``TrafficSpace``, ``AuxiliaryTrafficSpace``, ``Marking``,
            ``CityFurniture``, ``SolitaryVegetationObject``, ``PlantCover``, ``LandUse``,
            ``TINRelief``, ``GenericOccupiedSpace``, ...
        attributes: The class's own properties (``class``, ``function``, ``usage``, ``roofType``,
            ``storeysAboveGround``, ``height``, ``granularity``, ...) and generic attributes. A
            name that is not a property of the class is written as a generic attribute. Codes are
            strings; several values of ``function`` or ``usage`` are joined by ``;``.
        surfaces: Bounding surfaces with semantics. For a closed space (a building) they form its
            outer shell at the lod they carry.
        solid_lod: The lod at which the surfaces together are also written as a solid; -1: none.
        geometry: Geometry without semantics, by the name of the CityGML property it came from or
            goes to, e.g. ``lod1Solid``, ``lod2MultiSurface``.
        curves: Polylines by the name of the property, e.g. ``lod2MultiCurve``; each N_i x 3.
        placement: Implicit geometry, or none.
        relations: Ids of other features by role: ``predecessor``, ``successor``,
            ``laneChangeLeft``, ``laneChangeRight``, ``controls``, ... The id of a feature of
            another file follows the path of that file, relative to this one, and ``#``.
        children: Parts: sections of a road, traffic spaces of a section, parts of a building;
            in the order in which CityGML has the properties that hold them.
    """

    id: str
    kind: str
    attributes: Mapping[str, Attribute] = field(default_factory=dict)
    surfaces: tuple[ThematicSurface, ...] = ()
    solid_lod: int = -1
    geometry: Mapping[str, Polygons] = field(default_factory=dict)
    curves: Mapping[str, tuple[FloatArray, ...]] = field(default_factory=dict)
    placement: Placement | None = None
    relations: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    children: tuple["CityObject", ...] = ()

    def walk(self) -> Iterator["CityObject"]:
        """This object and everything below it, depth first."""
        yield self
        for child in self.children:
            yield from child.walk()


@dataclass(frozen=True)
class City:
    """City objects of one chunk or of a whole map.

    Attributes:
        objects: Top-level features (cityObjectMember).
        crs: The OpenDRIVE geoReference (PROJ string or WKT), or an EPSG name; empty if unknown.
        offset: 3, what has to be added to road-frame coordinates to get those of `crs`.
        issues: What was odd in the file that it was read from; features that could not be read
            are left out.
    """

    objects: tuple[CityObject, ...]
    crs: str = ""
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    issues: tuple[Issue, ...] = ()

    def walk(self) -> Iterator[CityObject]:
        """All objects, depth first."""
        for top in self.objects:
            yield from top.walk()

    def of_kind(self, *kinds: str) -> tuple[CityObject, ...]:
        """All objects, at any depth, whose class is one of these."""
        return tuple(found for found in self.walk() if found.kind in kinds)
