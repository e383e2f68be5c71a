"""Design of a building."""

from dataclasses import dataclass

GARAGE_HEIGHT = 2.5
"""Height of a garage, metres."""
STREET_BALCONY = 1.1
"""Depth of a balcony over the street, metres."""
JOINT = 3e-3
"""Width of the joint between separate solids of a building, metres.

The union of the parts moves a wall by up to 1 mm, and the grid of 1 mm by 0.7 mm on either side. A
narrower joint lets solids overlap, a wider joint is seen.
"""


@dataclass(frozen=True)
class OpeningDesign:
    """Windows or doors of a building: width, height, sill and spacing in metres."""

    width: float
    height: float
    sill: float
    spacing: float


@dataclass(frozen=True)
class Wing:
    """A part of an L-, T- or U-shaped house, joined to the main part.

    Attributes:
        left: Distance of its left side from the house's left side, metres.
        width: Width along the street, metres.
        depth: Depth outside the main part, metres.
        storeys: Number of storeys above ground.
        front: True for a wing towards the street.
    """

    left: float
    width: float
    depth: float
    storeys: int
    front: bool = False


@dataclass(frozen=True)
class Bay:
    """A bay on the street side.

    Attributes:
        width: Along the street, metres.
        depth: Depth outside the wall, metres.
        storeys: Number of storeys from the ground.
    """

    width: float
    depth: float
    storeys: int


@dataclass(frozen=True)
class Chimney:
    """Position of a chimney, as shares of the available range, and its size in metres."""

    along: float
    across: float
    width: float
    height: float


@dataclass(frozen=True)
class Fittings:
    """What is fixed to a house; none by default.

    Attributes:
        shop: True for a shop front on the ground floor.
        awning: True for an awning over the shop front.
        gutters: True for gutters and rainwater pipes on the street side.
        course: True for a course of stone between the two lowest storeys.
        cornice: True for a cornice below the roof.
        dish: True for a satellite dish on the street wall.
        aerial: True for a television aerial on the roof.
        balcony: True for balconies over the street, a column of them.
    """

    shop: bool = False
    awning: bool = False
    gutters: bool = False
    course: bool = False
    cornice: bool = False
    dish: bool = False
    aerial: bool = False
    balcony: bool = False


@dataclass(frozen=True)
class Extras:
    """Features of a house besides walls, windows and a roof; none by default.

    Attributes:
        wings: Wings of an L, T or U.
        bay: Bay on the street side, or `None`.
        dormers: Number on each slope along the street.
        dormer_width: Width of a dormer, metres.
        roof_windows: Number on each slope.
        balconies: True for balconies on the upper storeys.
        porch: True for a roof over the door.
        garage: Width of a garage on the right side, metres; 0 without a garage.
        embrasure: Distance of openings behind the wall's surface, metres.
        fittings: What is fixed to walls and roof.
    """

    wings: tuple[Wing, ...] = ()
    bay: Bay | None = None
    dormers: int = 0
    dormer_width: float = 1.6
    roof_windows: int = 0
    balconies: bool = False
    porch: bool = False
    garage: float = 0.0
    embrasure: float = 0.0
    fittings: Fittings = Fittings()


@dataclass(frozen=True)
class Design:
    """Design of a building; lengths in metres.

    Attributes:
        style: ``row``, ``detached`` or ``hall``.
        function: ``residential`` or ``industrial``.
        width: Width along the street, without a garage.
        depth: Depth from the street, with all wings.
        storeys: Number of storeys above ground.
        storey_height: Height from floor to floor.
        roof: Kind of `RoofSpec`.
        slope: Tangent of the roof's pitch.
        overhang: Width of the roof outside the walls.
        parapet: Height above a flat roof.
        ridge_to_street: True if the ridge is perpendicular to the street.
        plinth: Height of the floor above the ground.
        wall_material: Name in the material library.
        roof_material: Name in the material library.
        windows: Windows of the building.
        doors: Doors of a house, or gates of a hall.
        chimney: Chimney, or `None`.
        extras: Wings, bay, dormers and other features.
        entrance: Position of the paved way along the street side; the house door is as near as
            possible. `None` if the house was moved to the way instead.
        raised: Height of the underside above the ground; 0 for a building that stands on it. What
            is raised has no doors.
        gables: Of a row house: true for the right and the left wall, seen from the street, if it
            has windows.
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
    plinth: float
    wall_material: str
    roof_material: str
    windows: OpeningDesign
    doors: OpeningDesign
    chimney: Chimney | None = None
    extras: Extras = Extras()
    entrance: float | None = None
    raised: float = 0.0
    gables: tuple[bool, bool] = (False, False)

    @property
    def eaves(self) -> float:
        """Height of the main part's walls above the floor."""
        return self.storeys * self.storey_height

    @property
    def main_front(self) -> float:
        """Distance of the main part's street wall from the house's front."""
        return max((wing.depth for wing in self.extras.wings if wing.front), default=0.0)

    @property
    def main_depth(self) -> float:
        """Depth of the main part."""
        behind = max((wing.depth for wing in self.extras.wings if not wing.front), default=0.0)
        return self.depth - self.main_front - behind

    @property
    def garage_left(self) -> float:
        """Distance of the garage's left side from the house's left side.

        It stands a joint away from the house, or clear of eaves that are too low for it.
        """
        storeys = min((wing.storeys for wing in self.extras.wings), default=self.storeys)
        eaves = storeys * self.storey_height - self.overhang * (self.slope + 0.2)
        under_eaves = eaves - GARAGE_HEIGHT > 0.2
        return self.width + JOINT + (0.0 if under_eaves else self.overhang)

    @property
    def outer_width(self) -> float:
        """Width including the garage, metres."""
        garage = self.extras.garage
        return self.garage_left + garage if garage else self.width
