"""The closed shell of a building."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

from envgen_usd.city.buildings.attic import add_chimney, add_roof_windows, make_dormers
from envgen_usd.city.buildings.building_design import GARAGE_HEIGHT, Bay, Design, Wing
from envgen_usd.city.buildings.building_faces import Face
from envgen_usd.city.buildings.design_draws import LEAST_OVERHANG
from envgen_usd.city.buildings.facades import MARGIN, Facade, Hole, columns, lay_out
from envgen_usd.city.buildings.garages import garage_range
from envgen_usd.city.buildings.roofed_blocks import Block, make_block
from envgen_usd.city.buildings.roofs import Roof, RoofSpec
from envgen_usd.city.buildings.shell_union import unite

_STEP_BACK = 0.07
"""Difference between the overhangs of the main roof and a wing's roof, metres.

A larger value shortens the wing's.
"""
_LESS_OVERHANG = (0.03, 0.06, 0.1, 0.13, 0.16, 0.2, 0.25, 0.3, 0.35)
"""Tried reductions of a roof's overhang if edges would almost meet, metres."""
_NARROWER_WINGS = (0.07, 0.15)
"""Tried reductions of wing widths if shorter overhangs do not suffice, metres."""
_GABLE_SPACING = 1.7
"""Distance of the windows in an open side wall of a row house, in those at its street.

A larger value gives fewer windows.
"""
_HIPS = frozenset(("hipped", "pyramidal"))


@dataclass(frozen=True)
class Shell:
    """A closed 2-manifold.

    Attributes:
        design: Design of the shell: the building without omitted parts.
        left_out: Parts that the shell lacks, entirely or in part: ``wings``, ``bay``, ``dormers``,
            ``roof_windows``, ``chimney``, ``overhang``.
        faces: Faces in the building's frame.
        eaves: Height of the walls above the floor, metres.
        ridge: Height of the roof's highest edge, metres.
        top: Height of the highest point, metres.
    """

    design: Design
    left_out: tuple[str, ...]
    faces: list[Face]
    eaves: float
    ridge: float
    top: float


def build_shell(design: Design, base: float, openings: bool = True) -> Shell:
    """Returns the shell of a building without its garage and installations.

    The origin of the building's frame is the left end of the street side as seen from the street. x
    runs along it, y away from the street, and z = 0 is the floor.

    If parts meet too closely for a valid shell, the overhang is reduced; if that does not help, the
    smallest parts are left out. Parts without room are left out, too.

    Args:
        design: Design of the building.
        base: Height of the foundation's underside, below zero, metres.
        openings: False for walls without windows and doors.
    """
    for attempt in _attempts(design):
        parts = _parts(attempt, base, openings)
        faces = unite(parts.bodies)
        if faces is not None:
            return _shell(design, attempt, parts, faces)
    alone = replace(design, extras=replace(design.extras, bay=None, dormers=0, wings=()))
    parts = _parts(alone, base, openings)
    return _shell(design, alone, parts, parts.bodies[0])


def _attempts(design: Design) -> Iterator[Design]:
    """The design, followed by increasingly different alternatives."""
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
    for fewer in (replace(extras, dormers=0), replace(extras, bay=None, dormers=0)):
        yield replace(design, extras=fewer)


@dataclass(frozen=True)
class _Parts:
    """The parts of a building as closed bodies, the main part first; metres above the floor."""

    bodies: list[list[Face]]
    ridge: float
    chimney_top: float | None


def _parts(design: Design, base: float, openings: bool) -> _Parts:
    main, extras = _main_block(design, base), design.extras
    chimney_top = None

    def on_roof(roof: Roof) -> list[list[Face]]:
        nonlocal chimney_top
        if design.chimney is not None:
            chimney_top = add_chimney(design.chimney, roof)
        if extras.roof_windows:
            add_roof_windows(design, main.roof, roof)
        return make_dormers(design, main.roof, roof) if extras.dormers else []

    faces, roof, dormers = make_block(main, _main_holes(design) if openings else _no_holes, on_roof)
    bodies = [faces, *dormers]
    bodies += [_wing(design, wing, base, openings) for wing in extras.wings]
    if extras.bay is not None:
        bodies += _bay(design, extras.bay, base, openings)
    return _Parts(bodies, roof.ridge, chimney_top)


def _shell(wanted: Design, design: Design, parts: _Parts, faces: list[Face]) -> Shell:
    """The shell of a design that comes as near as it can to the one that is wanted."""
    extras = wanted.extras
    # Wings may cover some of what was put on the roof; each dormer has a window.
    dormers = sum(len(face.openings) for face in faces if face.part == "dormer")
    roof_windows = sum(len(face.openings) for face in faces if face.kind == "RoofSurface")
    lost = {
        "wings": len(design.extras.wings) < len(extras.wings),
        "bay": extras.bay is not None and (design.extras.bay is None or not bay_place(design)),
        "dormers": dormers < 2 * extras.dormers,
        "roof_windows": roof_windows < 2 * extras.roof_windows,
        "chimney": wanted.chimney is not None and parts.chimney_top is None,
        "overhang": design.overhang <= 0.0 < wanted.overhang,
    }
    left_out = tuple(part for part, is_lost in lost.items() if is_lost)
    top = max(parts.ridge, parts.chimney_top or parts.ridge)
    return Shell(design, left_out, faces, design.eaves, parts.ridge, top)


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
            return _gable_windows(design, length) if design.gables[side // 2] else []
        openings = lay_out(design, Facade(length, design.storeys, side == 0, taken(design)))
        return [hole for hole in openings if side != 1 or not _behind_garage(design, hole)]

    return holes


def _gable_windows(design: Design, length: float) -> list[Hole]:
    """Openings of the open side wall of a row house: fewer than at the street."""
    windows = replace(design.windows, spacing=_GABLE_SPACING * design.windows.spacing)
    return lay_out(replace(design, windows=windows), Facade(length, design.storeys))


def _behind_garage(design: Design, hole: Hole) -> bool:
    """True if the garage covers an opening of the right wall."""
    if not design.extras.garage or hole.box[1] > GARAGE_HEIGHT + 0.3:
        return False
    low, high = (y - design.main_front for y in garage_range(design))
    return hole.box[0] < high + MARGIN and hole.box[2] > low - MARGIN


def taken(design: Design) -> tuple[tuple[float, float], ...]:
    """Returns the ranges (from, to) of the main street wall that other parts cover, metres."""
    intervals = [(wing.left, wing.left + wing.width) for wing in design.extras.wings if wing.front]
    place = bay_place(design)
    return (*intervals, place) if place else tuple(intervals)


def bay_place(design: Design) -> tuple[float, float] | None:
    """Returns the left and right end of the bay before the last window column, or `None`."""
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
    # Edges that almost meet those of the main roof would leave slivers.
    over = design.overhang - _STEP_BACK
    over = 0.0 if row or over < LEAST_OVERHANG else over
    if design.roof == "flat":
        # A flat roof stays outside the main part.
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
