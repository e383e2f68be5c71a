"""What is fixed to a house: installations that are placed assets, not geometry.

Shop boards and awnings, balconies over the street, gutters and rainwater pipes, courses and
cornices, chimney pots, aerials and dishes become ``BuildingInstallation`` with implicit geometry.
The shell stays a solid.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from envgen_usd.city.buildings.building_design import STREET_BALCONY, Design
from envgen_usd.city.buildings.building_shell import Shell, taken
from envgen_usd.city.buildings.facades import BALCONY_SIDE, Facade, Hole, lay_out
from envgen_usd.city.buildings.thematic_surfaces import SurfaceMaker
from envgen_usd.city.headings import heading_of
from envgen_usd.models.city_model import AVENUE, CityObject, Placement

_RAKED = frozenset(("sawtooth", "barrel"))
"""Roofs without level eaves over the street wall."""
_BOARD = (0.24, 0.56)
"""Depth and height of a shop's board, metres."""
_AWNING = (1.26, 0.97)
"""Depth and height of an awning, metres."""
_AWNING_ROOM = 1.4
"""Least depth before the wall for an awning, metres."""
_SLAB, _RAIL = 0.16, 1.04
"""Thickness of a balcony's slab, and height of its rail above it, metres."""
_GUTTER = 0.13
_PIPE = (0.2, 0.22)
_COURSE = (0.06, 0.175)
_CORNICE = (0.3, 0.4)
_POTS = (0.4, 0.6, 0.42)


@dataclass(frozen=True)
class _Fixture:
    """A placed asset: its foot in the building's frame, and its size (depth, width, height)."""

    template: str
    foot: tuple[float, float, float]
    size: tuple[float, float, float]


def make_fittings(maker: SurfaceMaker, shell: Shell) -> tuple[CityObject, ...]:
    """Returns what is fixed to a building, as ``BuildingInstallation`` with a placement.

    Args:
        maker: Knows site and floor of the building.
        shell: The building's shell.
    """
    design = shell.design
    facade = Facade(design.width, design.storeys, True, taken(design))
    fixtures = [*_on_roof(shell), *_on_wall(maker, design, lay_out(design, facade))]
    return tuple(_feature(maker, number, fixture) for number, fixture in enumerate(fixtures))


def make_wall_fittings(
    maker: SurfaceMaker, design: Design, holes: list[Hole]
) -> tuple[CityObject, ...]:
    """Returns what is fixed to a wall at y = 0 of its site.

    Args:
        maker: Knows site and floor of the wall.
        design: Design of the wall, as wide as it.
        holes: Openings of the wall.
    """
    fixtures = _on_wall(maker, design, holes)
    return tuple(_feature(maker, number, fixture) for number, fixture in enumerate(fixtures))


def _on_wall(maker: SurfaceMaker, design: Design, holes: list[Hole]) -> Iterator[_Fixture]:
    """Fixtures of the street wall."""
    yield from _shop(design, [hole for hole in holes if hole.shop], maker)
    yield from _bands(design)
    yield from _balconies(design, holes)
    if design.extras.fittings.gutters:
        ground = maker.site.lowest if maker.site.street is None else maker.site.street
        yield from _rainwater(design, ground - maker.floor)
    if design.extras.fittings.dish and design.storeys > 1:
        at = (design.width - 0.6, design.main_front, design.eaves - 1.0)
        yield _Fixture("satellite_dish", at, (0.67, 0.6, 0.6))


def _shop(design: Design, holes: list[Hole], maker: SurfaceMaker) -> Iterator[_Fixture]:
    """Board, sign and awning over the windows and the door of a shop."""
    if not holes:
        return
    left, right = min(hole.box[0] for hole in holes), max(hole.box[2] for hole in holes)
    top, wall = max(hole.box[3] for hole in holes), design.main_front
    middle, width = (left + right) / 2, right - left + 0.4
    yield _Fixture("shop_fascia", (middle, wall, top + 0.06), (_BOARD[0], width, _BOARD[1]))
    sign = min(0.75 * width, 2.4)
    yield _Fixture("shop_sign", (middle, wall - 0.09, top + 0.13), (0.02, sign, 0.36))
    if design.extras.fittings.awning and maker.site.room + wall > _AWNING_ROOM:
        displays = [hole.box for hole in holes if hole.kind == "WindowSurface"]
        left = min(box[0] for box in displays)
        size = (_AWNING[0], right - left + 0.2, _AWNING[1])
        yield _Fixture("awning", ((left + right) / 2, wall - 0.02, top - _AWNING[1] + 0.12), size)


def _balconies(design: Design, holes: list[Hole]) -> Iterator[_Fixture]:
    """A balcony before each window that leads to one; its slab ends at the storey's floor."""
    for hole in holes:
        if hole.balcony:
            left, bottom, right, _ = hole.box
            floor = int(bottom / design.storey_height) * design.storey_height
            foot = ((left + right) / 2, design.main_front, floor - _SLAB)
            size = (STREET_BALCONY, right - left + BALCONY_SIDE, _SLAB + _RAIL)
            yield _Fixture("balcony", foot, size)


def _bands(design: Design) -> Iterator[_Fixture]:
    """A course between the two lowest storeys, and a cornice below the roof."""
    fittings, middle, wall = design.extras.fittings, design.width / 2, design.main_front
    if any(wing.front for wing in design.extras.wings) or design.style == "hall":
        return
    if fittings.course and design.storeys > 1:
        low = design.storey_height - 0.06
        yield _Fixture("stone_course", (middle, wall, low), (_COURSE[0], design.width, _COURSE[1]))
    level = not design.ridge_to_street and design.roof not in _RAKED
    if fittings.cornice and level:
        eaves = design.eaves - design.overhang * design.slope
        low = eaves - (0.05 if design.parapet > 0.0 else _CORNICE[1] + 0.02)
        yield _Fixture("cornice", (middle, wall, low), (_CORNICE[0], design.width, _CORNICE[1]))


def _rainwater(design: Design, ground: float) -> Iterator[_Fixture]:
    """A gutter along the eaves, and a pipe at the left end of the street wall."""
    fronts = any(wing.front for wing in design.extras.wings)
    if fronts or design.ridge_to_street or design.roof in _RAKED:
        return
    over, verge = design.overhang, 0.0 if design.style == "row" else design.overhang
    eaves = design.eaves - over * design.slope
    wall, middle = design.main_front, design.width / 2
    if design.parapet <= 0.0:
        out = over if over > 0.0 else (0.3 if design.extras.fittings.cornice else 0.0)
        foot = (middle, wall - out, eaves + (0.02 if over > 0.0 else -0.13))
        yield _Fixture("gutter", foot, (_GUTTER, design.width + 2 * verge, _GUTTER))
    yield _Fixture("downpipe", (0.2, wall, ground), (*_PIPE, eaves - ground))


def _on_roof(shell: Shell) -> Iterator[_Fixture]:
    """Pots on the chimney, and an aerial on the ridge."""
    tops = [
        np.array(face.ring)
        for face in shell.faces
        if face.part == "chimney" and face.kind == "RoofSurface"
    ]
    for ring in tops:
        x, y, z = ring.mean(axis=0).tolist()
        share = min(np.ptp(ring[:, 1]) / _POTS[1], np.ptp(ring[:, 0]) / _POTS[0], 1.6) * 0.9
        yield _Fixture("chimney_pots", (x, y, z), (_POTS[0] * share, _POTS[1] * share, _POTS[2]))
    design = shell.design
    if design.extras.fittings.aerial and design.roof in {"gabled", "hipped", "flat"}:
        y = design.main_front + design.main_depth / 2
        high = design.eaves if design.roof == "flat" else shell.ridge
        yield _Fixture("aerial", (design.width * 0.5, y, high - 0.05), (1.05, 0.72, 2.0))


def _feature(maker: SurfaceMaker, number: int, fixture: _Fixture) -> CityObject:
    site = maker.site
    position = site.place(np.array([fixture.foot]), maker.floor)[0]
    # The street side looks to the right of the direction along it.
    heading = heading_of(np.array([site.along[1], -site.along[0]]))
    placement = Placement(position, heading, np.array(fixture.size), fixture.template)
    # The balconies of a house have one design; those at the back are bodies with other ids.
    at_street = fixture.template == "balcony"
    shared = {AVENUE: f"{maker.name}_balcony"} if at_street else {}
    name = "street_balcony" if at_street else fixture.template
    return CityObject(
        f"{maker.name}_{name}_{number}",
        "BuildingInstallation",
        {"relationToConstruction": "outside", **shared},
        placement=placement,
    )
