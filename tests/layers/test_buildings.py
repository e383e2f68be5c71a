"""The buildings layer of one chunk."""

import numpy as np
import pytest
from pxr import Usd, UsdGeom, UsdShade

from envgen_usd.chunks import Chunk
from envgen_usd.errors import EnvgenError
from envgen_usd.layers.buildings_layer import write_buildings
from envgen_usd.models.city_model import City, CityObject, ThematicSurface
from envgen_usd.models.polygon_arrays import Polygons

SIDE = 8.0


def cube(corner=(10.0, 20.0, 3.0), material="brick_red", lod=2):
    x, y, z = corner
    low = np.array([[x, y, z], [x, y + SIDE, z], [x + SIDE, y + SIDE, z], [x + SIDE, y, z]])
    high = low[::-1] + np.array([0, 0, SIDE])
    up = np.array([0, 0, SIDE])
    pairs = [(low[(k + 1) % 4], low[k]) for k in range(4)]
    walls = [np.stack([a, b, b + up, a + up]) for a, b in pairs]
    return (
        ThematicSurface("w", "WallSurface", Polygons.of_rings(walls), lod, material),
        ThematicSurface("r", "RoofSurface", Polygons.of_rings([high]), lod),
        ThematicSurface("g", "GroundSurface", Polygons.of_rings([low]), lod),
    )


@pytest.fixture
def write(tmp_path, scene):
    def write_(*objects):
        path = tmp_path / "buildings.usdc"
        write_buildings(City(objects), Chunk(0, 0), scene.profile, scene.catalogue, path)
        return Usd.Stage.Open(str(path))

    return write_


def corners(mesh):
    index = np.asarray(mesh.GetFaceVertexIndicesAttr().Get())
    points = np.asarray(mesh.GetPointsAttr().Get(), float)[index].reshape(-1, 3, 3)
    st = UsdGeom.PrimvarsAPI(mesh).GetPrimvar("st")
    assert st.GetInterpolation() == "faceVarying"
    return points, np.asarray(st.ComputeFlattened(), float).reshape(-1, 3, 2)


def test_a_building_is_a_component_on_its_own_pivot(write):
    stage = write(CityObject("b-1", "Building", {"function": "residential"}, cube(), solid_lod=2))
    prim = stage.GetPrimAtPath("/Buildings/b_1")
    assert Usd.ModelAPI(prim).GetKind() == "component"
    assert tuple(prim.GetAttribute("xformOp:translate").Get()) == (14.0, 24.0, 3.0)
    points = np.asarray(UsdGeom.Mesh(prim.GetChild("Shell")).GetPointsAttr().Get())
    assert len(points) == 8
    np.testing.assert_allclose([points.min(axis=0), points.max(axis=0)], [[-4, -4, 0], [4, 4, 8]])
    assert prim.GetAttribute("userProperties:gml_id").Get() == "b-1"


def test_shell_encloses_its_volume_and_looks_outwards(write):
    stage = write(CityObject("b", "Building", surfaces=cube()))
    points, _ = corners(UsdGeom.Mesh(stage.GetPrimAtPath("/Buildings/b/Shell")))
    assert np.linalg.det(points).sum() / 6 == pytest.approx(SIDE**3)


def test_subsets_carry_part_and_material(write, material_of):
    stage = write(CityObject("b", "Building", surfaces=cube()))
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath("/Buildings/b/Shell"))
    ok, why = UsdGeom.Subset.ValidateFamily(mesh, UsdGeom.Tokens.face, "materialBind")
    assert ok, why
    found = {}
    for subset in UsdShade.MaterialBindingAPI(mesh).GetMaterialBindSubsets():
        part = subset.GetPrim().GetAttribute("semantics:labels:part").Get()[0]
        found[part] = (material_of(subset.GetPrim()), len(subset.GetIndicesAttr().Get()))
    assert found == {
        "wall": ("brick_red", 8),
        "roof": ("roof_tiles_red", 2),
        "ground": ("brick_red", 2),
    }


def test_bricks_lie_level_and_have_their_size(write, scene):
    """On walls v is the height and u the length along the wall, both in repeats of 2 m."""
    stage = write(CityObject("b", "Building", surfaces=cube()))
    points, uv = corners(UsdGeom.Mesh(stage.GetPrimAtPath("/Buildings/b/Shell")))
    normals = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])
    walls = np.abs(normals[:, 2]) < 1e-9
    assert walls.sum() == 8
    size = scene.catalogue.materials["brick_red"].size
    np.testing.assert_allclose(uv[walls][..., 1] * size, points[walls][..., 2], atol=1e-4)
    length = np.linalg.norm(np.diff(points[walls][..., :2], axis=1), axis=-1)
    np.testing.assert_allclose(np.abs(np.diff(uv[walls][..., 0], axis=1)) * size, length, atol=1e-4)


def test_text_on_a_wall_would_be_readable(write):
    """Seen from outside, u grows to the right: no mirrored textures."""
    stage = write(CityObject("b", "Building", surfaces=cube()))
    _, uv = corners(UsdGeom.Mesh(stage.GetPrimAtPath("/Buildings/b/Shell")))
    edges = uv[:, 1:] - uv[:, :1]
    assert (edges[:, 0, 0] * edges[:, 1, 1] - edges[:, 0, 1] * edges[:, 1, 0] > 0).all()


def test_openings_are_closed_in_the_plane_of_the_wall(stage_file):
    stage = Usd.Stage.Open(str(stage_file))
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath("/World/chunk_0_0/Buildings/house_0_chunk_0_0/Shell"))
    names = {child.GetName() for child in mesh.GetPrim().GetChildren()}
    assert {"window_glass", "door_wood", "wall_brick_red", "roof_roof_tiles_red"} <= names
    points, _ = corners(mesh)
    area = (
        np.linalg.norm(np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0]), axis=1)
        / 2
    )
    front = (np.ptp(points[..., 1], axis=1) < 1e-6) & np.isclose(points[:, 0, 1], -5.0)
    assert area[front].sum() == pytest.approx(12.5 * 6.0, rel=1e-4)


def test_only_the_finest_geometry_is_shown(write):
    coarse = (ThematicSurface("c", "WallSurface", cube((0, 0, 0))[0].polygons, 1),)
    stage = write(CityObject("b", "Building", surfaces=(*coarse, *cube())))
    points, _ = corners(UsdGeom.Mesh(stage.GetPrimAtPath("/Buildings/b/Shell")))
    assert len(points) == 12


def test_a_building_without_semantics_is_shown(write):
    polygons = [surface.polygons for surface in cube()]
    merged = Polygons.of_rings(
        [ring for p in polygons for k in range(len(p)) for ring in p.rings(k)]
    )
    stage = write(CityObject("b", "Building", geometry={"lod1Solid": merged}))
    points, _ = corners(UsdGeom.Mesh(stage.GetPrimAtPath("/Buildings/b/Shell")))
    assert np.linalg.det(points).sum() / 6 == pytest.approx(SIDE**3)


def test_parts_belong_to_their_building(write):
    part = CityObject("p", "BuildingPart", surfaces=cube((30.0, 20.0, 3.0)))
    stage = write(CityObject("b", "Building", surfaces=cube(), children=(part,)))
    assert [child.GetName() for child in stage.GetDefaultPrim().GetChildren()] == ["b"]
    points, _ = corners(UsdGeom.Mesh(stage.GetPrimAtPath("/Buildings/b/Shell")))
    assert len(points) == 24


def test_an_unknown_material_is_named(write):
    with pytest.raises(EnvgenError, match=r"buildings of chunk 0_0 .*unknown material 'jelly'"):
        write(CityObject("b", "Building", surfaces=cube(material="jelly")))


@pytest.mark.parametrize(
    ("kind", "label"), [("Building", "building"), ("Bridge", "bridge"), ("Tunnel", "tunnel")]
)
def test_class_follows_the_kind_of_construction(write, kind, label):
    stage = write(CityObject("b", kind, surfaces=cube()))
    prim = stage.GetPrimAtPath("/Buildings/b")
    assert list(prim.GetAttribute("semantics:labels:class").Get()) == [label]
    assert prim.GetAttribute("userProperties:segmentation_class").Get() == label
