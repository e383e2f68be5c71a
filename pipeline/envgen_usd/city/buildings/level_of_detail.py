"""Levels of detail: the sixteen refined levels of Biljecki, Ledoux and Stoter.

"An improved LOD specification for 3D building models", Computers, Environment and Urban Systems 59,
2016. The number before the point is the LoD of CityGML, and the number after it grades the modelled
content.
"""

from dataclasses import dataclass, replace

from envgen_usd.city.buildings.building_design import Design, Extras, Fittings
from envgen_usd.errors import EnvgenError


@dataclass(frozen=True)
class Level:
    """Modelled content of a building.

    Attributes:
        name: E.g. ``2.1``.
        lod: LoD of CityGML.
        wings: Wings and garages; otherwise their bounding rectangle.
        small: Bays.
        heights: LoD0: roof edges beside the footprint; LoD1: a separate height for each part.
        attic: Chimneys and dormers.
        overhangs: Roof overhangs.
        roof_openings: Windows of roofs and dormers.
        openings: Windows and doors of walls.
        fine: Embrasures, balconies, steps, porches, what is fixed to walls and roof.
    """

    name: str
    lod: int
    wings: bool = False
    small: bool = False
    heights: bool = False
    attic: bool = False
    overhangs: bool = False
    roof_openings: bool = False
    openings: bool = False
    fine: bool = False

    def simplify(self, design: Design) -> Design:
        """Returns the design without the content that this level omits."""
        extras = design.extras
        extras = Extras(
            wings=extras.wings if self.wings else (),
            bay=extras.bay if self.small else None,
            dormers=extras.dormers if self.attic else 0,
            dormer_width=extras.dormer_width,
            roof_windows=extras.roof_windows if self.roof_openings else 0,
            balconies=extras.balconies and self.fine,
            porch=extras.porch and self.fine,
            garage=extras.garage if self.wings else 0.0,
            embrasure=extras.embrasure if self.fine else 0.0,
            fittings=extras.fittings if self.fine else _openings_of(extras.fittings),
        )
        return replace(
            design,
            overhang=design.overhang if self.overhangs else 0.0,
            parapet=design.parapet if self.attic else 0.0,
            chimney=design.chimney if self.attic else None,
            extras=extras,
        )


def _openings_of(fittings: Fittings) -> Fittings:
    """What changes the windows and doors of a house."""
    return Fittings(shop=fittings.shop, balcony=fittings.balcony)


_PARTS = {"wings": True, "small": True}
_ROOF = {**_PARTS, "attic": True}
LEVELS: dict[str, Level] = {
    level.name: level
    for level in (
        Level("0.0", 0),
        Level("0.1", 0, wings=True),
        Level("0.2", 0, **_PARTS),
        Level("0.3", 0, heights=True, **_PARTS),
        Level("1.0", 1),
        Level("1.1", 1, wings=True),
        Level("1.2", 1, **_PARTS),
        Level("1.3", 1, heights=True, **_PARTS),
        Level("2.0", 2),
        Level("2.1", 2, wings=True),
        Level("2.2", 2, **_ROOF),
        Level("2.3", 2, overhangs=True, **_ROOF),
        Level("3.0", 3, overhangs=True, roof_openings=True, **_ROOF),
        Level("3.1", 3, openings=True, **_ROOF),
        Level("3.2", 3, overhangs=True, roof_openings=True, openings=True, **_ROOF),
        Level("3.3", 3, overhangs=True, roof_openings=True, openings=True, fine=True, **_ROOF),
    )
}
"""All levels by name, in increasing order."""
FINEST = LEVELS["3.3"]


def level_of(name: str) -> Level:
    """Returns a level by its name.

    Raises:
        EnvgenError: The level does not exist.
    """
    if name not in LEVELS:
        raise EnvgenError(f"'{name}' is not a level of detail; known: {', '.join(LEVELS)}")
    return LEVELS[name]


@dataclass(frozen=True)
class Modelling:
    """Options of a building model.

    Attributes:
        level: The finest level.
        lower: True to add footprint (LoD0) and block (LoD1).
        lod1_top: Height of the block as a share of the roof, 0 at the eaves, 1 at the ridge.
        rooms: True to add a room for each storey.
    """

    level: Level = FINEST
    lower: bool = True
    lod1_top: float = 0.5
    rooms: bool = False


FINEST_MODELLING = Modelling()
"""All content of LoD3.3, with footprint and block."""
