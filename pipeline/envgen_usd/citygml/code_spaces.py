"""Code spaces: the code list of each coded property."""

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
    """Returns the URI of a property's code list; empty for properties without a list.

    The lists for CityGML 2.0 come from the Special Interest Group 3D. No lists were published for
    3.0, so its classes use those of 2.0.

    Args:
        prefix: Namespace prefix of the class, e.g. ``bldg``.
        kind: CityGML class.
        name: Property, e.g. ``roofType``.
    """
    module = _MODULES.get(prefix)
    if module is None or kind in ("Marking", "Section", "Intersection", "ClearanceSpace", "Hole"):
        return ""
    return f"{_SIG3D}/{module}/2.0/{_CLASSES.get(kind, kind)}_{name}.xml"
