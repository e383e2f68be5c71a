"""Windows and doors of one wall, on a grid that keeps them aligned from storey to storey."""

from dataclasses import dataclass

from envgen_usd.city.design import Design, OpeningDesign

_MARGIN = 0.35
"""Least distance of an opening from the wall's ends, from other openings and from floors."""
_LINTEL = 0.25
"""Least height of wall above an opening within its storey."""


@dataclass(frozen=True)
class Hole:
    """An opening of a wall: its rectangle (left, bottom, right, top) seen from outside, metres.

    Attributes:
        kind: ``WindowSurface`` or ``DoorSurface``.
        box: From the wall's left end and from the floor.
    """

    kind: str
    box: tuple[float, float, float, float]


def lay_out(design: Design, length: float, street: bool) -> list[Hole]:
    """Returns the openings of a wall.

    Windows stand in columns that are evenly spread over the wall and the same in all storeys. A
    door takes the place of the windows that it would touch.

    Args:
        design: The building.
        length: Of the wall.
        street: True for the wall at the street, which has the doors.
    """
    windows = design.windows
    columns = _columns(length, windows)
    doors = _doors(design, length, columns) if street else []
    holes = list(doors)
    for storey in range(design.storeys):
        holes += _storey(design, columns, storey, doors)
    return holes


def _columns(length: float, openings: OpeningDesign) -> list[float]:
    """Middles of the columns."""
    room = length - _MARGIN
    count = min(int(length / openings.spacing), int(room / (openings.width + _MARGIN)))
    if count < 1 and room >= openings.width + _MARGIN and length > 3.0:
        count = 1
    return [length * (column + 0.5) / count for column in range(count)]


def _storey(design: Design, columns: list[float], storey: int, doors: list[Hole]) -> list[Hole]:
    windows = design.windows
    floor = storey * design.storey_height
    bottom = floor + windows.sill
    top = min(bottom + windows.height, floor + design.storey_height - _LINTEL)
    if top - bottom < 0.3:
        return []
    boxes = [(at - windows.width / 2, bottom, at + windows.width / 2, top) for at in columns]
    return [
        Hole("WindowSurface", box)
        for box in boxes
        if not any(_touch(box, door.box) for door in doors)
    ]


def _doors(design: Design, length: float, columns: list[float]) -> list[Hole]:
    doors = design.doors
    limit = design.eaves if design.style == "hall" else design.storey_height
    height = min(doors.height, limit - _LINTEL)
    width = min(doors.width, length - 2 * _MARGIN)
    if height < 1.5 or width < 0.7:
        return []
    count = max(1, min(int(length / doors.spacing), int((length - _MARGIN) / (width + _MARGIN))))
    if count == 1 and columns and design.style != "hall":
        # In line with a column: the middle one of a wide house, a side one of a narrow house.
        middles = [columns[len(columns) // 2 if len(columns) > 3 else 0]]
    else:
        middles = [length * (place + 0.5) / count for place in range(count)]
    low, high = _MARGIN + width / 2, length - _MARGIN - width / 2
    return [
        Hole("DoorSurface", (at - width / 2, doors.sill, at + width / 2, doors.sill + height))
        for at in (min(max(middle, low), high) for middle in middles)
    ]


def _touch(a: tuple[float, float, float, float], b: tuple[float, float, float, float]) -> bool:
    return (
        a[0] < b[2] + _MARGIN
        and b[0] < a[2] + _MARGIN
        and a[1] < b[3] + _MARGIN
        and b[1] < a[3] + _MARGIN
    )
