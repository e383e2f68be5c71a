"""Landuse beside the road, as a raster and as plots."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from envgen_usd.chunks import Chunk
from envgen_usd.models.array_types import ByteArray, FloatArray, IntArray
from envgen_usd.models.frozen_model import Model


class LanduseClass(IntEnum):
    """Landuse class of a cell. A network fills `UNKNOWN` cells; the road file gives `ROAD`."""

    UNKNOWN = 0
    ROAD = 1
    GRASS = 2
    """General ground of the environment."""
    VERGE = 3
    """Strip between the road and the plots."""
    LAWN = 4
    """Ground of a residential plot."""
    RUBBLE = 5
    """Ground of an industrial plot."""
    ACCESS = 6
    """Paved path from the road to a building."""
    WOOD = 7
    """Ground under dense trees."""
    PARK = 8
    """Ground of a small park."""
    PARKING = 9
    """Paved ground of a car park, or of a court with garages."""
    ALLOTMENT = 10
    """Ground of allotment gardens."""
    FIELD = 11
    """Tilled land."""
    WATER = 12
    """Water of a map, and basins of generated harbours."""
    RAIL = 13
    """Bed of a railway of a map; given like the road and never generated."""
    SCHOOL = 14
    """Ground of a school."""
    SHOP = 15
    """Paved ground of a shop behind its car park."""
    GARAGES = 16
    """Paved court with a row of garages."""
    CROP = 17
    """Sown land, in rows; vineyards of a map."""
    ORCHARD = 18
    """Grass under fruit trees in a grid."""
    SQUARE = 19
    """Paved ground of a town square, for people on foot."""
    QUAY = 20
    """Paved ground of a harbour: quays, piers and yards."""
    ROAD_END = 21
    """Paved way that goes on where a road of the file ends."""


STAND_INS: Mapping[LanduseClass, LanduseClass] = {
    LanduseClass.PARK: LanduseClass.GRASS,
    LanduseClass.PARKING: LanduseClass.ACCESS,
    LanduseClass.ALLOTMENT: LanduseClass.LAWN,
    LanduseClass.FIELD: LanduseClass.GRASS,
    LanduseClass.WATER: LanduseClass.GRASS,
    LanduseClass.RAIL: LanduseClass.RUBBLE,
    LanduseClass.SCHOOL: LanduseClass.LAWN,
    LanduseClass.SHOP: LanduseClass.ACCESS,
    LanduseClass.GARAGES: LanduseClass.ACCESS,
    LanduseClass.CROP: LanduseClass.GRASS,
    LanduseClass.ORCHARD: LanduseClass.GRASS,
    LanduseClass.SQUARE: LanduseClass.ACCESS,
    LanduseClass.QUAY: LanduseClass.PARKING,
    LanduseClass.ROAD_END: LanduseClass.ACCESS,
}
"""Classes whose material another class takes in environments that name none for it."""
QUAY_WALL = "quay_wall"
"""Name of walls between land and water, which are no class of a cell, in environments and files."""
WALL_MATERIAL = "concrete"
"""Material of these walls in environments that name none."""
BUILT_USES = frozenset((LanduseClass.SCHOOL, LanduseClass.SHOP, LanduseClass.GARAGES))
"""Classes of whole plots with a building of their own kind."""
ROW_CLASSES = (
    LanduseClass.FIELD,
    LanduseClass.CROP,
    LanduseClass.ORCHARD,
    LanduseClass.QUAY,
)
"""Classes whose land lies in rows; containers stand in those of a harbour."""
HALF_TURN = 18_000
"""Directions of rows lie below this one."""
ROW_UNIT = np.pi / HALF_TURN
"""Unit of the direction of rows, radians."""
OPEN_USES = frozenset(STAND_INS) - BUILT_USES
"""Classes of plots that hold no main building."""


@dataclass(frozen=True, repr=False, eq=False)
class LanduseMap(Model):
    """Landuse of a chunk.

    Attributes:
        chunk: The tile.
        classes: 255 x 255 `LanduseClass` values. Row j, column i is the cell with its centre at
            ``(chunk.cell_centres()[0][i], chunk.cell_centres()[1][j])``; row 0 is the south.
        plots: 255 x 255, number of each cell's plot; 0 outside plots. A number is unique over the
            map, also for a plot across a chunk border.
        rows: 255 x 255, direction of the rows of fields and orchards (`ROW_CLASSES`): hundredths of
            a degree from +x, counter-clockwise, 0 to 17,999. `None`: all rows run along x.
    """

    chunk: Chunk
    classes: ByteArray
    plots: IntArray
    rows: IntArray | None = None

    def looks(self) -> IntArray:
        """Numbers that differ where class or rows differ, 255 x 255; smaller for lower classes."""
        rows = 0 if self.rows is None else self.rows
        return self.classes.astype(np.int64) * HALF_TURN + rows


@dataclass(frozen=True, repr=False, eq=False)
class Plot(Model):
    """A plot of land for a building or another use.

    Attributes:
        id: Stable and unique, an NCName.
        polygon: N x 2, counter-clockwise, not closed, metres, road frame.
        landuse: Class of its ground.
        frontage: 2 x 2, the side that faces the street; the plot lies to the left of the line
            from the first point to the second.
        road: OpenDRIVE id of the road that it faces.
        side: Side of that road, ``left`` or ``right`` as s increases; empty without a road.
        access: 2, where the paved way from the street crosses the frontage, metres; or none.
    """

    id: str
    polygon: FloatArray
    landuse: LanduseClass
    frontage: FloatArray
    road: str = ""
    access: FloatArray | None = None
    side: str = ""
