"""Polygons and solids of a city model, unrepaired, with their places in the file."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from envgen_usd.errors import Issue
from envgen_usd.geometry.iso19107.fault_codes import fault_issue
from envgen_usd.geometry.iso19107.fault_search import Bodies
from envgen_usd.models.polygon_arrays import Polygons

SURFACE = -1
"""Solid of a shell that is a composite surface."""
_INSIDE = frozenset(
    (
        *("BuildingRoom", "Room", "BuildingFurniture", "IntBuildingInstallation"),
        *("Storey", "BuildingStorey", "BuildingUnit"),
    )
)
"""Classes with solids inside those of their building, but without common volume among them."""


@dataclass(frozen=True)
class Place:
    """Place of a geometry in a file: its feature, its name, and its line."""

    feature: str
    geometry: str = ""
    line: int = 0

    @property
    def name(self) -> str:
        """The feature and the geometry."""
        return f"{self.feature}/{self.geometry}" if self.geometry else self.feature

    def fault(self, code: int, detail: str = "") -> Issue:
        """Returns a fault at this place."""
        return fault_issue(code, self.name, detail, self.line)


@dataclass(frozen=True)
class Membership:
    """What a solid is part of.

    Attributes:
        building: Id of the building; empty for a solid of another feature.
        role: Solids of a building with the same role have no common volume.
        composite: Number of the composite solid; -1 for a solid by itself.
    """

    building: str = ""
    role: str = ""
    composite: int = -1


def role_of(level: str, kinds: Sequence[str]) -> str:
    """Returns the role of a solid in its building.

    Args:
        level: Level of detail, or the name of a property that contains it.
        kinds: Classes of the features around the solid, the nearest first.
    """
    inside = next((kind for kind in kinds if kind in _INSIDE), "")
    level = re.sub(r"^lod([\d.]+)\D.*$", r"\1", level)
    return f"{inside} {level}".strip()


@dataclass
class BodyCollection:
    """Collects the bodies of many features.

    Attributes:
        polygons: Place of each polygon.
        shells: Place of the solid or composite surface of each shell.
        solids: Membership of each solid.
        issues: Faults of the file itself.
    """

    polygons: list[Place] = field(default_factory=list)
    shells: list[Place] = field(default_factory=list)
    solids: list[Membership] = field(default_factory=list)
    issues: list[Issue] = field(default_factory=list)
    _numbers: list[float] = field(default_factory=list)
    _rings: list[int] = field(default_factory=lambda: [0])
    _polygon_ends: list[int] = field(default_factory=lambda: [0])
    _shell: list[int] = field(default_factory=list)
    _solid: list[int] = field(default_factory=list)

    def add_solid(self, membership: Membership) -> int:
        """Adds a solid without shells; returns its number."""
        self.solids.append(membership)
        return len(self.solids) - 1

    def add_shell(self, place: Place, solid: int = SURFACE) -> int:
        """Adds a shell without polygons; returns its number."""
        self.shells.append(place)
        self._solid.append(solid)
        return len(self.shells) - 1

    def add_polygon(self, place: Place, rings: Sequence[Sequence[float]], shell: int = -1) -> None:
        """Adds a polygon.

        Args:
            place: Where it is in the file.
            rings: Coordinates of each ring, three for each point, exterior first.
            shell: Its shell; -1 for a polygon by itself.
        """
        for ring in rings:
            self._numbers += ring
            self._rings.append(len(self._numbers) // 3)
        self._polygon_ends.append(len(self._rings) - 1)
        self._shell.append(shell)
        self.polygons.append(place)

    def add_polygons(self, place: Place, polygons: Polygons, shell: int = -1) -> None:
        """Adds polygons at a single place, see `add_polygon`."""
        points, rings = len(self._numbers) // 3, len(self._rings) - 1
        self._numbers += polygons.points.ravel().tolist()
        self._rings += (polygons.ring_offsets[1:] + points).tolist()
        self._polygon_ends += (polygons.polygon_offsets[1:] + rings).tolist()
        self._shell += [shell] * len(polygons)
        self.polygons += [place] * len(polygons)

    def bodies(self) -> Bodies:
        """All collected bodies."""
        polygons = Polygons(
            np.array(self._numbers, dtype=np.float64).reshape(-1, 3),
            np.array(self._rings, dtype=np.int64),
            np.array(self._polygon_ends, dtype=np.int64),
        )
        shell = np.array(self._shell, dtype=np.int64)
        return Bodies(polygons, shell, np.array(self._solid, dtype=np.int64))
