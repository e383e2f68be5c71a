"""Classes of CityGML 3.0 and their types in CityJSON 2.0."""

_SAME = (
    "Building",
    "BuildingPart",
    "BuildingInstallation",
    "BuildingConstructiveElement",
    "BuildingFurniture",
    "BuildingRoom",
    "BuildingUnit",
    "Bridge",
    "BridgePart",
    "BridgeInstallation",
    "BridgeConstructiveElement",
    "Tunnel",
    "TunnelPart",
    "TunnelInstallation",
    "TunnelConstructiveElement",
    "OtherConstruction",
    "Road",
    "Railway",
    "CityFurniture",
    "SolitaryVegetationObject",
    "PlantCover",
    "LandUse",
    "WaterBody",
    "TINRelief",
)
OBJECT_TYPES: dict[str, str] = {
    **{name: name for name in _SAME},
    "Storey": "BuildingStorey",
    "Square": "TransportSquare",
    "Track": "Road",
    "GenericOccupiedSpace": "GenericCityObject",
    "GenericUnoccupiedSpace": "GenericCityObject",
    "GenericLogicalSpace": "GenericCityObject",
}
"""CityJSON type of each class that is a city object."""
OBJECT_KINDS: dict[str, str] = {
    **{name: name for name in _SAME},
    "BuildingStorey": "Storey",
    "TransportSquare": "Square",
    "GenericCityObject": "GenericOccupiedSpace",
    "Waterway": "WaterBody",
}
"""Class of a CityJSON type in files that do not name the class."""
TRANSPORT_PARTS = frozenset(
    {"Section", "Intersection", "TrafficSpace", "AuxiliaryTrafficSpace", "ClearanceSpace", "Hole"}
)
"""Classes that CityJSON represents only as surfaces of a road."""
SURFACE_TYPES: dict[str, str] = {
    **{
        name: name
        for name in (
            "RoofSurface",
            "GroundSurface",
            "WallSurface",
            "ClosureSurface",
            "OuterCeilingSurface",
            "OuterFloorSurface",
            "InteriorWallSurface",
            "CeilingSurface",
            "FloorSurface",
            "WaterSurface",
            "WaterGroundSurface",
            "TrafficArea",
            "AuxiliaryTrafficArea",
        )
    },
    "WindowSurface": "Window",
    "DoorSurface": "Door",
    "Marking": "TransportationMarking",
    "HoleSurface": "TransportationHole",
}
"""CityJSON semantics of each surface class."""
SURFACE_KINDS: dict[str, str] = {
    **{semantics: kind for kind, semantics in SURFACE_TYPES.items()},
    "WaterClosureSurface": "ClosureSurface",
}
"""Surface class of each CityJSON semantics."""
_SURFACES = frozenset({"MultiSurface", "CompositeSurface"})
_WITHOUT_LINES = _SURFACES | {"Solid", "CompositeSolid"}
_RESTRICTED = {
    "Building": _WITHOUT_LINES,
    "BuildingPart": _WITHOUT_LINES,
    "BuildingRoom": _WITHOUT_LINES,
    "BuildingUnit": _WITHOUT_LINES,
    "BuildingStorey": _WITHOUT_LINES,
    "Bridge": _WITHOUT_LINES | {"MultiSolid"},
    "BridgePart": _WITHOUT_LINES | {"MultiSolid"},
    "Tunnel": _WITHOUT_LINES | {"MultiSolid"},
    "TunnelPart": _WITHOUT_LINES | {"MultiSolid"},
    "OtherConstruction": _WITHOUT_LINES,
    "Road": _SURFACES | {"MultiLineString"},
    "Railway": _SURFACES | {"MultiLineString"},
    "TransportSquare": _SURFACES | {"MultiLineString"},
    "TINRelief": frozenset({"CompositeSurface"}),
    "WaterBody": _WITHOUT_LINES | {"MultiLineString"},
    "PlantCover": frozenset({"MultiSurface"}),
    "LandUse": _SURFACES,
}
_ANY = _WITHOUT_LINES | {"MultiSolid", "MultiLineString", "GeometryInstance"}


def may_hold(object_type: str, geometry_type: str) -> bool:
    """True if a city object type may have a geometry type (CityJSON 2.0, 2 and 3)."""
    return geometry_type in _RESTRICTED.get(object_type, _ANY)
