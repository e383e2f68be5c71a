"""Directions of the rows on fields: along the road or the longest border, headlands along ends."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from scipy import ndimage

from envgen_usd.chunks import CELL_SIZE, LANDUSE_CELLS, Chunk
from envgen_usd.geometry.road_outline import Outline
from envgen_usd.landuse.field_lattice import FieldCells
from envgen_usd.landuse.shape_cells import cells_of_shapes
from envgen_usd.models.array_types import BoolArray, ByteArray, FloatArray, IntArray
from envgen_usd.models.landuse import HALF_TURN, ROW_CLASSES, ROW_UNIT, LanduseClass

HEADLAND = 9.0
"""Width of the strip along a field's border where machines turn, metres.

The rows of the headland run along the border; a larger value shortens the rows between.
"""
ALONG = np.radians(5.0)
"""Largest angle between sides that count as one border, radians."""
BENDS = 1.5
"""Largest distance of a border from the polygon that stands for it, metres."""
_TILLED = (LanduseClass.FIELD, LanduseClass.CROP)
"""Classes with headlands; trees of an orchard leave room at its ends."""


def row_codes(directions: FloatArray) -> IntArray:
    """Directions as `LanduseMap.rows` has them.

    Args:
        directions: N x 2, vectors along rows.

    Returns:
        N, hundredths of a degree from +x, counter-clockwise, below a half turn.
    """
    angle = np.arctan2(directions[..., 1], directions[..., 0])
    codes: IntArray = np.round(angle / ROW_UNIT).astype(np.int64) % HALF_TURN
    return codes


def rows_at_roads(fields: FieldCells, classes: ByteArray, outline: Outline) -> IntArray:
    """Rows of generated fields: along the road that is nearest to the middle of the field.

    Args:
        fields: Fields of a chunk.
        classes: 255 x 255, landuse of the chunk.
        outline: Outline of the road.

    Returns:
        255 x 255, as `LanduseMap.rows`.
    """
    has_rows = np.isin(classes, ROW_CLASSES)
    if not has_rows.any():
        return np.zeros(classes.shape, np.int64)
    codes = np.zeros(len(fields.middles), np.int64)
    used = np.unique(fields.own[has_rows])
    distance, foot = outline.nearest(fields.middles[used])
    known = used[np.isfinite(distance) & (distance > 0.0)]
    towards = foot[np.isfinite(distance) & (distance > 0.0), :2] - fields.middles[known]
    codes[known] = row_codes(_across(towards))
    rows = codes[fields.own]
    at_end = np.isin(classes, _TILLED) & (fields.margin < HEADLAND)
    rows[at_end] = row_codes(_across(fields.across[at_end]))
    rows[~has_rows] = 0
    return rows


@dataclass(frozen=True)
class FieldPieces:
    """Fields of a map, between roads, water and other land.

    Attributes:
        shapes: Polygons, metres.
        codes: Direction of the rows of each, as `LanduseMap.rows`.
        tree: The polygons by place.
    """

    shapes: Sequence[shapely.Polygon]
    codes: IntArray
    tree: shapely.STRtree

    @staticmethod
    def of(shapes: Sequence[shapely.Geometry], classes: Sequence[LanduseClass]) -> "FieldPieces":
        """The fields among shapes of which later ones cover earlier ones.

        Args:
            shapes: Areas and widened lines of a map, in drawing order.
            classes: Class of each.
        """
        tree = shapely.STRtree(shapes)
        pieces: list[shapely.Polygon] = []
        for number in np.flatnonzero(np.isin(classes, ROW_CLASSES)).tolist():
            above = tree.query(shapes[number], predicate="intersects")
            others = [shapes[n] for n in above.tolist() if n > number]
            rest = shapely.difference(shapes[number], shapely.union_all(others))
            parts = shapely.get_parts(shapely.simplify(rest, BENDS)).tolist()
            pieces += [part for part in parts if part.geom_type == "Polygon" and part.area > 1.0]
        codes = np.array([longest_border(piece) for piece in pieces], np.int64)
        return FieldPieces(pieces, codes, shapely.STRtree(pieces))

    def rows(self, chunk: Chunk, classes: ByteArray) -> IntArray:
        """Rows of a chunk, 255 x 255, as `LanduseMap.rows`."""
        near = np.sort(self.tree.query(shapely.box(*chunk.bounds))).tolist()
        rows = np.zeros(classes.shape, np.int64)
        if not near:
            return rows
        around = int(HEADLAND / CELL_SIZE) + 2
        number = cells_of_shapes(chunk, ((self.shapes[n], n + 1) for n in near), around)
        own = np.s_[around : around + LANDUSE_CELLS, around : around + LANDUSE_CELLS]
        is_field = (number[own] > 0) & np.isin(classes, ROW_CLASSES)
        rows[is_field] = self.codes[number[own][is_field] - 1]
        tilled = is_field & np.isin(classes, _TILLED)
        self._add_headlands(rows, tilled & _near_border(number, around)[own], number[own], chunk)
        return rows

    def _add_headlands(
        self, rows: IntArray, cells: BoolArray, number: IntArray, chunk: Chunk
    ) -> None:
        """Turns the rows of cells that are near the border of their field."""
        x, y = np.meshgrid(*chunk.cell_centres())
        for piece in np.unique(number[cells]).tolist():
            here = np.nonzero(cells & (number == piece))
            points = shapely.points(x[here], y[here])
            ends = _sides(self.shapes[piece - 1])
            pairs, distance = shapely.STRtree(shapely.linestrings(ends)).query_nearest(
                points, max_distance=HEADLAND, return_distance=True, all_matches=False
            )
            point, side = pairs[:, distance < HEADLAND]
            turned = row_codes(ends[side, 1] - ends[side, 0])
            rows[here[0][point], here[1][point]] = turned


def longest_border(field: shapely.Polygon) -> int:
    """Direction of the longest border of a field, as in `LanduseMap.rows`.

    Sides of about one direction count together, as borders bend.
    """
    step = np.diff(_sides(field), axis=1)[:, 0]
    length = np.linalg.norm(step, axis=1)
    # Twice the angle makes both directions of a side one.
    double = 2.0 * np.arctan2(step[:, 1], step[:, 0])
    apart = np.abs(np.angle(np.exp(1j * (double[:, None] - double))))
    alike = apart <= 2.0 * ALONG
    best = int(np.argmax(alike @ length))
    mean = np.sum(length[alike[best]] * np.exp(1j * double[alike[best]]))
    half = np.angle(mean) / 2.0
    return int(row_codes(np.array([np.cos(half), np.sin(half)])))


def _sides(field: shapely.Polygon) -> FloatArray:
    """Sides of all rings of a polygon, N x 2 x 2, metres."""
    rings = [np.array(ring.coords)[:, :2] for ring in (field.exterior, *field.interiors)]
    return np.concatenate([np.stack([ring[:-1], ring[1:]], axis=1) for ring in rings])


def _near_border(number: IntArray, width: int) -> BoolArray:
    """True for cells within a number of cells of those of another field."""
    size = 2 * width + 1
    low, high = (pick(number, size) for pick in (ndimage.minimum_filter, ndimage.maximum_filter))
    near: BoolArray = low != high
    return near


def _across(vectors: FloatArray) -> FloatArray:
    """Vectors (... x 2), turned by a quarter."""
    return np.stack([-vectors[..., 1], vectors[..., 0]], axis=-1)
