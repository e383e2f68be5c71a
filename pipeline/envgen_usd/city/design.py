"""Draws what one building looks like from the environment's ranges."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from envgen_usd.models.profile import BuildingRules, OpeningRules, Range


@dataclass(frozen=True)
class OpeningDesign:
    """Windows or doors of one building: width, height, sill and spacing in metres."""

    width: float
    height: float
    sill: float
    spacing: float


@dataclass(frozen=True)
class Design:
    """One building; lengths in metres.

    Attributes:
        style: ``row``, ``detached`` or ``hall``.
        function: ``residential`` or ``industrial``.
        width: Along the street.
        depth: Away from the street.
        storeys: Above ground.
        storey_height: From floor to floor.
        roof: ``flat``, ``shed``, ``gabled``, ``hipped`` or ``pyramidal``.
        slope: Tangent of the roof's pitch.
        overhang: Beyond the walls.
        parapet: Height above a flat roof.
        ridge_to_street: True where the ridge runs away from the street.
        chimney: (place along x, place along y as shares of the slope; width; height), or none.
        plinth: Height of the floor above the ground.
        wall_material: Name in the material library.
        roof_material: Name in the material library.
        windows: Windows.
        doors: Doors, or gates of a hall.
    """

    style: str
    function: str
    width: float
    depth: float
    storeys: int
    storey_height: float
    roof: str
    slope: float
    overhang: float
    parapet: float
    ridge_to_street: bool
    chimney: tuple[float, float, float, float] | None
    plinth: float
    wall_material: str
    roof_material: str
    windows: OpeningDesign
    doors: OpeningDesign

    @property
    def eaves(self) -> float:
        """Height of the walls above the floor."""
        return self.storeys * self.storey_height


class _Draws:
    """Uniform numbers, drawn at once because a generator is slow for single ones."""

    def __init__(self, generator: np.random.Generator) -> None:
        self._numbers = iter(generator.random(40).tolist())

    def share(self) -> float:
        """A number in [0, 1)."""
        return float(next(self._numbers))

    def within(self, limits: Range) -> float:
        """A number in a range."""
        return limits[0] + (limits[1] - limits[0]) * self.share()

    def whole(self, limits: Range) -> int:
        """A whole number in a range, both ends included."""
        low, high = round(limits[0]), round(limits[1])
        return low + int(self.share() * (high - low + 1))

    def choice(self, weights: Mapping[str, float]) -> str:
        """A key, by weight."""
        mark = self.share() * sum(weights.values())
        for name, weight in weights.items():
            mark -= weight
            if mark < 0.0:
                return name
        return list(weights)[-1]


def draw_design(
    rules: BuildingRules, space: tuple[float, float], generator: np.random.Generator
) -> Design:
    """Draws a building that fits into a space.

    Args:
        rules: The environment's ranges and weights.
        space: Width along the street and depth that are free, metres.
        generator: Of this building alone.
    """
    draws = _Draws(generator)
    row = rules.style == "row"
    width, depth = draws.within(rules.width), draws.within(rules.depth)
    width, depth = (space[0] if row else min(width, space[0])), min(depth, space[1])
    storeys = draws.whole(rules.storeys)
    storey_height = draws.within(rules.storey_height)
    roof, pitch = draws.choice(rules.roofs), draws.within(rules.roof_pitch)
    overhang, shape = draws.within(rules.overhang), draws.share()
    chimney = (draws.share(), draws.share(), draws.within((0.5, 0.9)), draws.within((0.6, 1.1)))
    has_chimney = draws.share() < rules.chimney
    wall, pitched, level = (
        draws.choice(rules.materials),
        draws.choice(rules.roof_materials),
        draws.choice(rules.flat_roof_materials),
    )
    return Design(
        style=rules.style,
        function=rules.function,
        width=width,
        depth=depth,
        storeys=storeys,
        storey_height=storey_height,
        roof=roof,
        slope=float(np.tan(np.radians(pitch))),
        overhang=0.0 if roof == "flat" and shape < 0.7 else overhang,
        parapet=draws.within((0.35, 0.9)) if roof == "flat" else 0.0,
        ridge_to_street=not row and width < depth,
        chimney=chimney if has_chimney else None,
        plinth=draws.within((0.05, 0.15) if rules.style == "hall" else (0.1, 0.3)),
        wall_material=wall,
        roof_material=level if roof == "flat" else pitched,
        windows=_openings(rules.windows, draws),
        doors=_openings(rules.doors, draws),
    )


def _openings(rules: OpeningRules, draws: _Draws) -> OpeningDesign:
    return OpeningDesign(
        width=draws.within(rules.width),
        height=draws.within(rules.height),
        sill=draws.within(rules.sill),
        spacing=draws.within(rules.spacing),
    )
