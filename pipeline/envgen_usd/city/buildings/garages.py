"""A garage beside a house: a building part with a separate closed shell."""

from envgen_usd.city.buildings.building_design import GARAGE_HEIGHT, Design
from envgen_usd.city.buildings.building_faces import Face
from envgen_usd.city.buildings.facades import Hole
from envgen_usd.city.buildings.roofed_blocks import Block, make_block
from envgen_usd.city.buildings.roofs import RoofSpec

_DEPTH = 6.0
_GATE = (2.4, 2.1)
_SET_BACK = 1.0
_PARAPET = 0.15


def garage_range(design: Design) -> tuple[float, float]:
    """Returns the range of a garage along y, metres."""
    y = design.main_front + min(_SET_BACK, 0.2 * design.main_depth)
    return y, min(y + _DEPTH, design.depth)


def make_garage(design: Design, base: float) -> list[Face]:
    """Returns a garage on the right side of a house.

    Args:
        design: Design of the house; `extras.garage` is the available width.
        base: Height of the foundation's underside, metres.
    """
    y, end = garage_range(design)
    width, depth = design.extras.garage, end - y
    roof = RoofSpec("flat", width, depth, GARAGE_HEIGHT, 0.0, parapet=_PARAPET)
    block = Block(design.garage_left, y, width, depth, base, roof)
    gate = min(_GATE[0], width - 0.4)

    def holes(side: int, length: float) -> list[Hole]:
        middle = length / 2
        box = (middle - gate / 2, 0.0, middle + gate / 2, _GATE[1])
        return [Hole("DoorSurface", box)] if side == 0 else []

    return make_block(block, holes)[0]
