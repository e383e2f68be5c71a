"""Classes of CityGML 2.0 (OGC 12-019) that represent the classes of 3.0."""

from dataclasses import dataclass

NAMESPACES_2 = {
    "core": "http://www.opengis.net/citygml/2.0",
    "gml": "http://www.opengis.net/gml",
    "xlink": "http://www.w3.org/1999/xlink",
    "app": "http://www.opengis.net/citygml/appearance/2.0",
    "bldg": "http://www.opengis.net/citygml/building/2.0",
    "brid": "http://www.opengis.net/citygml/bridge/2.0",
    "dem": "http://www.opengis.net/citygml/relief/2.0",
    "frn": "http://www.opengis.net/citygml/cityfurniture/2.0",
    "gen": "http://www.opengis.net/citygml/generics/2.0",
    "luse": "http://www.opengis.net/citygml/landuse/2.0",
    "tran": "http://www.opengis.net/citygml/transportation/2.0",
    "tun": "http://www.opengis.net/citygml/tunnel/2.0",
    "veg": "http://www.opengis.net/citygml/vegetation/2.0",
}
"""Namespaces by prefix; the core module uses the default namespace."""

CODES = ("class", "function", "usage")
SURFACES = frozenset(
    (
        "WallSurface",
        "RoofSurface",
        "GroundSurface",
        "ClosureSurface",
        "OuterFloorSurface",
        "OuterCeilingSurface",
        "FloorSurface",
        "CeilingSurface",
        "InteriorWallSurface",
    )
)
"""Boundary surfaces of constructions."""


@dataclass(frozen=True)
class OldKind:
    """A class of CityGML 2.0.

    Attributes:
        prefix: Namespace prefix of the class.
        name: Name of the class.
        attributes: (name in the model, name in the file) of its specific properties, in order.
        geometry: Properties in order; ``boundedBy`` marks the place of the surfaces, and a class
            name of the model marks the place of parts of that class.
    """

    prefix: str
    name: str
    attributes: tuple[tuple[str, str], ...]
    geometry: tuple[str, ...]


def _same(*names: str) -> tuple[tuple[str, str], ...]:
    return tuple((name, name) for name in names)


_YEARS = (("dateOfConstruction", "yearOfConstruction"), ("dateOfDemolition", "yearOfDemolition"))
_BODY = (
    "lod1Solid",
    "lod1MultiSurface",
    "lod2Solid",
    "lod2MultiSurface",
    "lod2MultiCurve",
)
_FINE_BODY = ("lod3Solid", "lod3MultiSurface", "lod3MultiCurve")
_GEOMETRY = ("lod1Geometry", "lod2Geometry", "lod3Geometry")
_STANDING = (*_GEOMETRY, "lod1ImplicitRepresentation")
_BUILDING = (
    *_same(*CODES),
    *_YEARS,
    *_same("roofType"),
    ("height", "measuredHeight"),
    *_same(
        "storeysAboveGround",
        "storeysBelowGround",
        "storeyHeightsAboveGround",
        "storeyHeightsBelowGround",
    ),
)
_INSTALLATIONS = {
    "bldg": ("BuildingConstructiveElement", "BuildingInstallation"),
    "brid": ("BridgeConstructiveElement", "BridgeInstallation"),
    "tun": ("TunnelConstructiveElement", "TunnelInstallation"),
}


def _construction(prefix: str, name: str, attributes: tuple[tuple[str, str], ...]) -> OldKind:
    first = ("lod0FootPrint",) if prefix == "bldg" else ()
    rooms = ("BuildingRoom",) if prefix == "bldg" else ()
    parts = (f"{name}Part",) if not name.endswith("Part") else ()
    return OldKind(
        prefix,
        name,
        attributes,
        (*first, *_BODY, *_INSTALLATIONS[prefix], "boundedBy", *_FINE_BODY, *rooms, *parts),
    )


def _installation(prefix: str, name: str) -> OldKind:
    geometry = _GEOMETRY[1:]
    return OldKind(
        prefix, name, _same(*CODES), (*geometry, "lod2ImplicitRepresentation", "boundedBy")
    )


_GENERIC = OldKind("gen", "GenericCityObject", _same(*CODES), ("lod0Geometry", *_STANDING))
_ROAD = _same(*CODES)
OLD_KINDS: dict[str, OldKind] = {
    "Building": _construction("bldg", "Building", _BUILDING),
    "BuildingPart": _construction("bldg", "BuildingPart", _BUILDING),
    "BuildingInstallation": _installation("bldg", "BuildingInstallation"),
    "BuildingConstructiveElement": _installation("bldg", "BuildingInstallation"),
    "BuildingRoom": OldKind(
        "bldg", "Room", _same(*CODES), ("lod4Solid", "lod4MultiSurface", "boundedBy")
    ),
    "Bridge": _construction("brid", "Bridge", (*_same(*CODES), *_YEARS, *_same("isMovable"))),
    "BridgePart": _construction("brid", "BridgePart", (*_same(*CODES), *_YEARS)),
    "BridgeInstallation": _installation("brid", "BridgeInstallation"),
    "BridgeConstructiveElement": _installation("brid", "BridgeConstructionElement"),
    "Tunnel": _construction("tun", "Tunnel", (*_same(*CODES), *_YEARS)),
    "TunnelPart": _construction("tun", "TunnelPart", (*_same(*CODES), *_YEARS)),
    "TunnelInstallation": _installation("tun", "TunnelInstallation"),
    "TunnelConstructiveElement": _installation("tun", "TunnelInstallation"),
    "Road": OldKind("tran", "Road", _ROAD, ()),
    "Track": OldKind("tran", "Track", _ROAD, ()),
    "Railway": OldKind("tran", "Railway", _ROAD, ()),
    "Square": OldKind("tran", "Square", _ROAD, ()),
    "CityFurniture": OldKind("frn", "CityFurniture", _same(*CODES), _STANDING),
    "SolitaryVegetationObject": OldKind(
        "veg",
        "SolitaryVegetationObject",
        _same(*CODES, "species", "height", "trunkDiameter", "crownDiameter"),
        _STANDING,
    ),
    "PlantCover": OldKind(
        "veg",
        "PlantCover",
        _same(*CODES, "averageHeight"),
        ("lod1MultiSurface", "lod2MultiSurface", "lod3MultiSurface"),
    ),
    "LandUse": OldKind(
        "luse",
        "LandUse",
        _same(*CODES),
        ("lod0MultiSurface", "lod1MultiSurface", "lod2MultiSurface", "lod3MultiSurface"),
    ),
    "ReliefFeature": OldKind("dem", "ReliefFeature", _same("lod"), ("TINRelief",)),
    "TINRelief": OldKind("dem", "TINRelief", _same("lod"), ("tin",)),
}
"""Classes of 2.0 by class name of 3.0."""
OTHER_KIND = _GENERIC
"""Substitute for classes that 2.0 lacks."""
PART_PROPERTIES = {
    "BuildingPart": "bldg:consistsOfBuildingPart",
    "BuildingInstallation": "bldg:outerBuildingInstallation",
    "BuildingConstructiveElement": "bldg:outerBuildingInstallation",
    "BuildingRoom": "bldg:interiorRoom",
    "BridgePart": "brid:consistsOfBridgePart",
    "BridgeInstallation": "brid:outerBridgeInstallation",
    "BridgeConstructiveElement": "brid:outerBridgeConstruction",
    "TunnelPart": "tun:consistsOfTunnelPart",
    "TunnelInstallation": "tun:outerTunnelInstallation",
    "TunnelConstructiveElement": "tun:outerTunnelInstallation",
    "TINRelief": "dem:reliefComponent",
}
"""Property that holds a part, by the part's class in the model."""
