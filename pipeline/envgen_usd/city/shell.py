"""The closed shell of one building."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

from envgen_usd.city.attic import add_chimney, add_roof_windows, make_dormers
from envgen_usd.city.blocks import Block, make_block
from envgen_usd.city.design import GARAGE_HEIGHT, Bay, Design, Wing
from envgen_usd.city.draws import LEAST_OVERHANG
from envgen_usd.city.facade import MARGIN, Facade, Hole, columns, lay_out
from envgen_usd.city.faces import Face
from envgen_usd.city.garage import garage_range
from envgen_usd.city.roofs import Roof, RoofSpec
from envgen_usd.city.union import unite

_STEP_BACK = 0.07
"""How much less a wing's roof stands over than the main one, metres."""
_LESS_OVERHANG = (0.03, 0.06, 0.1, 0.13, 0.16, 0.2, 0.25, 0.3, 0.35)
"""By how much less a roof may stand over where edges would all but meet, metres."""
_NARROWER_WINGS = (0.07, 0.15)
"""By how much wings may be narrower where that is not enough, metres."""
_HIPS = frozenset(("hipped", "pyramidal"))


@dataclass(frozen=True)
class Shell:
    """A closed 2-manifold.

    Attributes:
        design: What is modelled: the building without the parts that had to be left out.
        faces: In the building's frame.
        eaves: Height of the walls above the floor.
        ridge: Height of the roof's highest edge.
        top: Height of the highest point.
    """

    design: Design
    faces: list[Face]
    eaves: float
    ridge: float
    top: float


def build_shell(design: Design, base: float, openings: bool = True) -> Shell:
    """Returns the shell of a building without its garage and installations.

    The building's frame has its origin in the left end of the street side as seen from the
    street, x along it, y away from the street, and z = 0 at the floor.

    Where its parts meet too closely to form a sound shell, the roof stands over less; where that
    does not help, the least of them are left out.

    Args:
        design: The building.
        base: Height of the foundation's underside, below zero.
        openings: False for walls without windows and doors.
    """
    shells = (_try_shell(attempt, base, openings) for attempt in _attempts(design))
    shell = next((shell for shell in shells if shell is not None), None)
    assert shell is not None
    return shell


def _attempts(design: Design) -> Iterator[Design]:
    """The design, and others that come less and less near to it."""
    extras = design.extras
    yield design
    for less in _LESS_OVERHANG:
        overhang = round(design.overhang - less, 2)
        if overhang >= LEAST_OVERHANG:
            yield replace(design, overhang=overhang)
    plainer = replace(design, overhang=0.0)
    if design.overhang > 0.0:
        yield plainer
    for less in _NARROWER_WINGS if extras.wings else ():
        wings = tuple(replace(w, width=round(w.width - less, 2)) for w in extras.wings)
        yield replace(plainer, extras=replace(extras, wings=wings))
    plain = replace(extras, bay=None, dormers=0)
    for fewer in (replace(extras, dormers=0), plain, replace(plain, wings=())):
        yield replace(design, extras=fewer)


def _try_shell(design: Design, base: float, openings: bool) -> Shell | None:
    main = _main_block(design, base)
    chimney_top = 0.0

    def on_roof(roof: Roof) -> list[list[Face]]:
        nonlocal chimney_top
        if design.chimney is not None:
            chimney_top = add_chimney(design.chimney, roof)
        if design.extras.roof_windows:
            add_roof_windows(design, main.roof, roof)
        return make_dormers(design, main.roof, roof) if design.extras.dormers else []

    faces, roof, dormers = make_block(main, _main_holes(design) if openings else _no_holes, on_roof)
    bodies = [faces, *dormers]
    bodies += [_wing(design, wing, base, openings) for wing in design.extras.wings]
    if design.extras.bay is not None:
        bodies += _bay(design, design.extras.bay, base, openings)
    united = unite(bodies)
    if united is None:
        return None
    return Shell(design, united, design.eaves, roof.ridge, max(roof.ridge, chimney_top))


def _main_block(design: Design, base: float) -> Block:
    length, width = design.width, design.main_depth
    if design.ridge_to_street:
        length, width = width, length
    # Only an extruded roof can end at a party wall.
    ends = design.style == "row" and design.roof in _HIPS
    spec = RoofSpec(
        kind=design.roof,
        length=length,
        width=width,
        eaves=design.eaves,
        slope=design.slope,
        overhang=0.0 if ends else design.overhang,
        verge=0.0 if design.style == "row" else design.overhang,
        parapet=design.parapet,
    )
    return Block(
        0.0,
        design.main_front,
        design.width,
        design.main_depth,
        base,
        spec,
        design.ridge_to_street,
    )


def _main_holes(design: Design) -> Callable[[int, float], list[Hole]]:
    def holes(side: int, length: float) -> list[Hole]:
        if side % 2 == 1 and design.style == "row":
            return []
        found = lay_out(design, Facade(length, design.storeys, side == 0, taken(design)))
        return [hole for hole in found if side != 1 or not _behind_garage(design, hole)]

    return holes


def _behind_garage(design: Design, hole: Hole) -> bool:
    """Whether the garage stands before an opening of the right wall."""
    if not design.extras.garage or hole.box[1] > GARAGE_HEIGHT + 0.3:
        return False
    low, high = (y - design.main_front for y in garage_range(design))
    return hole.box[0] < high + MARGIN and hole.box[2] > low - MARGIN


def taken(design: Design) -> tuple[tuple[float, float], ...]:
    """Returns where along the main street wall (from, to) something stands before it."""
    found = [(wing.left, wing.left + wing.width) for wing in design.extras.wings if wing.front]
    place = bay_place(design)
    return (*found, place) if place else tuple(found)


def bay_place(design: Design) -> tuple[float, float] | None:
    """Returns the left and right end of the bay, or none: before the last column of windows."""
    bay, middles = design.extras.bay, columns(design.width, design.windows)
    wings = [wing for wing in design.extras.wings if wing.front]
    if bay is None or wings or len(middles) < 2 or bay.width / 2 + 0.1 > design.width - middles[-1]:
        return None
    return middles[-1] - bay.width / 2, middles[-1] + bay.width / 2


def _wing(design: Design, wing: Wing, base: float, openings: bool) -> list[Face]:
    """A wing that reaches to the middle of the main part."""
    half = design.main_depth / 2
    y = 0.0 if wing.front else design.main_front + half
    depth = wing.depth + half
    row = design.style == "row"
    eaves = wing.storeys * design.storey_height
    # Edges that nearly meet those of the main roof would leave slivers.
    over = design.overhang - _STEP_BACK
    over = 0.0 if row or over < LEAST_OVERHANG else over
    if design.roof == "flat":
        # A flat roof stays out of the main part.
        y, depth = (y, wing.depth) if wing.front else (y + half, wing.depth)
        over = 0.0
    kind = "flat" if design.roof == "flat" else "gabled"
    spec = RoofSpec(
        kind, depth, wing.width, eaves, design.slope, over, over, parapet=design.parapet
    )
    block = Block(wing.left, y, wing.width, depth, base, spec, turned=True)

    def holes(side: int, length: float) -> list[Hole]:
        at_party_wall = row and (
            (side == 3 and wing.left <= 0.0)
            or (side == 1 and wing.left + wing.width >= design.width)
        )
        hidden = side == (2 if wing.front else 0)
        return [] if at_party_wall or hidden else lay_out(design, Facade(length, wing.storeys))

    return make_block(block, holes if openings else _no_holes)[0]


def _no_holes(_side: int, _length: float) -> list[Hole]:
    return []


def _bay(design: Design, bay: Bay, base: float, openings: bool) -> list[list[Face]]:
    place = bay_place(design)
    if place is None:
        return []
    inside = 0.3
    spec = RoofSpec(
        "shed", bay.width, bay.depth + inside, bay.storeys * design.storey_height - 0.1, 0.5
    )
    block = Block(place[0], -bay.depth, bay.width, bay.depth + inside, base, spec)

    def holes(side: int, length: float) -> list[Hole]:
        return lay_out(design, Facade(length, bay.storeys)) if side == 0 else []

    return [make_block(block, holes if openings else _no_holes)[0]]
