"""Reports faults as issues, for collected bodies and for a whole city."""

from collections import defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from envgen_usd.errors import Issue
from envgen_usd.geometry.flat_arrays import split_solids, take
from envgen_usd.geometry.iso19107.body_collection import (
    BodyCollection,
    Membership,
    Place,
    role_of,
)
from envgen_usd.geometry.iso19107.body_faults import composite_faults, overlaps
from envgen_usd.geometry.iso19107.fault_codes import Fault, fault_issue
from envgen_usd.geometry.iso19107.fault_search import Bodies, find_faults
from envgen_usd.models.city_model import City, CityObject, ThematicSurface
from envgen_usd.models.polygon_arrays import Polygons, Solids


def first_issues(issues: Iterable[Issue]) -> list[Issue]:
    """Returns the first issue of each object and kind, with the number of its issues."""
    groups: dict[tuple[str, str], list[Issue]] = {}
    for issue in issues:
        groups.setdefault((issue.where, issue.kind), []).append(issue)
    return [
        replace(first, message=f"{first.message} (the first of {1 + len(rest)})") if rest else first
        for first, *rest in groups.values()
    ]


def body_issues(collection: BodyCollection, bodies: Bodies) -> list[Issue]:
    """Returns the faults of collected bodies, a single issue for each object and code.

    Solids of a composite solid touch each other and have no common volume. Solids of a building
    with the same role have no common volume, either.

    Args:
        collection: The bodies with their places.
        bodies: The same bodies in metres.
    """
    faults = find_faults(bodies)
    broken = {int(bodies.solid[fault.shell]) for fault in faults if fault.shell >= 0}
    sizes = np.bincount(bodies.shell[bodies.shell >= 0], minlength=len(bodies.solid))
    broken |= set(bodies.solid[sizes == 0].tolist())  # which the collection tells
    issues = [_issue(collection, fault) for fault in faults]
    return [*collection.issues, *first_issues([*issues, *_common(collection, bodies, broken)])]


def _issue(collection: BodyCollection, fault: Fault) -> Issue:
    polygon = collection.polygons[fault.polygon] if fault.polygon >= 0 else None
    if polygon is not None and (fault.code < 300 or fault.shell < 0):
        return fault_issue(fault.code, polygon.feature, fault.detail, polygon.line)
    name = f", e.g. {polygon.geometry}" if polygon and polygon.geometry else ""
    return collection.shells[fault.shell].fault(fault.code, fault.detail + name)


def _common(collection: BodyCollection, bodies: Bodies, broken: set[int]) -> Iterator[Issue]:
    """Faults 501 to 503 of composite solids, and 601 of the solids of a building."""
    composites, buildings = _groups(collection.solids, bodies, broken)
    wanted = {n for group in (*composites, *buildings) for n in group}
    shells = {n: np.flatnonzero(bodies.solid == n).tolist() for n in sorted(wanted)}
    solids = _shells_of(bodies, shells)
    for group in composites:
        for code, solid, detail in composite_faults([solids[n] for n in group]):
            yield collection.shells[shells[group[solid]][0]].fault(code, detail)
    for first, second, figures in overlaps(solids, buildings):
        first_shell, second_shell = (collection.shells[shells[n][0]] for n in (first, second))
        composite = collection.solids[first].composite
        if composite < 0 or composite != collection.solids[second].composite:
            yield second_shell.fault(601, f"{figures}, with {first_shell.name}")


def _groups(
    members: list[Membership], bodies: Bodies, broken: set[int]
) -> tuple[list[list[int]], list[list[int]]]:
    """Groups of several valid solids: by composite solid, and by building and role."""
    composites: dict[int, list[int]] = defaultdict(list)
    buildings: dict[tuple[str, str], list[int]] = defaultdict(list)
    for solid in np.unique(bodies.solid[bodies.solid >= 0]).tolist():
        member = members[solid]
        if solid not in broken and member.composite >= 0:
            composites[member.composite].append(solid)
        if solid not in broken and member.building:
            buildings[member.building, member.role].append(solid)
    several = (
        [group for group in groups if len(group) > 1]
        for groups in (composites.values(), buildings.values())
    )
    by_composite, by_building = several
    return by_composite, by_building


def _shells_of(bodies: Bodies, shells: dict[int, list[int]]) -> dict[int, list[Polygons]]:
    """Polygons of the shells of each solid."""
    order = np.argsort(bodies.shell, kind="stable")
    limits = np.searchsorted(bodies.shell[order], np.arange(len(bodies.solid) + 1))
    return {
        n: [take(bodies.polygons, order[limits[shell] : limits[shell + 1]]) for shell in own]
        for n, own in shells.items()
    }


def city_issues(city: City) -> tuple[Issue, ...]:
    """Returns the faults of a city's geometry after ISO 19107.

    Each object and code has a single issue. The surfaces of a closed space at its `solid_lod` form
    a shell. The geometry of a property with the suffix ``Solid`` forms one or several solids.

    Args:
        city: City model with coordinates in metres.
    """
    collection = BodyCollection()
    for top in city.objects:
        building = top.id if top.kind == "Building" else ""
        for feature in top.walk():
            _gather(feature, building, collection)
    return tuple(body_issues(collection, collection.bodies()))


def _gather(feature: CityObject, building: str, collection: BodyCollection) -> None:
    place = Place(f"{feature.kind}[{feature.id}]")
    surfaces = list(_surfaces(feature.surfaces))
    closed = [s for s in surfaces if s.lod == feature.solid_lod and len(s.polygons)]
    solid = Membership(building, role_of(str(feature.solid_lod), [feature.kind]))
    shell = collection.add_shell(place, collection.add_solid(solid)) if closed else -1
    for surface in surfaces:
        where = Place(f"{surface.kind}[{surface.id}]")
        shell_number = shell if surface.lod == feature.solid_lod else -1
        collection.add_polygons(where, surface.polygons, shell_number)
    for role, polygons in feature.geometry.items():
        if role.endswith("Solid") and len(polygons) > 0:
            member = Membership(building, role_of(role, [feature.kind]))
            _gather_solids(polygons, place, member, collection)
        else:
            collection.add_polygons(place, polygons)


def _gather_solids(
    polygons: Polygons, place: Place, member: Membership, collection: BodyCollection
) -> None:
    """Adds the shells of one or several solids."""
    composite = isinstance(polygons, Solids) and polygons.composite
    member = replace(member, composite=len(collection.solids) if composite else -1)
    for solid in split_solids(polygons):
        number = collection.add_solid(member)
        shells = solid.shell if isinstance(solid, Solids) else np.zeros(len(solid), dtype=np.int64)
        for shell in np.unique(shells):
            shell_number = collection.add_shell(place, number)
            collection.add_polygons(
                place, take(solid, np.flatnonzero(shells == shell)), shell_number
            )


def _surfaces(surfaces: Iterable[ThematicSurface]) -> Iterator[ThematicSurface]:
    for surface in surfaces:
        yield surface
        yield from _surfaces(surface.openings)
