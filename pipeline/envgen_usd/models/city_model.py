"""The semantic city model: a tree of CityGML features with their geometry.

Features, surfaces and properties have their names of OGC CityGML 3.0 (20-010). Both readers and
writers of other formats use these names.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from envgen_usd.errors import Issue
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.attribute_values import Attribute
from envgen_usd.models.frozen_model import Model
from envgen_usd.models.polygon_arrays import Polygons

CONSTRUCTIONS = frozenset(
    f"{construction}{part}"
    for construction in ("Building", "Bridge", "Tunnel", "OtherConstruction")
    for part in ("", "Part", "Installation", "ConstructiveElement")
)
"""Classes whose geometry gives their shape; for these a template names no asset."""

AVENUE = "avenue"
"""Attribute of the things of a row; those with the same value share an asset and its variants."""

ENCLOSURE = "enclosure"
"""Attribute of a gate: kind of the enclosure in which it stands, e.g. ``fence``."""


@dataclass(frozen=True, repr=False, eq=False)
class ThematicSurface(Model):
    """A bounding surface of a feature, or an opening that fills a hole of such a surface.

    Attributes:
        id: gml:id, unique over all maps.
        kind: CityGML class: ``WallSurface``, ``RoofSurface``, ``GroundSurface``,
            ``OuterFloorSurface``, ``WindowSurface``, ``DoorSurface``, ``TrafficArea``,
            ``AuxiliaryTrafficArea``, ``Marking``, ...
        polygons: Geometry; the holes for the openings stay open.
        lod: Level of detail of the geometry, 0 to 3.
        material: Material of the asset library, written as an appearance theme; empty where
            unknown.
        attributes: ``class``, ``function``, ``usage``, ``surfaceMaterial`` and generic attributes.
        openings: Windows and doors that fill holes of this surface.
    """

    id: str
    kind: str
    polygons: Polygons
    lod: int
    material: str = ""
    attributes: Mapping[str, Attribute] = field(default_factory=dict)
    openings: tuple["ThematicSurface", ...] = ()


@dataclass(frozen=True, repr=False, eq=False)
class Placement(Model):
    """Pose of a template (CityGML implicit geometry), used in place of a geometry.

    Attributes:
        position: 3, metres, road frame; the centre of the template's foot.
        heading: Radians, counter-clockwise from +x to the template's +x.
        pitch: Radians; positive values raise +x.
        roll: Radians about +x.
        size: 3, metres along the template's x, y and z; zero where unknown.
        template: Kind of asset, e.g. ``street_light``, ``tree``, ``traffic_sign``, ``bench``.
    """

    position: FloatArray
    heading: float
    size: FloatArray
    template: str
    pitch: float = 0.0
    roll: float = 0.0


@dataclass(frozen=True, repr=False, eq=False)
class CityObject(Model):
    """A feature of the city model (CityGML AbstractFeature).

    Attributes:
        id: gml:id, unique over all maps and stable over rebuilds (an NCName).
        kind: CityGML class: ``Building``, ``BuildingPart``, ``Road``, ``Section``,
            ``Intersection``, ``TrafficSpace``, ``AuxiliaryTrafficSpace``, ``Marking``,
            ``CityFurniture``, ``SolitaryVegetationObject``, ``PlantCover``, ``LandUse``,
            ``TINRelief``, ``GenericOccupiedSpace``, ...
        attributes: Properties of the class (``class``, ``function``, ``usage``, ``roofType``,
            ``storeysAboveGround``, ``height``, ``granularity``, ...) and generic attributes. A
            writer turns each name outside the class into a generic attribute, and so each value
            that does not suit the class. Codes are strings; ``;`` separates several values of
            ``function`` or ``usage``.
        surfaces: Bounding surfaces with semantics. Those of a closed space (a building) form its
            outer shell at their level of detail.
        solid_lod: Level of detail at which the surfaces also form a solid; -1 without a solid.
        geometry: Geometry without semantics by its CityGML property, e.g. ``lod1Solid``,
            ``lod2MultiSurface``.
        curves: Polylines by their CityGML property, e.g. ``lod2MultiCurve``; each N_i x 3.
        placement: Implicit geometry; `None` where the feature has its own geometry.
        relations: Ids of other features by role: ``predecessor``, ``successor``,
            ``laneChangeLeft``, ``laneChangeRight``, ``controls``, ... A feature of another file is
            referred to by that file's relative path, ``#`` and the id.
        children: Parts (sections of a road, traffic spaces of a section, parts of a building), in
            the order of their CityGML properties.
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
        """Yields this object and all its descendants, depth first."""
        yield self
        for child in self.children:
            yield from child.walk()


@dataclass(frozen=True, repr=False, eq=False)
class City(Model):
    """City objects of a chunk or of a whole map.

    Attributes:
        objects: Top-level features (cityObjectMember).
        crs: The OpenDRIVE geoReference (PROJ string or WKT), or an EPSG name; empty if unknown.
        offset: 3, metres; coordinates in `crs` are road-frame coordinates plus this offset.
        issues: Warnings and errors of the file; readers leave out features that they cannot read.
            Of a generated city, what had no room.
    """

    objects: tuple[CityObject, ...]
    crs: str = ""
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    issues: tuple[Issue, ...] = ()

    def walk(self) -> Iterator[CityObject]:
        """Yields all objects, depth first."""
        for top in self.objects:
            yield from top.walk()

    def of_kind(self, *kinds: str) -> tuple[CityObject, ...]:
        """Returns all objects of the given classes, at any depth."""
        return tuple(each for each in self.walk() if each.kind in kinds)
