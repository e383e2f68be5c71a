"""Windows and doors of a wall, on a grid that aligns them from storey to storey."""

from dataclasses import dataclass

import numpy as np

from envgen_usd.city.buildings.building_design import Design, OpeningDesign

MARGIN = 0.35
"""Least distance of an opening from the wall's ends, other openings and floors, metres.

A larger value removes openings in narrow walls.
"""
_LINTEL = 0.25
"""Least height of wall above an opening within its storey, metres.

A larger value lowers tall openings.
"""
_LEAST_WALL = 1.5
"""Least length of a wall with at least a single window, metres.

A larger value gives more blind walls.
"""
SHOP_HEAD = 0.75
"""Height of wall above a shop's windows for its board, metres; a larger value lowers them."""
_SHOP_TOP, _LEAST_SHOP = 2.7, 2.0
"""Largest and least height of a shop's windows above the floor, metres."""
_SHOP_SILL = 0.45
"""Height of the sill of a display window, metres."""
_SHOP_DOOR = 1.4
"""Width of a shop's door, metres; wider than a front door, so that it gets a door of its own."""
BALCONY_SIDE = 1.3
"""Width of a balcony over the street, beyond its window, metres."""
_SILL_OUT = 0.08
"""Height of the sill of a window that leads to a balcony, metres."""
_DISPLAY, _LEAST_DISPLAY = 3.6, 1.95
"""Largest and least width of a display window, metres."""


@dataclass(frozen=True)
class Hole:
    """An opening of a wall: its rectangle (left, bottom, right, top) seen from outside, metres.

    Attributes:
        kind: ``WindowSurface`` or ``DoorSurface``.
        box: Coordinates from the wall's left end and from the floor, metres.
        shop: True for the display windows and the door of a shop.
        balcony: True for a tall window that leads to a balcony.
    """

    kind: str
    box: tuple[float, float, float, float]
    shop: bool = False
    balcony: bool = False


@dataclass(frozen=True)
class Facade:
    """Layout input of a wall.

    Attributes:
        length: Length, metres.
        storeys: Number of storeys from the floor.
        street: True for the street wall, which has the doors.
        taken: (from, to) along the wall without doors, e.g. behind a bay, metres.
        balcony: True for a wall other than the street's that may have balconies.
    """

    length: float
    storeys: int
    street: bool = False
    taken: tuple[tuple[float, float], ...] = ()
    balcony: bool = False


def lay_out(design: Design, facade: Facade) -> list[Hole]:
    """Returns the openings of a wall.

    Windows stand in evenly spaced columns that are equal in all storeys. A door replaces the
    windows that it would touch.

    Args:
        design: Design of the building.
        facade: Wall.
    """
    middles = columns(facade.length, design.windows)
    has_doors = facade.street and not design.raised
    doors = _doors(design, facade, middles) if has_doors else []
    if has_doors and design.extras.fittings.shop:
        doors += _shop_front(design, facade, doors)
    holes = list(doors)
    stands_out = facade.street or facade.balcony
    tall = _balcony_column(design, facade, middles) if stands_out else None
    for storey in range(facade.storeys):
        holes += _storey(design, middles, storey, doors, tall if storey else None)
    return holes


def _balcony_column(design: Design, facade: Facade, middles: list[float]) -> float | None:
    """The column of windows with balconies: the free one nearest to the middle, or `None`."""
    if not design.extras.fittings.balcony:
        return None
    room = (design.windows.width + BALCONY_SIDE) / 2
    free = [
        at
        for at in middles
        if _is_free(facade, at, 2 * room) and MARGIN + room <= at <= facade.length - MARGIN - room
    ]
    return min(free, key=lambda at: abs(at - facade.length / 2)) if free else None


def _shop_front(design: Design, facade: Facade, doors: list[Hole]) -> list[Hole]:
    """Display windows and a door in the widest free part of the ground floor."""
    top = min(design.storey_height - SHOP_HEAD, _SHOP_TOP)
    blocks = [(door.box[0], door.box[2]) for door in doors] + list(facade.taken)
    edges = [0.0, *(x for block in sorted(blocks) for x in block), facade.length]
    gaps = [(right - left, left) for left, right in zip(edges[::2], edges[1::2], strict=True)]
    room, left = max(gaps)
    displays = room - 3 * MARGIN - _SHOP_DOOR
    if design.style == "hall" or top < _LEAST_SHOP or displays < _LEAST_DISPLAY:
        return []
    low = left + MARGIN
    sill = design.doors.sill
    front = [Hole("DoorSurface", (low, sill, low + _SHOP_DOOR, sill + top), shop=True)]
    count = int(np.ceil(displays / _DISPLAY))
    width = (displays - (count - 1) * MARGIN) / count
    for number in range(count):
        at = low + _SHOP_DOOR + MARGIN + number * (width + MARGIN)
        box = (at, sill + _SHOP_SILL, at + width, sill + top)
        front.append(Hole("WindowSurface", box, shop=True))
    return front


def columns(length: float, windows: OpeningDesign) -> list[float]:
    """Returns the centres of a wall's window columns, metres."""
    room = length - MARGIN
    count = min(int(length / windows.spacing), int(room / (windows.width + MARGIN)))
    if count < 1 and room >= windows.width + MARGIN and length > _LEAST_WALL:
        count = 1
    return [length * (column + 0.5) / count for column in range(count)]


def _storey(
    design: Design, middles: list[float], storey: int, doors: list[Hole], tall: float | None
) -> list[Hole]:
    """The windows of a storey; that of the column `tall` reaches down to a balcony."""
    windows = design.windows
    floor = storey * design.storey_height
    bottom = floor + windows.sill
    top = min(bottom + windows.height, floor + design.storey_height - _LINTEL)
    if top - bottom < 0.3:
        return []
    half = windows.width / 2
    holes = []
    for at in middles:
        leads_out = at == tall
        box = (at - half, floor + _SILL_OUT if leads_out else bottom, at + half, top)
        if not any(_touch(box, door.box) for door in doors):
            holes.append(Hole("WindowSurface", box, balcony=leads_out))
    return holes


def _doors(design: Design, facade: Facade, middles: list[float]) -> list[Hole]:
    doors, length = design.doors, facade.length
    limit = design.eaves if design.style == "hall" else design.storey_height
    height = min(doors.height, limit - _LINTEL)
    width = min(doors.width, length - 2 * MARGIN)
    if height < 1.5 or width < 0.7:
        return []
    low, high = MARGIN + width / 2, length - MARGIN - width / 2
    places = [min(max(at, low), high) for at in _door_places(design, facade, middles, width)]
    return [
        Hole("DoorSurface", (at - width / 2, doors.sill, at + width / 2, doors.sill + height))
        for at in places
        if _is_free(facade, at, width)
    ]


def _door_places(design: Design, facade: Facade, middles: list[float], width: float) -> list[float]:
    """Centres of gates at their spacing, or of a house door in line with a window column."""
    length = facade.length
    count = int(length / design.doors.spacing)
    if design.style == "hall" or count > 1 or not middles:
        count = max(1, min(count, int((length - MARGIN) / (width + MARGIN))))
        return [length * (place + 0.5) / count for place in range(count)]
    free = [at for at in middles if _is_free(facade, at, width)]
    if not free:
        return []
    if design.entrance is not None:
        entrance = design.entrance
        return [min(free, key=lambda at: abs(at - entrance))]
    # The middle of a wide house, a side of a narrow house.
    return [free[len(free) // 2 if len(free) > 3 else 0]]


def _is_free(facade: Facade, at: float, width: float) -> bool:
    """True if the space before a door is free."""
    low, high = at - width / 2 - MARGIN, at + width / 2 + MARGIN
    return not any(start < high and low < end for start, end in facade.taken)


def _touch(a: tuple[float, float, float, float], b: tuple[float, float, float, float]) -> bool:
    return (
        a[0] < b[2] + MARGIN
        and b[0] < a[2] + MARGIN
        and a[1] < b[3] + MARGIN
        and b[1] < a[3] + MARGIN
    )
