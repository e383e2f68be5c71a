"""Draws the design of a building from the environment's ranges."""

import math
from dataclasses import replace
from typing import TypeVar

from envgen_usd.city.buildings.building_design import (
    Bay,
    Chimney,
    Design,
    Extras,
    Fittings,
    OpeningDesign,
    Wing,
)
from envgen_usd.models.building_rules import (
    CORRELATED,
    BuildingDetails,
    BuildingRules,
    OpeningRules,
)
from envgen_usd.models.distribution import Range
from envgen_usd.seeds import Draws

LEAST_OVERHANG = 0.05
"""A roof that stands over less does not stand over, metres."""
_SLABS = 0.3
"""Share of flat roofs whose slab stands over the walls."""
_LEAST_MAIN = 5.5
"""Least depth of the main part of a house with wings, metres."""
_MAIN_SHARE: Range = (0.5, 0.65)
"""Depth of the main part as a share of the house's."""
_LEAST_WING = 2.8
"""Least width and depth of a wing, metres."""
_WING_SHARE: Range = (0.3, 0.5)
"""Width of a wing as a share of the house's."""
_LOW_WINGS = 0.6
"""Share of houses whose wings have a storey less than the main part."""
_RETURN = 0.25
"""Setback of a wing's side from that of the main part, metres; a larger value narrows wings."""
_LEAST_ATTIC = 2.0
"""Least height of a roof with dormers, metres; a larger value gives fewer dormers."""
_GARAGE_GAP = 1.0
_GARAGE_ROOM = 9.0
"""Least free width beside a garage, metres; a larger value gives fewer garages."""
_SHED_PITCH = 14.0
"""Steepest pitch of a shed roof, degrees: it spans the whole house, whose back a larger value makes
a high bare wall."""
_WINGED_ROOFS = frozenset(("flat", "gabled", "hipped"))

_Name = TypeVar("_Name", bound=str)


def draw_design(rules: BuildingRules, space: tuple[float, float], draws: Draws) -> Design:
    """Draws a building that fits into a space.

    Args:
        rules: Ranges and weights of the environment.
        space: Free width along the street and free depth, metres.
        draws: Random numbers of this building alone.
    """
    row = rules.style == "row"
    wanted = draws.within("width", rules.width), draws.within("depth", rules.depth)
    width = _centimetres(space[0] if row else min(wanted[0], space[0]))
    depth = _centimetres(min(wanted[1], space[1]))
    roof = draws.choice("roof", rules.roofs)
    flat = roof == "flat"
    pitch = draws.within("roof pitch", rules.roof_pitch)
    if roof == "shed":
        pitch = min(pitch, _SHED_PITCH)
    overhang = _centimetres(draws.within("overhang", rules.overhang))
    if overhang < LEAST_OVERHANG or (flat and not draws.happens("slab", _SLABS)):
        overhang = 0.0
    roofing = rules.flat_roof_materials if flat else rules.roof_materials
    design = Design(
        style=rules.style,
        function=rules.function,
        width=width,
        depth=depth,
        storeys=draws.whole("storeys", rules.storeys),
        storey_height=draws.within("storey height", rules.storey_height),
        roof=roof,
        slope=math.tan(math.radians(pitch)),
        overhang=overhang,
        parapet=draws.within("parapet", (0.35, 0.9)) if flat else 0.0,
        ridge_to_street=not row and width < depth,
        plinth=draws.within("plinth", (0.05, 0.15) if rules.style == "hall" else (0.1, 0.3)),
        wall_material=draws.choice("wall material", rules.materials),
        roof_material=draws.choice("roof material", roofing),
        windows=_openings(rules.windows, "window", draws),
        doors=_openings(rules.doors, "door", draws),
        chimney=_chimney(draws) if draws.happens("chimney", rules.chimney) else None,
    )
    return _with_extras(design, rules.details, space, draws)


def tied(draws: Draws, rules: BuildingRules, plot_width: float) -> Draws:
    """The draws of a building with the correlations of its figures.

    Args:
        draws: Independent random numbers of the building.
        rules: Ranges and weights of the environment.
        plot_width: Width along the street of the largest rectangle in its plot, metres.
    """
    if rules.correlation is None:
        return draws
    names = {name: name.replace("_", " ") for name in CORRELATED}
    free = {name: draws.share(drawn) for name, drawn in names.items()}
    shares = rules.correlation.tied({"plot_width": plot_width}, free)
    return draws.with_shares({names[name]: share for name, share in shares.items()})


def _centimetres(length: float) -> float:
    """A length rounded to centimetres, so that walls either meet or are clearly apart."""
    return math.floor(length * 100.0 + 1e-6) / 100.0


def _openings(rules: OpeningRules, kind: str, draws: Draws) -> OpeningDesign:
    return OpeningDesign(
        width=draws.within(f"{kind} width", rules.width),
        height=draws.within(f"{kind} height", rules.height),
        sill=draws.within(f"{kind} sill", rules.sill),
        spacing=draws.within(f"{kind} spacing", rules.spacing),
    )


def _chimney(draws: Draws) -> Chimney:
    return Chimney(
        along=draws.share("chimney along"),
        across=draws.share("chimney across"),
        width=draws.within("chimney width", (0.5, 0.9)),
        height=draws.within("chimney height", (0.6, 1.1)),
    )


def _with_extras(
    design: Design, details: BuildingDetails, space: tuple[float, float], draws: Draws
) -> Design:
    garage = 0.0
    if draws.happens("garage", details.garages):
        garage = _centimetres(draws.within("garage width", (2.9, 3.4)))
    if space[0] - garage < _GARAGE_ROOM:
        garage = 0.0
    if garage:
        # The parts of the house have to fit beside the garage.
        room = _centimetres(space[0] - garage - _GARAGE_GAP)
        design = replace(design, width=min(design.width, room))
    shape = draws.choice("footprint", details.footprints)
    if design.roof in _WINGED_ROOFS and shape != "rectangle":
        front = shape == "l" and draws.happens("front gable", details.front_gable)
        design = _with_wings(design, shape, front, draws)
    attic = design.roof in ("gabled", "hipped") and _rise(design) >= _LEAST_ATTIC
    dormers = attic and draws.happens("dormers", details.dormers)
    skylights = attic and not dormers and draws.happens("roof windows", details.roof_windows)
    columns = max(int(design.width / design.windows.spacing), 1)
    extras = replace(
        design.extras,
        bay=_bay(design, draws) if draws.happens("bay", details.bays) else None,
        dormers=draws.whole("dormer count", (1, min(columns, 3))) if dormers else 0,
        dormer_width=draws.within("dormer width", (1.3, 1.9)),
        roof_windows=draws.whole("roof window count", (1, 2)) if skylights else 0,
        balconies=draws.happens("balconies", details.balconies) and design.storeys > 1,
        porch=draws.happens("porch", details.porches),
        garage=garage,
        embrasure=draws.within("embrasure", details.embrasure),
        fittings=_fittings(details, design.storeys, draws),
    )
    return replace(design, extras=extras)


def _fittings(details: BuildingDetails, storeys: int, draws: Draws) -> Fittings:
    return Fittings(
        shop=draws.happens("shop", details.shops),
        awning=draws.happens("awning", details.awnings),
        gutters=draws.happens("gutters", details.gutters),
        course=draws.happens("course", details.courses),
        cornice=draws.happens("cornice", details.cornices),
        dish=draws.happens("dish", details.dishes),
        aerial=draws.happens("aerial", details.aerials),
        balcony=draws.happens("street balcony", details.street_balconies) and storeys > 1,
    )


def _rise(design: Design) -> float:
    """Height of the main part's roof, metres."""
    span = design.width if design.ridge_to_street else design.main_depth
    return min(span, design.width) / 2 * design.slope


def _with_wings(design: Design, shape: str, front: bool, draws: Draws) -> Design:
    """Gives the house wings if it is large enough; its ridge then runs along the street."""
    share = draws.within("main depth", _MAIN_SHARE)
    main = _centimetres(max(_LEAST_MAIN, share * design.depth))
    share = draws.within("wing width", _WING_SHARE)
    width = _centimetres(min(share * design.width, 0.9 * main))
    depth = round(design.depth - main, 2)
    if min(depth, width) < (_LEAST_WING if shape != "u" else 0.8 * _LEAST_WING):
        return design
    storeys = max(design.storeys - int(draws.happens("low wing", _LOW_WINGS)), 1)
    # A wall that goes straight on would leave slivers between the two roofs.
    inset = 0.0 if design.style == "row" else _RETURN
    right = round(design.width - width - inset, 2)
    lefts = {
        "l": [right if draws.happens("right wing", 0.5) else inset],
        "t": [_centimetres((inset + right) / 2)],
        "u": [inset, right],
    }[shape]
    wings = tuple(Wing(left, width, depth, storeys, front) for left in lefts)
    return replace(design, ridge_to_street=False, extras=Extras(wings=wings))


def _bay(design: Design, draws: Draws) -> Bay:
    return Bay(
        width=_centimetres(design.windows.width + draws.within("bay width", (0.7, 1.1))),
        depth=_centimetres(draws.within("bay depth", (0.5, 1.0))),
        storeys=draws.whole("bay storeys", (1, max(design.storeys - 1, 1))),
    )
