"""Rows of fields: along roads and longest borders, with headlands along the other borders."""

import numpy as np
import pytest
import shapely

from envgen_usd.chunks import CELL_SIZE, LANDUSE_CELLS, Chunk
from envgen_usd.geometry.road_outline import Outline
from envgen_usd.landuse.field_lattice import fields_of
from envgen_usd.landuse.field_rows import (
    HEADLAND,
    FieldPieces,
    longest_border,
    row_codes,
    rows_at_roads,
)
from envgen_usd.models.landuse import ROW_UNIT, LanduseClass

CHUNK = Chunk(0, 0)
FIELD, CROP, WATER = LanduseClass.FIELD, LanduseClass.CROP, LanduseClass.WATER
SHAPE = (LANDUSE_CELLS, LANDUSE_CELLS)


def degrees(rows):
    return rows * np.degrees(ROW_UNIT)


def turned_box(width, depth, angle, middle=(100.0, 100.0)):
    box = shapely.box(-width / 2, -depth / 2, width / 2, depth / 2)
    turned = shapely.affinity.rotate(box, angle, origin=(0.0, 0.0))
    return shapely.affinity.translate(turned, *middle)


@pytest.mark.parametrize("angle", [0.0, 17.0, 90.0, 133.0, 179.9])
def test_directions_are_hundredths_of_a_degree(angle):
    vector = np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle))])
    assert row_codes(vector) == row_codes(-vector) == round(100 * angle) % 18_000


@pytest.mark.parametrize("angle", [0.0, 25.0, 110.0])
def test_the_longest_border_decides_even_where_it_bends(angle):
    assert longest_border(turned_box(90.0, 40.0, angle)) == pytest.approx(100 * angle, abs=1)
    # Two sides of 50 m that differ by 4 degrees are longer than one of 70 m.
    corners = np.array([[0, 0], [50, 0], [99.9, 3.5], [99.9, 73.5], [0, 73.5]])
    bent = shapely.affinity.rotate(shapely.Polygon(corners), angle, origin=(0.0, 0.0))
    assert longest_border(bent) == pytest.approx(100 * (angle + 1.0), abs=150)


def test_rows_run_along_the_longest_border_and_headlands_along_the_ends():
    field = turned_box(120.0, 60.0, 30.0)
    pieces = FieldPieces.of([field], [FIELD])
    classes = np.full(SHAPE, LanduseClass.GRASS, np.uint8)
    x, y = np.meshgrid(*CHUNK.cell_centres())
    inside = shapely.contains_xy(field, x, y)
    classes[inside] = FIELD
    rows = pieces.rows(CHUNK, classes)
    assert not rows[~inside].any()
    local = shapely.affinity.rotate(field, -30.0, origin=(100.0, 100.0))
    x0, y0, x1, y1 = local.bounds
    turn = np.radians(-30.0)
    u = (x - 100.0) * np.cos(turn) - (y - 100.0) * np.sin(turn) + 100.0
    v = (x - 100.0) * np.sin(turn) + (y - 100.0) * np.cos(turn) + 100.0
    end, side = np.minimum(u - x0, x1 - u), np.minimum(v - y0, y1 - v)
    between = inside & (end > HEADLAND + CELL_SIZE)
    assert np.abs(degrees(rows[between]) - 30.0).max() < 0.02
    headland = inside & (end < HEADLAND - CELL_SIZE) & (end < side - CELL_SIZE)
    assert headland.sum() * CELL_SIZE**2 > 300.0
    assert np.abs(degrees(rows[headland]) - 120.0).max() < 0.02


def test_what_lies_on_a_field_divides_it():
    """A stream cuts a field into two, whose longest borders differ."""
    field = shapely.Polygon([(20, 20), (180, 20), (180, 60), (30, 190), (20, 190)])
    stream = shapely.LineString([(0, 70), (200, 70)]).buffer(3.0)
    pieces = FieldPieces.of([field, stream], [FIELD, WATER])
    assert len(pieces.shapes) == 2
    low, high = sorted(pieces.shapes, key=lambda piece: piece.centroid.y)
    codes = dict(zip(map(id, pieces.shapes), pieces.codes.tolist(), strict=True))
    assert degrees(codes[id(low)]) == pytest.approx(0.0, abs=0.1)
    assert degrees(codes[id(high)]) == pytest.approx(139.1, abs=1.0)


def test_rows_agree_across_chunks():
    field = turned_box(300.0, 90.0, 12.0, (200.0, 100.0))
    pieces = FieldPieces.of([field], [CROP])
    classes = np.full(SHAPE, CROP, np.uint8)
    west, east = pieces.rows(Chunk(0, 0), classes), pieces.rows(Chunk(1, 0), classes)
    assert np.mean(west[:, -1] == east[:, 0]) > 0.97
    assert degrees(west[120, -1]) == pytest.approx(12.0, abs=0.02)


def test_generated_rows_run_along_the_nearest_road_and_borders_have_headlands():
    fields = fields_of(CHUNK, 3)
    classes = np.full(SHAPE, CROP, np.uint8)
    # A road along 40 degrees, far to the south-east.
    along = np.array([np.cos(np.radians(40.0)), np.sin(np.radians(40.0))])
    start = np.array([100.0, 100.0]) + 400.0 * np.array([along[1], -along[0]])
    line = np.stack([start + t * along for t in np.linspace(-900.0, 900.0, 61)])
    points = np.column_stack([line, np.zeros(len(line))])
    outline = Outline(points[:-1], points[1:])
    rows = rows_at_roads(fields, classes, outline)
    inner = fields.margin > HEADLAND
    assert np.abs(degrees(rows[inner]) - 40.0).max() < 0.5
    border = row_codes(np.stack([-fields.across[..., 1], fields.across[..., 0]], axis=-1))
    np.testing.assert_array_equal(rows[~inner], border[~inner])
    orchard = rows_at_roads(fields, np.full(SHAPE, LanduseClass.ORCHARD, np.uint8), outline)
    assert np.abs(degrees(orchard) - 40.0).max() < 0.5
    assert not rows_at_roads(fields, np.full(SHAPE, LanduseClass.LAWN, np.uint8), outline).any()
