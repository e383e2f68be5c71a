"""Classes of CityGML 3.0 (OGC 20-010, 21-006r2) and their properties, in the order of the XSD."""

from dataclasses import dataclass
from enum import Enum

NAMESPACES = {
    "core": "http://www.opengis.net/citygml/3.0",
    "gml": "http://www.opengis.net/gml/3.2",
    "xlink": "http://www.w3.org/1999/xlink",
    "app": "http://www.opengis.net/citygml/appearance/3.0",
    "bldg": "http://www.opengis.net/citygml/building/3.0",
    "brid": "http://www.opengis.net/citygml/bridge/3.0",
    "con": "http://www.opengis.net/citygml/construction/3.0",
    "dem": "http://www.opengis.net/citygml/relief/3.0",
    "frn": "http://www.opengis.net/citygml/cityfurniture/3.0",
    "gen": "http://www.opengis.net/citygml/generics/3.0",
    "luse": "http://www.opengis.net/citygml/landuse/3.0",
    "tran": "http://www.opengis.net/citygml/transportation/3.0",
    "tun": "http://www.opengis.net/citygml/tunnel/3.0",
    "veg": "http://www.opengis.net/citygml/vegetation/3.0",
    "wtr": "http://www.opengis.net/citygml/waterbody/3.0",
}
"""Namespaces by prefix; the core module uses the default namespace."""


class Type(Enum):
    """Type of a property's value."""

    CODE = "gml:CodeType"
    """str; several values of a property are joined by ``;``."""
    ENUMERATION = "enumeration"
    """str, one of `ENUMERATIONS`."""
    DATE = "date"
    BOOLEAN = "boolean"
    INT = "integer"
    LENGTH = "gml:LengthType"
    """float, metres."""
    LENGTHS = "gml:MeasureOrNilReasonListType"
    """tuple of float, metres."""
    HEIGHT = "con:Height"
    """float, metres from the lowest ground to the highest roof edge."""


ENUMERATIONS = {
    "conditionOfConstruction": frozenset(
        ("declined", "demolished", "functional", "projected", "ruin", "underConstruction")
    ),
    "granularity": frozenset(("lane", "way")),
    "relationToConstruction": frozenset(("inside", "outside", "bothInsideAndOutside")),
    "spaceType": frozenset(("closed", "open", "semiOpen")),
    "trafficDirection": frozenset(("forwards", "backwards", "both")),
}
"""Values of each enumerated property."""


@dataclass(frozen=True)
class Attr:
    """A property with a value: its prefix, name and type."""

    prefix: str
    name: str
    type: Type


@dataclass(frozen=True)
class Child:
    """A property that contains features of certain classes."""

    prefix: str
    name: str
    kinds: tuple[str, ...]


@dataclass(frozen=True)
class Ref:
    """A property that refers to other features by xlink."""

    prefix: str
    name: str


Slot = Attr | Child | Ref


class Shape(Enum):
    """Geometry properties that a class inherits from the core module."""

    SPACE = "AbstractSpace"
    SURFACE = "AbstractThematicSurface"
    RELIEF = "AbstractReliefComponent"


@dataclass(frozen=True)
class Kind:
    """A class: its prefix, inherited properties, and specific properties in order."""

    prefix: str
    slots: tuple[Slot, ...]
    shape: Shape = Shape.SPACE

    def attributes(self) -> dict[str, Attr]:
        """Specific properties with a value, by name."""
        return {slot.name: slot for slot in self.slots if isinstance(slot, Attr)}


def _codes(prefix: str, *more: tuple[str, Type]) -> tuple[Attr, ...]:
    names = (("class", Type.CODE), ("function", Type.CODE), ("usage", Type.CODE), *more)
    return tuple(Attr(prefix, name, kind) for name, kind in names)


_CONSTRUCTION: tuple[Slot, ...] = (
    Attr("con", "conditionOfConstruction", Type.ENUMERATION),
    Attr("con", "dateOfConstruction", Type.DATE),
    Attr("con", "dateOfDemolition", Type.DATE),
    Attr("con", "height", Type.HEIGHT),
)
_BUILDING: tuple[Slot, ...] = (
    *_CONSTRUCTION,
    *_codes("bldg", ("roofType", Type.CODE)),
    Attr("bldg", "storeysAboveGround", Type.INT),
    Attr("bldg", "storeysBelowGround", Type.INT),
    Attr("bldg", "storeyHeightsAboveGround", Type.LENGTHS),
    Attr("bldg", "storeyHeightsBelowGround", Type.LENGTHS),
    Child("bldg", "buildingConstructiveElement", ("BuildingConstructiveElement",)),
    Child("bldg", "buildingInstallation", ("BuildingInstallation",)),
    Child("bldg", "buildingRoom", ("BuildingRoom",)),
    Child("bldg", "buildingFurniture", ("BuildingFurniture",)),
    Child("bldg", "buildingSubdivision", ("Storey", "BuildingUnit")),
)
_TRANSPORTATION: tuple[Slot, ...] = (
    Attr("tran", "trafficDirection", Type.ENUMERATION),
    Child("tran", "trafficSpace", ("TrafficSpace",)),
    Child("tran", "auxiliaryTrafficSpace", ("AuxiliaryTrafficSpace",)),
    Child("tran", "hole", ("Hole",)),
    Child("tran", "marking", ("Marking",)),
)
_WAY = Kind(
    "tran",
    (
        *_TRANSPORTATION,
        *_codes("tran"),
        Child("tran", "section", ("Section",)),
        Child("tran", "intersection", ("Intersection",)),
        Ref("tran", "intersection"),
    ),
)
_PART_OF_WAY = Kind("tran", (*_TRANSPORTATION, Attr("tran", "class", Type.CODE)))
_CONSTRUCTION_SURFACE = Kind("con", (), Shape.SURFACE)
_TRAFFIC_AREA = Kind("tran", _codes("tran", ("surfaceMaterial", Type.CODE)), Shape.SURFACE)


def _construction(prefix: str, name: str, *flags: str) -> Kind:
    flag_slots = tuple(Attr(prefix, flag, Type.BOOLEAN) for flag in flags)
    parts = tuple(
        Child(prefix, f"{name.lower()}{part}", (f"{name}{part}",))
        for part in ("ConstructiveElement", "Installation", "Part")
    )
    return Kind(prefix, (*_CONSTRUCTION, *_codes(prefix), *flag_slots, *parts))


def _element(prefix: str) -> Kind:
    return Kind(prefix, (Attr("con", "isStructuralElement", Type.BOOLEAN), *_codes(prefix)))


def _installation(prefix: str) -> Kind:
    return Kind(prefix, (Attr("con", "relationToConstruction", Type.ENUMERATION), *_codes(prefix)))


KINDS: dict[str, Kind] = {
    "Building": Kind("bldg", (*_BUILDING, Child("bldg", "buildingPart", ("BuildingPart",)))),
    "BuildingPart": Kind("bldg", _BUILDING),
    "BuildingConstructiveElement": _element("bldg"),
    "BuildingInstallation": _installation("bldg"),
    "BuildingFurniture": Kind("bldg", _codes("bldg")),
    "BuildingRoom": Kind(
        "bldg",
        (
            *_codes("bldg"),
            Child("bldg", "buildingFurniture", ("BuildingFurniture",)),
            Child("bldg", "buildingInstallation", ("BuildingInstallation",)),
        ),
    ),
    "Storey": Kind("bldg", (*_codes("bldg"), Ref("bldg", "buildingRoom"))),
    "BuildingUnit": Kind("bldg", _codes("bldg")),
    "OtherConstruction": Kind("con", (*_CONSTRUCTION, *_codes("con"))),
    "Bridge": _construction("brid", "Bridge", "isMovable"),
    "BridgePart": Kind("brid", (*_CONSTRUCTION, *_codes("brid"))),
    "BridgeConstructiveElement": _element("brid"),
    "BridgeInstallation": _installation("brid"),
    "Tunnel": _construction("tun", "Tunnel"),
    "TunnelPart": Kind("tun", (*_CONSTRUCTION, *_codes("tun"))),
    "TunnelConstructiveElement": _element("tun"),
    "TunnelInstallation": _installation("tun"),
    "Road": _WAY,
    "Track": _WAY,
    "Railway": _WAY,
    "Square": Kind("tran", (*_TRANSPORTATION, *_codes("tran"))),
    "Section": _PART_OF_WAY,
    "Intersection": _PART_OF_WAY,
    "TrafficSpace": Kind(
        "tran",
        (
            *_codes("tran"),
            Attr("tran", "granularity", Type.ENUMERATION),
            Attr("tran", "trafficDirection", Type.ENUMERATION),
            Ref("tran", "predecessor"),
            Ref("tran", "successor"),
            Child("tran", "clearanceSpace", ("ClearanceSpace",)),
        ),
    ),
    "AuxiliaryTrafficSpace": Kind(
        "tran", (*_codes("tran"), Attr("tran", "granularity", Type.ENUMERATION))
    ),
    "ClearanceSpace": Kind("tran", (Attr("tran", "class", Type.CODE),)),
    "Hole": Kind("tran", (Attr("tran", "class", Type.CODE),)),
    "Marking": Kind("tran", (Attr("tran", "class", Type.CODE),), Shape.SURFACE),
    "TrafficArea": _TRAFFIC_AREA,
    "AuxiliaryTrafficArea": _TRAFFIC_AREA,
    "HoleSurface": Kind("tran", (), Shape.SURFACE),
    "CityFurniture": Kind("frn", _codes("frn")),
    "SolitaryVegetationObject": Kind(
        "veg",
        _codes(
            "veg",
            ("species", Type.CODE),
            ("height", Type.LENGTH),
            ("trunkDiameter", Type.LENGTH),
            ("crownDiameter", Type.LENGTH),
            ("rootBallDiameter", Type.LENGTH),
            ("maxRootBallDepth", Type.LENGTH),
        ),
    ),
    "PlantCover": Kind(
        "veg",
        _codes(
            "veg",
            ("averageHeight", Type.LENGTH),
            ("minHeight", Type.LENGTH),
            ("maxHeight", Type.LENGTH),
        ),
    ),
    "LandUse": Kind("luse", _codes("luse"), Shape.SURFACE),
    "WaterBody": Kind("wtr", _codes("wtr")),
    "ReliefFeature": Kind(
        "dem",
        (Attr("dem", "lod", Type.INT), Child("dem", "reliefComponent", ("TINRelief",))),
        Shape.RELIEF,
    ),
    "TINRelief": Kind("dem", (Attr("dem", "lod", Type.INT),), Shape.RELIEF),
    "GenericOccupiedSpace": Kind("gen", _codes("gen")),
    "GenericUnoccupiedSpace": Kind("gen", _codes("gen")),
    "GenericLogicalSpace": Kind("gen", _codes("gen")),
    "GenericThematicSurface": Kind("gen", _codes("gen"), Shape.SURFACE),
    "ClosureSurface": Kind("core", (), Shape.SURFACE),
    **dict.fromkeys(
        (
            "WallSurface",
            "RoofSurface",
            "GroundSurface",
            "OuterFloorSurface",
            "OuterCeilingSurface",
            "FloorSurface",
            "CeilingSurface",
            "InteriorWallSurface",
            "WindowSurface",
            "DoorSurface",
        ),
        _CONSTRUCTION_SURFACE,
    ),
}
"""Writable classes by name."""

SPACE_GEOMETRY = (
    "lod0MultiSurface",
    "lod0MultiCurve",
    "lod1Solid",
    "lod2Solid",
    "lod2MultiSurface",
    "lod2MultiCurve",
    "lod3Solid",
    "lod3MultiSurface",
    "lod3MultiCurve",
    "lod1TerrainIntersectionCurve",
    "lod2TerrainIntersectionCurve",
    "lod3TerrainIntersectionCurve",
)
"""Geometry properties of a space in the order of the XSD; implicit representations follow."""
SURFACE_GEOMETRY = (
    "lod0MultiCurve",
    "lod0MultiSurface",
    "lod1MultiSurface",
    "lod2MultiSurface",
    "lod3MultiSurface",
)
"""Geometry properties of a thematic surface in the order of the XSD."""
