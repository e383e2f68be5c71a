"""Normalises the coordinates of foreign CityGML files for the reader."""

from lxml import etree

from envgen_usd.xml_events import local_name

_RINGS = ("exterior", "interior", "outerBoundaryIs", "innerBoundaryIs")
_POLYGONS = ("Polygon", "Triangle", "Rectangle")


def tidy(feature: etree._Element) -> None:
    """Normalises all coordinates of a feature in place.

    Two-dimensional points get a height of zero, and ``gml:coordinates`` (with commas) become
    ``gml:posList``. Rings are closed. Polygons whose exterior has fewer than three points are
    removed.

    Args:
        feature: Top-level feature.
    """
    for element in list(feature.iter("{*}posList", "{*}pos", "{*}coordinates")):
        _tidy_list(element)
    for polygon in list(feature.iter(*(f"{{*}}{name}" for name in _POLYGONS))):
        for boundary in [child for child in polygon if local_name(child) in _RINGS]:
            if not _close(boundary):
                polygon.remove(boundary)
        parent = polygon.getparent()
        exteriors = ("{*}exterior", "{*}outerBoundaryIs")
        if parent is not None and all(polygon.find(name) is None for name in exteriors):
            parent.remove(polygon)


def _tidy_list(element: etree._Element) -> None:
    text = element.text or ""
    if local_name(element) == "coordinates":
        element.tag = element.tag.replace("coordinates", "posList")
        text = text.replace(",", " ")
        element.text = text
    dimension = element.get("srsDimension") or ("3" if len(text.split()) % 3 == 0 else "2")
    if dimension == "2":
        numbers = text.split()
        pairs = zip(numbers[::2], numbers[1::2], strict=False)
        element.text = " ".join(f"{x} {y} 0" for x, y in pairs)


def _close(boundary: etree._Element) -> bool:
    """Closes a ring; returns true if it has three points and all numbers are finite."""
    lists = list(boundary.iter("{*}posList", "{*}pos"))
    numbers = [number for item in lists for number in (item.text or "").split()]
    if len(numbers) % 3 or not all(map(_is_finite, numbers)):
        return False
    if numbers[:3] != numbers[-3:]:
        numbers += numbers[:3]
        lists[-1].text = f"{lists[-1].text} {' '.join(numbers[:3])}"
    return len(numbers) >= 12


def _is_finite(number: str) -> bool:
    try:
        return abs(float(number)) < float("inf")
    except ValueError:
        return False
