"""What the land beside the road is used for: as a raster and as plots."""

from dataclasses import dataclass
from enum import IntEnum

from envgen_usd.chunks import Chunk
from envgen_usd.models.arrays import ByteArray, FloatArray, IntArray


class LanduseClass(IntEnum):
    """Classes of a landuse cell. `UNKNOWN` is the hole that a network fills; `ROAD` is given."""

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
    """Paved way from the road to a building."""
    WOOD = 7
    """Ground under dense trees."""


@dataclass(frozen=True)
class LanduseMap:
    """Landuse of one chunk.

    Attributes:
        chunk: The tile.
        classes: 255 x 255 `LanduseClass` values; row j, column i is the cell whose centre is
            ``(chunk.cell_centres()[0][i], chunk.cell_centres()[1][j])``, so row 0 is the south.
        plots: 255 x 255, number of the plot that a cell belongs to, 0 where it belongs to none.
            Numbers are unique over the map: a plot that crosses a border has one number.
    """

    chunk: Chunk
    classes: ByteArray
    plots: IntArray


@dataclass(frozen=True)
class Plot:
    """A piece of land for one building or one use.

    Attributes:
        id: Stable and unique, an NCName.
        polygon: N x 2, counter-clockwise, not closed, metres, road frame.
        landuse: Class of its ground.
        frontage: 2 x 2, the side that faces the street; the plot lies to the left of the line
            from the first point to the second.
        road: OpenDRIVE id of the road that it faces.
        access: 2, where the paved way from the street crosses the frontage, metres; or none.
    """

    id: str
    polygon: FloatArray
    landuse: LanduseClass
    frontage: FloatArray
    road: str = ""
    access: FloatArray | None = None
