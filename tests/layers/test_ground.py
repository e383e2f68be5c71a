"""Terrain and landuse layers of one chunk."""

from dataclasses import replace

import numpy as np
import pytest
from pxr import Sdf, Usd, UsdGeom, UsdSemantics, UsdShade

from envgen_usd.chunks import Chunk
from envgen_usd.errors import EnvgenError
from envgen_usd.layers.landuse_layer import write_landuse
from envgen_usd.layers.terrain_layer import write_terrain
from envgen_usd.models.landuse import LanduseClass, LanduseMap


@pytest.fixture
def stage(stage_file):
    return Usd.Stage.Open(str(stage_file))


def mesh(stage, chunk="chunk_0_0"):
    return UsdGeom.Mesh(stage.GetPrimAtPath(f"/World/{chunk}/Terrain/Ground"))


def test_ground_keeps_its_faces(stage, make):
    expected = make.ground(Chunk(0, 0))
    found = mesh(stage)
    np.testing.assert_allclose(found.GetPointsAttr().Get(), expected.vertices, atol=1e-5)
    np.testing.assert_array_equal(found.GetFaceVertexIndicesAttr().Get(), expected.face_vertices)
    np.testing.assert_array_equal(found.GetFaceVertexCountsAttr().Get(), expected.face_sizes)
    normals = np.asarray(found.GetNormalsAttr().Get())
    assert (normals[:, 2] > 0.9).all()


def test_points_far_from_the_origin_keep_their_precision(tmp_path, make):
    """At UTM distances float32 alone would round to half a metre."""
    ground = make.ground(Chunk(2500, 27000))
    write_terrain(ground, tmp_path / "terrain.usdc")
    layer = Sdf.Layer.OpenAsAnonymous(str(tmp_path / "terrain.usdc"))
    points = np.asarray(layer.GetAttributeAtPath("/Terrain/Ground.points").default, float)
    expected = ground.vertices - [2500 * 200.0, 27000 * 200.0, 0.0]
    np.testing.assert_allclose(points, expected, atol=1e-4)


def test_subsets_partition_the_faces_by_class(stage, make):
    chunk = Chunk(0, 0)
    found = mesh(stage)
    subsets = UsdShade.MaterialBindingAPI(found).GetMaterialBindSubsets()
    names = {subset.GetPrim().GetName() for subset in subsets}
    assert names == {"grass", "verge", "lawn", "rubble"}
    ok, why = UsdGeom.Subset.ValidateFamily(found, UsdGeom.Tokens.face, "materialBind")
    assert ok, why
    classes = make.landuse(chunk).classes.ravel()[make.ground(chunk).face_cell]
    for subset in subsets:
        value = LanduseClass[subset.GetPrim().GetName().upper()]
        faces = np.flatnonzero(classes == value)
        np.testing.assert_array_equal(subset.GetIndicesAttr().Get(), faces)


def test_paved_ways_are_no_terrain(tmp_path, scene, make):
    """Whoever trains on terrain must not learn paving; all other land is what the ground is.

    The way that goes on where a road ends is road.
    """
    chunk = Chunk(0, 0)
    map_ = make.landuse(chunk)
    classes = map_.classes.copy()
    classes[200:210, 20:40] = LanduseClass.ACCESS
    classes[220:230, 20:40] = LanduseClass.ROAD_END
    classes[0, 0] = LanduseClass.ROAD  # a sliver of ground beside a road that is not there
    map_ = replace(map_, classes=classes)
    write_terrain(make.ground(chunk), tmp_path / "terrain.usdc")
    write_landuse(
        make.ground(chunk), map_, scene.profile, scene.catalogue, tmp_path / "landuse.usdc"
    )
    stage = Usd.Stage.Open(str(tmp_path / "terrain.usdc"))
    stage.GetRootLayer().subLayerPaths.append("./landuse.usdc")
    query = UsdSemantics.LabelsQuery("class", Usd.TimeCode.Default())
    ground = stage.GetPrimAtPath("/Terrain/Ground")
    found = {
        prim.GetName(): set(query.ComputeUniqueDirectLabels(prim)) for prim in ground.GetChildren()
    }
    assert found == {
        "grass": set(),
        "verge": set(),
        "lawn": set(),
        "rubble": set(),
        "access": {"parking"},
        "road_end": {"road"},
    }
    root = stage.GetPrimAtPath("/Terrain")
    assert set(query.ComputeUniqueDirectLabels(root)) == {"terrain"}


def test_a_verge_that_is_paved_as_sidewalks_are_is_sidewalk(tmp_path, scene, make):
    chunk = Chunk(0, 0)
    materials = {**scene.profile.ground_materials, "verge": "paving", "lawn": "paving"}
    paved = replace(scene.profile, ground_materials=materials)
    assert "paving" in paved.road.sidewalk_materials
    write_landuse(
        make.ground(chunk), make.landuse(chunk), paved, scene.catalogue, tmp_path / "land.usdc"
    )
    stage = Usd.Stage.Open(str(tmp_path / "land.usdc"))
    query = UsdSemantics.LabelsQuery("class", Usd.TimeCode.Default())
    verge, lawn = (stage.GetPrimAtPath(f"/Terrain/Ground/{name}") for name in ("verge", "lawn"))
    assert set(query.ComputeUniqueDirectLabels(verge)) == {"sidewalk"}
    assert set(query.ComputeUniqueDirectLabels(lawn)) == set()


def test_material_follows_the_environment(stage, scene):
    lawn = stage.GetPrimAtPath("/World/chunk_0_0/Terrain/Ground/lawn")
    material, _ = UsdShade.MaterialBindingAPI(lawn).ComputeBoundMaterial()
    assert material.GetPrim().GetName() == scene.profile.ground_materials["lawn"]


def corner_values(found):
    """Points and texture coordinates of all corners."""
    index = np.asarray(found.GetFaceVertexIndicesAttr().Get())
    points = np.asarray(found.GetPointsAttr().Get())[index]
    st = UsdGeom.PrimvarsAPI(found).GetPrimvar("st")
    values = np.asarray(st.ComputeFlattened())
    return points, values if st.GetInterpolation() == "faceVarying" else values[index]


def test_texture_has_its_real_size(stage, scene):
    """A material's coordinates advance by one for each `texture_size` metres."""
    found = mesh(stage)
    points, uv = corner_values(found)
    starts = np.cumsum([0, *np.asarray(found.GetFaceVertexCountsAttr().Get())])
    for subset in UsdShade.MaterialBindingAPI(found).GetMaterialBindSubsets():
        material, _ = UsdShade.MaterialBindingAPI(subset.GetPrim()).ComputeBoundMaterial()
        size = scene.catalogue.materials[material.GetPrim().GetName()].size
        face = subset.GetIndicesAttr().Get()[0]
        a, b = starts[face], starts[face] + 2
        np.testing.assert_allclose(
            uv[b] - uv[a], (points[b] - points[a])[:2] / size, rtol=1e-4, atol=1e-4
        )


def test_textures_meet_at_chunk_borders(tmp_path, scene, make):
    """Neighbours' coordinates differ by whole repeats along their border."""
    borders = []
    for chunk, side in ((Chunk(0, 0), 200.0), (Chunk(1, 0), 0.0)):
        map_ = LanduseMap(chunk, np.full((255, 255), 2, np.uint8), np.zeros((255, 255), int))
        folder = tmp_path / chunk.name
        write_terrain(make.ground(chunk), folder / "terrain.usdc")
        write_landuse(
            make.ground(chunk), map_, scene.profile, scene.catalogue, folder / "landuse.usdc"
        )
        ground, look = (
            Sdf.Layer.OpenAsAnonymous(str(folder / f"{name}.usdc"))
            for name in ("terrain", "landuse")
        )
        points = np.asarray(ground.GetAttributeAtPath("/Terrain/Ground.points").default)
        uv = np.asarray(look.GetAttributeAtPath("/Terrain/Ground.primvars:st").default)
        border = np.isclose(points[:, 0], side)
        order = np.argsort(points[border, 1], kind="stable")
        borders.append(uv[border][order])
    apart = borders[0] - borders[1]
    np.testing.assert_allclose(apart, np.round(apart), atol=1e-4)


def test_landuse_holds_no_geometry(stage_file):
    path = stage_file.parent / "chunks/0_0/landuse.usdc"
    text = Sdf.Layer.OpenAsAnonymous(str(path)).ExportToString()
    assert "points" not in text
    assert "faceVertexIndices" not in text


def test_unknown_material_is_named(tmp_path, scene, make):
    chunk = Chunk(0, 0)
    wrong = replace(
        scene.profile, ground_materials={**scene.profile.ground_materials, "lawn": "mud"}
    )
    with pytest.raises(EnvgenError, match=r"environment 1/residential, .*unknown material 'mud'"):
        write_landuse(
            make.ground(chunk), make.landuse(chunk), wrong, scene.catalogue, tmp_path / "l.usdc"
        )
    lacking = replace(scene.profile, ground_materials={"grass": "grass"})
    with pytest.raises(EnvgenError, match="ground_materials lacks"):
        write_landuse(
            make.ground(chunk), make.landuse(chunk), lacking, scene.catalogue, tmp_path / "l.usdc"
        )
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("degrees", [30.0, 150.0])
def test_textures_of_fields_lie_along_their_rows_and_go_on_in_the_next_chunk(
    tmp_path, scene, make, degrees
):
    """The rows of a texture lie along u."""
    profile = replace(scene.profile, ground_materials={"field": "soil_ploughed"})
    side = scene.catalogue.material("soil_ploughed", "").size
    coordinates = {}
    for chunk in (Chunk(3, 0), Chunk(4, 0)):
        ground = make.ground(chunk)
        shape = make.landuse(chunk).classes.shape
        rows = np.full(shape, round(100 * degrees))
        land = LanduseMap(chunk, np.full(shape, LanduseClass.FIELD, np.uint8), 0 * rows, rows)
        write_landuse(ground, land, profile, scene.catalogue, tmp_path / f"{chunk.name}.usdc")
        layer = Sdf.Layer.OpenAsAnonymous(str(tmp_path / f"{chunk.name}.usdc"))
        uv, index = (
            np.asarray(layer.GetAttributeAtPath(f"/Terrain/Ground.primvars:{name}").default)
            for name in ("st", "st:indices")
        )
        uv = uv[index].astype(float)
        place = ground.vertices[ground.face_vertices, :2]
        along = np.array([np.cos(np.radians(degrees)), np.sin(np.radians(degrees))])
        across = np.array([-along[1], along[0]])
        expected = (place - place[0]) @ np.stack([along, across], axis=1) / side
        np.testing.assert_allclose(uv - uv[0], expected, atol=1e-4)
        coordinates[chunk] = {tuple(p): c for p, c in zip(place.tolist(), uv, strict=True)}
    west, east = coordinates.values()
    shared = west.keys() & east.keys()
    assert len(shared) > 5
    for key in shared:
        apart = west[key] - east[key]
        np.testing.assert_allclose(apart, np.round(apart), atol=1e-3)
