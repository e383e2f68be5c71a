"""Reports faults as issues, for single faults and for a whole city."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from envgen_usd.errors import Issue, Severity
from envgen_usd.geometry.flat_arrays import join, take
from envgen_usd.geometry.iso19107.body_faults import overlaps
from envgen_usd.geometry.iso19107.fault_codes import NAMES
from envgen_usd.geometry.iso19107.fault_search import Bodies, find_faults
from envgen_usd.models.city_model import City, CityObject, ThematicSurface
from envgen_usd.models.polygon_arrays import Polygons

INSIDE = frozenset(
    ("BuildingRoom", "Room", "BuildingFurniture", "IntBuildingInstallation", "Storey")
)
"""Classes with solids inside those of their building, but without common volume among them."""


def fault_issue(code: int, where: str, detail: str = "", line: int = 0) -> Issue:
    """Converts a fault to an issue of the kind ``iso19107.<code>``.

    Args:
        code: A key of `fault_codes.NAMES`.
        where: The faulty object.
        detail: Figures as text.
        line: Line in the file; 0 without a line.
    """
    message = f"{NAMES[code]}: {detail}" if detail else NAMES[code]
    return Issue(f"iso19107.{code}", Severity.ERROR, where, message, line=line)


def first_issues(issues: Iterable[Issue]) -> list[Issue]:
    """Returns the first issue of each object and kind, with the number of its issues."""
    groups: dict[tuple[str, str], list[Issue]] = {}
    for issue in issues:
        groups.setdefault((issue.where, issue.kind), []).append(issue)
    return [
        replace(first, message=f"{first.message} (the first of {1 + len(rest)})") if rest else first
        for first, *rest in groups.values()
    ]


@dataclass
class _Parts:
    """Polygons of a city with their owners."""

    polygons: list[Polygons] = field(default_factory=list)
    wheres: list[str] = field(default_factory=list)
    shells: list[int] = field(default_factory=list)
    solids: list[str] = field(default_factory=list)
    groups: dict[tuple[str, str], list[int]] = field(default_factory=dict)

    def add(self, polygons: Polygons, where: str, shell: int) -> None:
        """Adds polygons of a shell; -1 for polygons without a shell."""
        self.polygons.append(polygons)
        self.wheres += [where] * len(polygons)
        self.shells += [shell] * len(polygons)


def city_issues(city: City) -> tuple[Issue, ...]:
    """Returns the faults of a city's geometry after ISO 19107.

    Each object and code has a single issue. The surfaces of a closed space at its `solid_lod` form
    a shell. The geometry of a property with the suffix ``Solid`` forms a shell, too. Solids of a
    building may not overlap.

    Args:
        city: City model with coordinates in metres.
    """
    parts = _Parts()
    for top in city.objects:
        for feature in top.walk():
            _gather(feature, top.id if top.kind == "Building" else "", parts)
    shell = np.array(parts.shells, dtype=np.int64)
    bodies = Bodies(join(parts.polygons), shell, np.arange(len(parts.solids)))
    faults = find_faults(bodies)
    issues = [
        fault_issue(
            fault.code,
            parts.wheres[fault.polygon] if fault.code < 300 else parts.solids[fault.shell],
            fault.detail,
        )
        for fault in faults
    ]
    broken = {fault.shell for fault in faults}
    groups = [[n for n in group if n not in broken] for group in parts.groups.values()]
    several = [group for group in groups if len(group) > 1]
    solids = {n: take(bodies.polygons, np.flatnonzero(shell == n)) for g in several for n in g}
    shared = [
        fault_issue(601, parts.solids[other], f"{volume:.3f} m³ with {parts.solids[one]}")
        for one, other, volume in overlaps(solids, several)
    ]
    return tuple(first_issues([*issues, *shared]))


def _gather(feature: CityObject, building: str, parts: _Parts) -> None:
    name = f"{feature.kind}[{feature.id}]"
    inside = f"{feature.kind} " if feature.kind in INSIDE else ""
    surfaces = list(_surfaces(feature.surfaces))
    closed = [s for s in surfaces if s.lod == feature.solid_lod and len(s.polygons)]
    shell = _shell(name, building, f"{inside}lod{feature.solid_lod}Solid", parts) if closed else -1
    for surface in surfaces:
        where = f"{surface.kind}[{surface.id}]"
        parts.add(surface.polygons, where, shell if surface.lod == feature.solid_lod else -1)
    for role, polygons in feature.geometry.items():
        is_solid = role.endswith("Solid") and len(polygons) > 0
        parts.add(polygons, name, _shell(name, building, inside + role, parts) if is_solid else -1)


def _surfaces(surfaces: Iterable[ThematicSurface]) -> Iterator[ThematicSurface]:
    for surface in surfaces:
        yield surface
        yield from _surfaces(surface.openings)


def _shell(name: str, building: str, role: str, parts: _Parts) -> int:
    parts.solids.append(name)
    number = len(parts.solids) - 1
    if building:
        parts.groups.setdefault((building, role), []).append(number)
    return number
