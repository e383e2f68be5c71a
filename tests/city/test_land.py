"""Landuse and relief: they cover the chunk once, and follow the ground."""

import numpy as np
import pytest
from lxml import etree

from envgen_usd.chunks import Chunk
from envgen_usd.city.land_features import make_land
from envgen_usd.citygml.read import read_city
from envgen_usd.citygml.write import write_city
from envgen_usd.environment_files import read_profile
from envgen_usd.geometry.polygon_triangles import triangulate
from envgen_usd.models.city_model import City
from envgen_usd.models.ground import GroundMesh
from envgen_usd.models.landuse import LanduseClass, LanduseMap

SIDE = 20


def make_ground(height):
    """Quads of 10 m over a chunk; two triangles in the first."""
    axis = np.linspace(0.0, 200.0, SIDE + 1)
    x, y = np.meshgrid(axis, axis)
    z = np.round(height(x, y), 3)
    vertices = np.column_stack([x.ravel(), y.ravel(), z.ravel()])
    row, column = np.divmod(np.arange(SIDE * SIDE), SIDE)
    low = row * (SIDE + 1) + column
    quads = np.stack([low, low + 1, low + SIDE + 2, low + SIDE + 1], axis=1)
    first = quads[0]
    corners = np.concatenate([first[[0, 1, 2]], first[[0, 2, 3]], quads[1:].ravel()])
    sizes = np.array([3, 3] + [4] * (len(quads) - 1))
    cell = ((row * 10 + 5) * 255 // 200) * 255 + (column * 10 + 5) * 255 // 200
    return GroundMesh(Chunk(0, 0), vertices, sizes, corners, np.concatenate([cell[:1], cell]))


@pytest.fixture
def landuse():
    classes = np.full((255, 255), LanduseClass.GRASS, dtype=np.uint8)
    classes[:, 128:] = LanduseClass.WOOD
    return LanduseMap(Chunk(0, 0), classes, np.zeros((255, 255), dtype=np.int64))


def area_in_plan(polygons):
    corners = polygons.points[triangulate(polygons)[0]][:, :, :2]
    one, two = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return float((one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]).sum() / 2)


@pytest.mark.parametrize("bent", [False, True])
def test_land_covers_the_chunk_once(landuse, tmp_path, shared, bent):
    ground = make_ground(lambda x, y: 0.01 * x + (3 * np.sin(y / 30) if bent else 0 * y))
    land = make_land(ground, landuse, read_profile("1", "residential"))
    *uses, relief = land
    assert [use.attributes["class"] for use in uses] == ["grass", "wood"]
    assert [use.attributes["material"] for use in uses] == ["grass", "forest_floor"]
    shapes = [use.geometry["lod3MultiSurface"] for use in uses]
    assert sum(map(area_in_plan, shapes)) == pytest.approx(40_000)
    # What is flat is one polygon.
    assert [len(shape) == 1 for shape in shapes] == [not bent, not bent]
    (tin,) = relief.children
    assert area_in_plan(tin.geometry["tin"]) == pytest.approx(40_000)
    corners = tin.geometry["tin"].points
    assert {tuple(p) for p in corners.tolist()} <= {tuple(p) for p in ground.vertices.tolist()}
    write_city(City(land), tmp_path / "land.gml")
    schema = etree.XMLSchema(etree.parse(str(shared / "citygml-xsd" / "citygml-3.0.xsd")))
    assert schema.validate(etree.parse(str(tmp_path / "land.gml"))), schema.error_log
    back = read_city(tmp_path / "land.gml").of_kind("TINRelief")[0]
    np.testing.assert_array_equal(back.geometry["tin"].points, corners)
