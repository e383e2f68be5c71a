"""Code spaces: which code list the value of a property is taken from."""

_SIG3D = "http://www.sig3d.org/codelists/citygml/2.0"
_MODULES = {
    "bldg": "building",
    "brid": "bridge",
    "frn": "cityfurniture",
    "gen": "generics",
    "luse": "landuse",
    "tran": "transportation",
    "tun": "tunnel",
    "veg": "vegetation",
    "wtr": "waterbody",
}
_CLASSES = {
    "Building": "_AbstractBuilding",
    "BuildingPart": "_AbstractBuilding",
    "BuildingRoom": "Room",
    "Road": "TransportationComplex",
    "Track": "TransportationComplex",
    "Railway": "TransportationComplex",
    "Square": "TransportationComplex",
    "TrafficSpace": "TrafficArea",
    "AuxiliaryTrafficSpace": "AuxiliaryTrafficArea",
    "Bridge": "_AbstractBridge",
    "Tunnel": "_AbstractTunnel",
}


def code_space(prefix: str, kind: str, name: str) -> str:
    """Returns the URI of the code list of a property, empty where there is no list.

    The lists are those of the Special Interest Group 3D for CityGML 2.0; for 3.0 none were
    published, and its classes take over those of their forerunners.

    Args:
        prefix: Of the class's namespace, e.g. ``bldg``.
        kind: CityGML class.
        name: Property, e.g. ``roofType``.
    """
    module = _MODULES.get(prefix)
    if module is None or kind in ("Marking", "Section", "Intersection", "ClearanceSpace", "Hole"):
        return ""
    return f"{_SIG3D}/{module}/2.0/{_CLASSES.get(kind, kind)}_{name}.xml"
