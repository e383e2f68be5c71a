"""Walls between land and water: their label, material and texture, and their place in CityGML."""

import numpy as np
import pytest
import shapely
from lxml import etree
from pxr import Usd, UsdGeom, UsdSemantics
from tests.terrain.test_water import BASIN, CHUNKS, RULES, flat, land, landuse, walls

from envgen_usd.assets.asset_catalogue import read_catalogue
from envgen_usd.city.land_features import make_land
from envgen_usd.citygml.write import write_city
from envgen_usd.environment_files import read_profile
from envgen_usd.geometry.road_outline import Outline
from envgen_usd.layers.landuse_layer import write_landuse
from envgen_usd.layers.terrain_layer import write_terrain
from envgen_usd.layers.wall_uv import wall_uv
from envgen_usd.models.city_model import City
from envgen_usd.models.landuse import LanduseClass
from envgen_usd.models.road_surface import RoadSurface
from envgen_usd.terrain.ground_mesh import build_ground
from envgen_usd.terrain.water_levels import lower_water


@pytest.fixture(scope="module")
def harbour():
    """Ground and landuse of a chunk with a part of a basin."""
    shapes = [(BASIN.buffer(9.0), LanduseClass.QUAY), (BASIN, LanduseClass.WATER)]
    maps = landuse(shapes)
    none = np.empty(0, np.int64)
    road = RoadSurface(np.empty((0, 3)), none.reshape(0, 3), none, none, (), (), (), ())
    chunk = CHUNKS[0]
    heightmap = lower_water(land(flat), maps, RULES)[chunk]
    return build_ground(heightmap, Outline.of(road), maps[chunk]), maps[chunk]


def test_walls_are_labelled_and_of_their_own_material(harbour, tmp_path):
    ground, map_ = harbour
    write_terrain(ground, tmp_path / "terrain.usdc")
    profile = read_profile("1", "harbour")
    write_landuse(ground, map_, profile, read_catalogue(), tmp_path / "landuse.usdc")
    stage = Usd.Stage.Open(str(tmp_path / "terrain.usdc"))
    stage.GetRootLayer().subLayerPaths.append("./landuse.usdc")
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath("/Terrain/Ground"))
    ok, why = UsdGeom.Subset.ValidateFamily(mesh, UsdGeom.Tokens.face, "materialBind")
    assert ok, why
    prim = stage.GetPrimAtPath("/Terrain/Ground/quay_wall")
    query = UsdSemantics.LabelsQuery("class", Usd.TimeCode.Default())
    assert set(query.ComputeUniqueDirectLabels(prim)) == {"wall"}
    faces = np.array(UsdGeom.Subset(prim).GetIndicesAttr().Get())
    np.testing.assert_array_equal(faces, np.flatnonzero(ground.is_wall))
    (base,) = prim.GetMetadata("inheritPaths").GetAddedOrExplicitItems()
    assert base.name == profile.ground_materials["quay_wall"]
    # Walls are shaded as upright, and the quay above them as level.
    normals = np.asarray(mesh.GetNormalsAttr().Get())
    of_wall = np.repeat(ground.is_wall, ground.face_sizes)
    upright = normals[ground.face_vertices[of_wall], 2]
    assert np.abs(upright).max() < 1e-6
    assert normals[ground.face_vertices[~of_wall], 2].min() > 0.999


def test_textures_of_walls_are_as_long_as_the_walls_and_run_on_from_face_to_face(harbour):
    ground, _ = harbour
    uv, (corners, face) = wall_uv(ground), walls(ground)
    places: dict[tuple[float, ...], set[float]] = {}
    for number in range(face.max() + 1):
        wall, texture = corners[face == number], uv[face == number]
        length = np.hypot(*(wall[1] - wall[0])[:2])
        assert abs(texture[1, 0] - texture[0, 0]) == pytest.approx(length, abs=1e-6)
        np.testing.assert_allclose(texture[:, 1], wall[:, 2])
        for place, u in zip(wall[:2].tolist(), texture[:2, 0].tolist(), strict=True):
            places.setdefault(tuple(place), set()).add(round(u, 3))
    assert max(np.ptp(list(of_place)) for of_place in places.values()) < 0.002


def test_walls_are_a_landuse_of_the_city_model_and_part_of_the_relief(harbour, tmp_path, shared):
    ground, map_ = harbour
    *uses, relief = make_land(ground, map_, read_profile("1", "harbour"))
    wall = next(use for use in uses if use.attributes["class"] == "quay_wall")
    assert wall.attributes["material"] == "concrete"
    corners = wall.geometry["lod3MultiSurface"].points
    np.testing.assert_allclose(np.unique(corners[:, 2]), [4.6, 7.0], atol=1e-9)
    beside = shapely.distance(BASIN.boundary, shapely.points(corners[:, :2]))
    assert beside.max() < 0.8
    (tin,) = relief.children
    known = {tuple(place) for place in tin.geometry["tin"].points.tolist()}
    assert {tuple(place) for place in corners.tolist()} <= known
    write_city(City((*uses, relief)), tmp_path / "land.gml")
    schema = etree.XMLSchema(etree.parse(str(shared / "citygml-xsd" / "citygml-3.0.xsd")))
    assert schema.validate(etree.parse(str(tmp_path / "land.gml"))), schema.error_log
