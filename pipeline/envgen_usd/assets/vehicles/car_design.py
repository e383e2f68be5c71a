"""A car as data."""

from dataclasses import dataclass

from envgen_usd.assets.vehicles.car_details import Doors, Face, Glazing
from envgen_usd.assets.vehicles.car_form import CarForm
from envgen_usd.assets.vehicles.wheel_shapes import Rim


@dataclass(frozen=True)
class Livery:
    """A fixed look instead of the paints that a car may have.

    Attributes:
        paint: Material of the body.
        stripe: Material of a band on the flanks; empty for none.
        band: Lower and upper edge of the band, metres.
        sign: Face of a lit sign on the roof, among the prints; empty for none.
        beacon: Material of a light bar on the roof; empty for none.
    """

    paint: str
    stripe: str = ""
    band: tuple[float, float] = (0.55, 0.78)
    sign: str = ""
    beacon: str = ""


@dataclass(frozen=True)
class Car:
    """A car.

    Attributes:
        form: Its body.
        glazing: Its windows.
        face: Lamps, grille and bumpers.
        doors: Gaps and handles.
        rim: Design of its rims.
        mirror: Size of its mirrors as a share of a usual one's; 0 for none.
        plate: Letter of its number plate among the prints.
        livery: Its livery; `None` for one of the paints.
        bed: Along of both ends, and height of the floor of an open bed; `None` without one.
        roof_boxes: Along of both ends, half the width and height of the cases on the roof.
        display: Name of the display above the windscreen; empty without one.
        display_foot: Height of its lower edge, metres.
    """

    form: CarForm
    glazing: Glazing
    face: Face
    doors: Doors
    rim: Rim
    mirror: float = 1.0
    plate: str = "a"
    livery: Livery | None = None
    bed: tuple[float, float, float] | None = None
    roof_boxes: tuple[tuple[float, float, float, float], ...] = ()
    display: str = ""
    display_foot: float = 0.0
