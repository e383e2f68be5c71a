"""References of geometry by xlink, put in place of what they refer to."""

from collections.abc import Mapping
from copy import deepcopy

from lxml import etree

from envgen_usd.citygml.geometry_read import local_name

_IDS = ("{http://www.opengis.net/gml/3.2}id", "{http://www.opengis.net/gml}id")
_HREF = "{http://www.w3.org/1999/xlink}href"
_MOST_COPIES = 100_000
_DEEPEST = 16
_POLYGONS = ("Polygon", "Triangle", "Rectangle")
_RINGS = ("exterior", "interior", "outerBoundaryIs", "innerBoundaryIs")
_ROLES = frozenset(
    {
        *("surfaceMember", "surfaceMembers", "solidMember", "baseSurface", "curveMember"),
        *(
            "exterior",
            "interior",
            "relativeGMLGeometry",
            "relativeGeometry",
            "trianglePatches",
            "patches",
        ),
    }
)


def name_of(element: etree._Element) -> str:
    """Id of an element, of GML 3.1 or 3.2, or empty."""
    return element.get(_IDS[0]) or element.get(_IDS[1]) or ""


def references(feature: etree._Element) -> set[str]:
    """Ids of geometry that a feature refers to and does not hold."""
    held = {name_of(element) for element in feature.iter(etree.Element)}
    wanted = {
        element.get(_HREF, "").removeprefix("#")
        for element in feature.iter(etree.Element)
        if element.get(_HREF) and (_is_role(element))
    }
    return wanted - held


def _is_role(element: etree._Element) -> bool:
    name = local_name(element)
    return name in _ROLES or name.startswith("lod")


def inline(feature: etree._Element, others: Mapping[str, etree._Element]) -> None:
    """Makes geometry of a feature stand where it is used, in place.

    References are replaced by copies, surfaces that are used backwards are turned, and a solid
    that holds just the polygons of the boundary surfaces of its level of detail is emptied: the
    surfaces are its shell.

    Args:
        feature: Top-level feature, in the words of CityGML 3.0.
        others: Elements that references from one feature into another lead to, by their id.

    Raises:
        ValueError: References lead to references in such a way that there is no end of copies.
    """
    known = {name_of(e): e for e in feature.iter(etree.Element) if name_of(e)}
    _empty_solids(feature, {**others, **known})
    found = {**others, **{name: deepcopy(known[name]) for name in _wanted(feature) & set(known)}}
    budget = [_MOST_COPIES]
    for element in list(feature.iter(etree.Element)):
        if element.get(_HREF) and _is_role(element) and not len(element):
            _fill(element, found, budget)
    for surface in list(feature.iter("{*}OrientableSurface")):
        if surface.get("orientation") == "-":
            _turn(surface)


def _wanted(feature: etree._Element) -> set[str]:
    return {
        element.get(_HREF, "").removeprefix("#")
        for element in feature.iter(etree.Element)
        if element.get(_HREF) and _is_role(element)
    }


def _fill(
    element: etree._Element,
    found: Mapping[str, etree._Element],
    budget: list[int],
    depth: int = 0,
) -> None:
    """Puts a copy of what an element refers to into it, and so on; the budget counts down."""
    target = found.get(element.get(_HREF, "").removeprefix("#"))
    if target is None:
        return
    element.append(deepcopy(target))
    budget[0] -= 1
    if budget[0] < 0 or depth > _DEEPEST:
        raise ValueError("references of geometry multiply, or lead back to themselves")
    for inner in list(element.iter(etree.Element)):
        if inner is not element and inner.get(_HREF) and _is_role(inner) and not len(inner):
            _fill(inner, found, budget, depth + 1)


def _empty_solids(feature: etree._Element, known: Mapping[str, etree._Element]) -> None:
    """Leaves of each solid that its boundary surfaces make up no polygon."""
    for solid in list(feature.iter(*(f"{{*}}lod{level}Solid" for level in (1, 2, 3)))):
        space = solid.getparent()
        if space is None:
            continue
        level = local_name(solid)[:4]
        shell = _polygons(solid, known)
        bounds = {
            polygon
            for boundary in space
            if local_name(boundary) == "boundary"
            for surfaces in boundary.iter(f"{{*}}{level}MultiSurface")
            for polygon in _polygons(surfaces, known)
        }
        if shell and shell == bounds:
            _keep_for_surfaces(space, solid, known)
            for child in list(solid):
                solid.remove(child)
            etree.SubElement(solid, "Solid")


def _keep_for_surfaces(
    space: etree._Element, solid: etree._Element, known: Mapping[str, etree._Element]
) -> None:
    """Moves what boundary surfaces refer to out of a solid that is about to be emptied."""
    inside = set(solid.iter(etree.Element))
    for boundary in space:
        if local_name(boundary) != "boundary":
            continue
        for element in list(boundary.iter(etree.Element)):
            target = known.get(element.get(_HREF, "").removeprefix("#"))
            if target is not None and target in inside and _is_role(element):
                element.append(deepcopy(target))


def _polygons(element: etree._Element, known: Mapping[str, etree._Element]) -> set[etree._Element]:
    """Polygons below an element or referred to from there."""
    found, seen, waiting = set(), {element}, [element]
    while waiting:
        above = waiting.pop()
        if local_name(above) in _POLYGONS:
            found.add(above)
            continue
        target = known.get(above.get(_HREF, "").removeprefix("#"))
        below = [*above.iterchildren(etree.Element), *([target] if target is not None else [])]
        waiting += [each for each in below if each not in seen]
        seen.update(below)
    return found


def _turn(surface: etree._Element) -> None:
    """Turns the rings of all polygons of a surface."""
    for polygon in surface.iter(*(f"{{*}}{name}" for name in _POLYGONS)):
        for ring in polygon:
            if local_name(ring) in _RINGS:
                _turn_ring(ring)


def _turn_ring(ring: etree._Element) -> None:
    lists = list(ring.iter("{*}posList", "{*}coordinates"))
    for positions in lists:
        numbers = (positions.text or "").replace(",", " ").split()
        points = [" ".join(numbers[k : k + 3]) for k in range(0, len(numbers), 3)]
        positions.text = " ".join(reversed(points))
    single = list(ring.iter("{*}pos"))
    for position, text in zip(single, [p.text for p in reversed(single)], strict=True):
        position.text = text
