"""Resolves xlink references of geometry by copies of their targets."""

from collections.abc import Mapping
from copy import deepcopy

from lxml import etree

from envgen_usd.xml_events import local_name

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
    """Id of an element in GML 3.1 or 3.2, or an empty string."""
    return element.get(_IDS[0]) or element.get(_IDS[1]) or ""


def references(feature: etree._Element) -> set[str]:
    """Ids of geometry that a feature references outside itself."""
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
    """Copies referenced geometry of a feature to its place of use, in place.

    References are replaced by copies, and reversed surfaces are turned. A solid that only holds the
    polygons of the boundary surfaces of its level of detail is emptied: the surfaces are its shell.

    Args:
        feature: Top-level feature, upgraded to CityGML 3.0.
        others: Targets of references between features, by id.

    Raises:
        ValueError: The references are cyclic, or their copies exceed the limit.
    """
    known = {name_of(e): e for e in feature.iter(etree.Element) if name_of(e)}
    _empty_solids(feature, {**others, **known})
    targets = {**others, **{name: deepcopy(known[name]) for name in _wanted(feature) & set(known)}}
    budget = [_MOST_COPIES]
    for element in list(feature.iter(etree.Element)):
        if element.get(_HREF) and _is_role(element) and not len(element):
            _fill(element, targets, budget)
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
    targets: Mapping[str, etree._Element],
    budget: list[int],
    depth: int = 0,
) -> None:
    """Copies the target of a reference into an element, recursively, within a budget."""
    target = targets.get(element.get(_HREF, "").removeprefix("#"))
    if target is None:
        return
    element.append(deepcopy(target))
    budget[0] -= 1
    if budget[0] < 0 or depth > _DEEPEST:
        raise ValueError("geometry references are cyclic or multiply without end")
    for inner in list(element.iter(etree.Element)):
        if inner is not element and inner.get(_HREF) and _is_role(inner) and not len(inner):
            _fill(inner, targets, budget, depth + 1)


def _empty_solids(feature: etree._Element, known: Mapping[str, etree._Element]) -> None:
    """Removes from each solid the polygons that boundary surfaces already provide."""
    for solid in list(feature.iter(*(f"{{*}}lod{level}Solid" for level in (1, 2, 3)))):
        space = solid.getparent()
        if space is None:
            continue
        level = local_name(solid)[:4]
        # The surfaces of a feature form a single shell.
        if sum(_shell_count(part) for part in solid.iter("{*}Solid")) > 1:
            continue
        shell = polygons_below(solid, known)
        bounds = {
            polygon
            for boundary in space
            if local_name(boundary) == "boundary"
            for surfaces in boundary.iter(f"{{*}}{level}MultiSurface")
            for polygon in polygons_below(surfaces, known)
        }
        if shell and shell == bounds:
            _keep_for_surfaces(space, solid, known)
            for child in list(solid):
                solid.remove(child)
            etree.SubElement(solid, "Solid")


def _shell_count(solid: etree._Element) -> int:
    return sum(local_name(child) in ("exterior", "interior") for child in solid)


def _keep_for_surfaces(
    space: etree._Element, solid: etree._Element, known: Mapping[str, etree._Element]
) -> None:
    """Moves polygons that boundary surfaces reference out of a solid before it is emptied."""
    inside = set(solid.iter(etree.Element))
    for boundary in space:
        if local_name(boundary) != "boundary":
            continue
        for element in list(boundary.iter(etree.Element)):
            target = known.get(element.get(_HREF, "").removeprefix("#"))
            if target is not None and target in inside and _is_role(element):
                element.append(deepcopy(target))


def polygons_below(
    element: etree._Element, known: Mapping[str, etree._Element]
) -> set[etree._Element]:
    """Returns the polygons below an element, contained or referenced.

    Args:
        element: Geometry, or a feature around it.
        known: Targets of references, by id.
    """
    polygons, seen, waiting = set(), {element}, [element]
    while waiting:
        above = waiting.pop()
        if local_name(above) in _POLYGONS:
            polygons.add(above)
            continue
        target = known.get(above.get(_HREF, "").removeprefix("#"))
        below = [*above.iterchildren(etree.Element), *([target] if target is not None else [])]
        waiting += [each for each in below if each not in seen]
        seen.update(below)
    return polygons


def _turn(surface: etree._Element) -> None:
    """Reverses the rings of all polygons of a surface."""
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
