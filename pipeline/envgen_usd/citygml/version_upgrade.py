"""Upgrades features of CityGML 1.0 and 2.0 to 3.0."""

from collections.abc import Callable

from lxml import etree

from envgen_usd.xml_events import local_name, namespace_of

_GML_ID = "{http://www.opengis.net/gml/3.2}id"
_OLD_ID = "{http://www.opengis.net/gml}id"
_GML = "{http://www.opengis.net/gml"
_NAMES = {
    "boundedBy": "boundary",
    "opening": "fillingSurface",
    "Window": "WindowSurface",
    "Door": "DoorSurface",
    "consistsOfBuildingPart": "buildingPart",
    "consistsOfBridgePart": "bridgePart",
    "consistsOfTunnelPart": "tunnelPart",
    "outerBuildingInstallation": "buildingInstallation",
    "interiorBuildingInstallation": "buildingInstallation",
    "roomInstallation": "buildingInstallation",
    "IntBuildingInstallation": "BuildingInstallation",
    "interiorRoom": "buildingRoom",
    "Room": "BuildingRoom",
    "interiorFurniture": "buildingFurniture",
    "outerBridgeConstruction": "bridgeConstructiveElement",
    "BridgeConstructionElement": "BridgeConstructiveElement",
    "outerBridgeInstallation": "bridgeInstallation",
    "outerTunnelInstallation": "tunnelInstallation",
    "GenericCityObject": "GenericOccupiedSpace",
    "WaterClosureSurface": "ClosureSurface",
    "yearOfConstruction": "dateOfConstruction",
    "yearOfDemolition": "dateOfDemolition",
    "lod0FootPrint": "lod0MultiSurface",
    "lod0RoofEdge": "lod0RoofEdge",
    "lod0Network": "lod0MultiCurve",
}
_GENERICS = {
    "stringAttribute": "StringAttribute",
    "intAttribute": "IntAttribute",
    "doubleAttribute": "DoubleAttribute",
    "measureAttribute": "MeasureAttribute",
    "dateAttribute": "DateAttribute",
    "uriAttribute": "UriAttribute",
    "genericAttributeSet": "GenericAttributeSet",
}
_TRAFFIC = {
    "trafficArea": ("trafficSpace", "TrafficSpace"),
    "auxiliaryTrafficArea": ("auxiliaryTrafficSpace", "AuxiliaryTrafficSpace"),
}
_SHAPES = {
    "Solid": "Solid",
    "CompositeSolid": "Solid",
    "MultiSolid": "Solid",
    "MultiCurve": "MultiCurve",
    "CompositeCurve": "MultiCurve",
    "LineString": "MultiCurve",
}


def upgrade(feature: etree._Element) -> list[str]:
    """Upgrades a feature of CityGML 1.0 or 2.0 to 3.0, in place.

    Classes and properties are renamed. Traffic areas get a traffic space. Generic attributes and
    the measured height get the structure of 3.0. LoD4 becomes LoD3, in place of a LoD3 geometry of
    the same property.

    Args:
        feature: Top-level feature.

    Returns:
        A message for each property that gave way to a finer one, or to the footprint.
    """
    for element in list(feature.iter(etree.Element)):
        if old := element.get(_OLD_ID):
            element.set(_GML_ID, old)
        if not element.tag.startswith(_GML):
            name = local_name(element)
            _STEPS.get(name, _rename)(element, name)
    removed: list[str] = []
    for element in list(feature.iter(etree.Element)):
        if local_name(element).startswith("lod") and element.getparent() is not None:
            removed += _level(element)
    return removed


def _rename(element: etree._Element, name: str) -> None:
    _set_name(element, _NAMES.get(name, name))


def _set_name(element: etree._Element, name: str) -> None:
    namespace = namespace_of(element)
    element.tag = f"{{{namespace}}}{name}" if namespace else name


def _height(element: etree._Element, _: str) -> None:
    text, element.text = element.text, None
    _set_name(element, "height")
    value = etree.SubElement(element, "value")
    value.text = text


def _generic(element: etree._Element, name: str) -> None:
    inner = etree.Element(_GENERICS[name])
    title = etree.SubElement(inner, "name")
    title.text = element.get("name", "")
    inner.extend(list(element))
    _set_name(element, "genericAttribute")
    element.append(inner)


def _traffic(element: etree._Element, name: str) -> None:
    """Inserts a traffic space between a road and its traffic area."""
    role, kind = _TRAFFIC[name]
    areas = list(element)
    _set_name(element, role)
    for area in areas:
        space = etree.SubElement(element, kind)
        space.set(_GML_ID, f"{area.get(_OLD_ID) or area.get(_GML_ID) or 'area'}_space")
        etree.SubElement(space, "boundary").append(area)


def _level(element: etree._Element) -> list[str]:
    """Renames a geometry property after its content; returns what gave way."""
    before = local_name(element)
    name = before
    if name.endswith("Geometry"):
        held = next((local_name(child) for child in element), "")
        name = f"{name[:4]}{_SHAPES.get(held, 'MultiSurface')}"
    if name[4:] == "Surface":
        name = f"{name[:4]}MultiSurface"
    if name[4:] == "TerrainIntersection":
        name = f"{name}Curve"
    if name.startswith("lod4"):
        name = f"lod3{name[4:]}"
    if name == "lod0RoofEdge":
        name = "lod0MultiSurface"
    twin = _twin(element, name) if name != before else None
    if twin is None:
        _set_name(element, name)
        return []
    # The finer of two levels stays, and the footprint instead of the roof edge.
    if before.startswith("lod4"):
        _remove(twin)
        _set_name(element, name)
        return [f"{local_name(twin)} gives way to {before}"]
    _remove(element)
    return [f"{before} gives way to {name}"]


def _twin(element: etree._Element, name: str) -> etree._Element | None:
    """Another property of the same feature with a name."""
    parent = element.getparent()
    others = parent if parent is not None else ()
    return next((each for each in others if each is not element and local_name(each) == name), None)


def _remove(element: etree._Element) -> None:
    parent = element.getparent()
    if parent is not None:
        parent.remove(element)


_STEPS: dict[str, Callable[[etree._Element, str], None]] = {
    "measuredHeight": _height,
    **dict.fromkeys(_GENERICS, _generic),
    **dict.fromkeys(_TRAFFIC, _traffic),
}
