"""What one building looks like."""

from dataclasses import dataclass

GARAGE_HEIGHT = 2.5
"""Metres."""


@dataclass(frozen=True)
class OpeningDesign:
    """Windows or doors of one building: width, height, sill and spacing in metres."""

    width: float
    height: float
    sill: float
    spacing: float


@dataclass(frozen=True)
class Wing:
    """A part of an L-, T- or U-shaped house; it reaches into the main part.

    Attributes:
        left: Distance of its left side from the house's left side, metres.
        width: Along the street.
        depth: How far it stands out of the main part.
        storeys: Above ground.
        front: True if it stands out towards the street.
    """

    left: float
    width: float
    depth: float
    storeys: int
    front: bool = False


@dataclass(frozen=True)
class Bay:
    """A bay at the street.

    Attributes:
        width: Along the street, metres.
        depth: How far it stands out.
        storeys: How many storeys it has, from the ground.
    """

    width: float
    depth: float
    storeys: int


@dataclass(frozen=True)
class Chimney:
    """Where a chimney stands, as shares of the room that there is, and its size in metres."""

    along: float
    across: float
    width: float
    height: float


@dataclass(frozen=True)
class Extras:
    """What a house has besides walls, windows and a roof; the default is nothing.

    Attributes:
        wings: Parts of an L, T or U.
        bay: At the street, or none.
        dormers: On each slope along the street.
        dormer_width: Metres.
        roof_windows: On each slope.
        balconies: True if upper storeys have some.
        porch: True if there is a roof over the door.
        garage: Width of a garage on the right side, 0 for none.
        embrasure: How far openings lie behind the wall, metres.
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


@dataclass(frozen=True)
class Design:
    """One building; lengths in metres.

    Attributes:
        style: ``row``, ``detached`` or ``hall``.
        function: ``residential`` or ``industrial``.
        width: Along the street, without a garage.
        depth: Away from the street, with all wings.
        storeys: Above ground.
        storey_height: From floor to floor.
        roof: A kind of `RoofSpec`.
        slope: Tangent of the roof's pitch.
        overhang: Beyond the walls.
        parapet: Height above a flat roof.
        ridge_to_street: True where the ridge runs away from the street.
        plinth: Height of the floor above the ground.
        wall_material: Name in the material library.
        roof_material: Name in the material library.
        windows: Windows.
        doors: Doors, or gates of a hall.
        chimney: Or none.
        extras: What it has besides.
        entrance: Where along the street side a paved way leads to it; the house door is as near as
            it can be. None where the house has been moved to the way instead.
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

        It stands against the house, or beside the eaves where these are too low for it.
        """
        storeys = min((wing.storeys for wing in self.extras.wings), default=self.storeys)
        eaves = storeys * self.storey_height - self.overhang * (self.slope + 0.2)
        under_eaves = eaves - GARAGE_HEIGHT > 0.2
        return self.width + 0.002 + (0.0 if under_eaves else self.overhang)

    @property
    def outer_width(self) -> float:
        """Width with a garage."""
        garage = self.extras.garage
        return self.garage_left + garage if garage else self.width
