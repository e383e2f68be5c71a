"""Draws a building from the environment's ranges."""

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from envgen_usd.city.design import Bay, Chimney, Design, Extras, OpeningDesign, Wing
from envgen_usd.models.profile import BuildingDetails, BuildingRules, OpeningRules, Range

LEAST_OVERHANG = 0.05
"""A roof that stands over less does not stand over, metres."""
_COUNT = 64
_LEAST_MAIN = 5.5
"""Least depth of the main part of a house with wings, metres."""
_LEAST_WING = 2.8
_RETURN = 0.25
"""How far a wing's side stands back from that of the main part, metres."""
_LEAST_ATTIC = 2.0
"""Least height of a roof with dormers, metres."""
_GARAGE_GAP = 1.0
_GARAGE_ROOM = 9.0
"""Least width that a house keeps beside its garage, metres."""
_WINGED_ROOFS = frozenset(("flat", "gabled", "hipped"))


class Draws:
    """Uniform numbers, drawn at once because a generator is slow for single ones."""

    def __init__(self, generator: np.random.Generator) -> None:
        """Draws enough for one building."""
        self._numbers = iter(generator.random(_COUNT).tolist())

    def share(self) -> float:
        """A number in [0, 1)."""
        return float(next(self._numbers))

    def happens(self, probability: float) -> bool:
        """True with a probability."""
        return self.share() < probability

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


def draw_design(rules: BuildingRules, space: tuple[float, float], draws: Draws) -> Design:
    """Draws a building that fits into a space.

    Args:
        rules: The environment's ranges and weights.
        space: Width along the street and depth that are free, metres.
        draws: Of this building alone.
    """
    row = rules.style == "row"
    wanted = draws.within(rules.width), draws.within(rules.depth)
    width = _centimetres(space[0] if row else min(wanted[0], space[0]))
    depth = _centimetres(min(wanted[1], space[1]))
    roof, pitch = draws.choice(rules.roofs), draws.within(rules.roof_pitch)
    overhang, slab = _centimetres(draws.within(rules.overhang)), draws.happens(0.3)
    chimney = Chimney(
        draws.share(), draws.share(), draws.within((0.5, 0.9)), draws.within((0.6, 1.1))
    )
    wall, pitched = draws.choice(rules.materials), draws.choice(rules.roof_materials)
    level = draws.choice(rules.flat_roof_materials)
    design = Design(
        style=rules.style,
        function=rules.function,
        width=width,
        depth=depth,
        storeys=draws.whole(rules.storeys),
        storey_height=draws.within(rules.storey_height),
        roof=roof,
        slope=math.tan(math.radians(pitch)),
        overhang=overhang if overhang >= LEAST_OVERHANG and (roof != "flat" or slab) else 0.0,
        parapet=draws.within((0.35, 0.9)) if roof == "flat" else 0.0,
        ridge_to_street=not row and width < depth,
        plinth=draws.within((0.05, 0.15) if rules.style == "hall" else (0.1, 0.3)),
        wall_material=wall,
        roof_material=level if roof == "flat" else pitched,
        windows=_openings(rules.windows, draws),
        doors=_openings(rules.doors, draws),
        chimney=chimney if draws.happens(rules.chimney) else None,
    )
    return _with_extras(design, rules.details, space, draws)


def _centimetres(length: float) -> float:
    """A length on the grid of a builder, so that walls either meet or are clearly apart."""
    return math.floor(length * 100.0 + 1e-6) / 100.0


def _openings(rules: OpeningRules, draws: Draws) -> OpeningDesign:
    return OpeningDesign(
        width=draws.within(rules.width),
        height=draws.within(rules.height),
        sill=draws.within(rules.sill),
        spacing=draws.within(rules.spacing),
    )


def _with_extras(
    design: Design, details: BuildingDetails, space: tuple[float, float], draws: Draws
) -> Design:
    shape = draws.choice(details.footprints)
    front = draws.happens(details.front_gable)
    figures = draws.share(), draws.share(), draws.share()
    bay = draws.happens(details.bays), draws.share(), draws.share()
    dormers, skylights = draws.happens(details.dormers), draws.happens(details.roof_windows)
    many, dormer = draws.share(), draws.within((1.3, 1.9))
    garage = _centimetres(draws.within((2.9, 3.4))) if draws.happens(details.garages) else 0.0
    if space[0] - garage < _GARAGE_ROOM:
        garage = 0.0
    if garage:
        # The parts of the house have to fit into what the garage leaves.
        room = _centimetres(space[0] - garage - _GARAGE_GAP)
        design = replace(design, width=min(design.width, room))
    if design.roof in _WINGED_ROOFS and shape != "rectangle":
        design = _with_wings(design, shape, front, figures)
    attic = design.roof in ("gabled", "hipped") and _rise(design) >= _LEAST_ATTIC
    columns = max(int(design.width / design.windows.spacing), 1)
    extras = replace(
        design.extras,
        bay=_bay(design, bay[1], bay[2]) if bay[0] else None,
        dormers=1 + int(many * min(columns, 3)) if dormers and attic else 0,
        dormer_width=dormer,
        roof_windows=1 + int(many * 2) if skylights and attic and not dormers else 0,
        balconies=draws.happens(details.balconies) and design.storeys > 1,
        porch=draws.happens(details.porches),
        garage=garage,
        embrasure=draws.within(details.embrasure),
    )
    return replace(design, extras=extras)


def _rise(design: Design) -> float:
    """Height of the main part's roof."""
    span = design.width if design.ridge_to_street else design.main_depth
    return min(span, design.width) / 2 * design.slope


def _with_wings(
    design: Design, shape: str, front: bool, figures: tuple[float, float, float]
) -> Design:
    """Gives the house wings if it is large enough; its ridge then runs along the street."""
    main = _centimetres(max(_LEAST_MAIN, (0.5 + 0.15 * figures[0]) * design.depth))
    width = _centimetres(min((0.3 + 0.2 * figures[1]) * design.width, 0.9 * main))
    depth = round(design.depth - main, 2)
    if min(depth, width) < (_LEAST_WING if shape != "u" else 0.8 * _LEAST_WING):
        return design
    storeys = max(design.storeys - int(figures[2] < 0.6), 1)
    # A wall that goes straight on would leave slivers between the two roofs.
    inset = 0.0 if design.style == "row" else _RETURN
    right = round(design.width - width - inset, 2)
    lefts = {
        "l": [right if figures[2] < 0.5 else inset],
        "t": [_centimetres((inset + right) / 2)],
        "u": [inset, right],
    }[shape]
    front = front and shape == "l"
    wings = tuple(Wing(left, width, depth, storeys, front) for left in lefts)
    return replace(design, ridge_to_street=False, extras=Extras(wings=wings))


def _bay(design: Design, size: float, height: float) -> Bay:
    return Bay(
        width=_centimetres(design.windows.width + 0.7 + 0.4 * size),
        depth=_centimetres(0.5 + 0.5 * size),
        storeys=1 + int(height * max(design.storeys - 1, 1)),
    )
