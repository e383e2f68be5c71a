"""The roads layer of one chunk."""

from collections import Counter

import numpy as np
import pytest
from pxr import Usd, UsdGeom, UsdShade

from envgen_usd.chunks import Chunk
from envgen_usd.layers.road_meaning import road_meaning
from envgen_usd.layers.roads_layer import write_roads
from envgen_usd.models.city_model import City, CityObject, ThematicSurface
from envgen_usd.models.polygon_arrays import Polygons

NOTHING = Polygons.of_rings([])


@pytest.fixture(scope="module")
def stage(stage_file):
    return Usd.Stage.Open(str(stage_file))


def roads(stage):
    prims = stage.GetPrimAtPath("/World/chunk_0_0/Roads").GetChildren()
    return {prim.GetName(): UsdGeom.Mesh(prim) for prim in prims if prim.IsA(UsdGeom.Mesh)}


def area(mesh):
    points = np.asarray(mesh.GetPointsAttr().Get(), float)
    a, b, c = np.moveaxis(
        points[np.asarray(mesh.GetFaceVertexIndicesAttr().Get())].reshape(-1, 3, 3), 1, 0
    )
    return np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2


def test_surfaces_are_merged_by_meaning_and_keep_their_area(stage):
    found = {name: round(area(mesh), 2) for name, mesh in roads(stage).items()}
    assert found == {
        "road_driving_asphalt": 200 * 2 * 3.64,
        "sidewalk_kerb_curb_stone": 200 * 2 * 0.12,
        "road_lane_marking_marking_white": 200 * 0.12,
        "sidewalk_sidewalk_paving_asphalt": 200 * 2 * 2.0,
    }


def test_labels(stage):
    def label(mesh, taxonomy):
        return mesh.GetPrim().GetAttribute(f"semantics:labels:{taxonomy}").Get()[0]

    found = {name: (label(m, "class"), label(m, "part")) for name, m in roads(stage).items()}
    assert found == {
        "road_driving_asphalt": ("road", "driving"),
        "sidewalk_kerb_curb_stone": ("sidewalk", "kerb"),
        "road_lane_marking_marking_white": ("road", "lane_marking"),
        "sidewalk_sidewalk_paving_asphalt": ("sidewalk", "sidewalk"),
    }


def test_each_face_keeps_the_id_of_its_road(tmp_path, scene):
    """Two roads of the same meaning are one mesh; faces know which road they lie on."""
    points = np.array([[0.0, 0, 0], [90, 0, 0], [90, 4, 0], [0, 4, 0]])
    rows = {"Road-a": 10.0, "Road-b": 50.0}
    tops = []
    for name, y in rows.items():
        ring = Polygons.of_rings([points + np.array([0, y, 0])])
        surface = ThematicSurface(f"{name}_area", "TrafficArea", ring, 2)
        space = CityObject(f"{name}_space", "TrafficSpace", surfaces=(surface,))
        tops.append(CityObject(name, "Road", children=(space,)))
    write_roads(City(tuple(tops)), Chunk(0, 0), scene.profile, scene.catalogue, tmp_path / "r.usdc")
    stage = Usd.Stage.Open(str(tmp_path / "r.usdc"))
    (mesh,) = (UsdGeom.Mesh(prim) for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh))
    assert list(mesh.GetPrim().GetAttribute("userProperties:gml_id").Get()) == list(rows)
    primvar = UsdGeom.PrimvarsAPI(mesh).GetPrimvar("gml_id")
    assert primvar.GetInterpolation() == "uniform"
    ids = primvar.ComputeFlattened()
    corners = np.asarray(mesh.GetPointsAttr().Get())[mesh.GetFaceVertexIndicesAttr().Get()]
    middles = corners.reshape(-1, 3, 3).mean(axis=1)[:, 1]
    assert len(ids) == len(middles) == 4
    assert all(rows[name] < y < rows[name] + 4 for name, y in zip(ids, middles, strict=True))


def test_texture_coordinates_of_marks_above_one_another_are_indexed(tmp_path, scene):
    """A line on the road and one on an island above it have equal coordinates."""
    ring = np.array([[1.0, 1, 0], [9, 1, 0], [9, 2, 0], [1, 2, 0]])
    low, high = (Polygons.of_rings([ring + np.array([0, 0, z])]) for z in (0.0, 0.12))
    marks = tuple(ThematicSurface(f"m{k}", "Marking", p, 2) for k, p in enumerate((low, high)))
    road = CityObject("r", "Road", surfaces=marks)
    write_roads(City((road,)), Chunk(0, 0), scene.profile, scene.catalogue, tmp_path / "r.usdc")
    stage = Usd.Stage.Open(str(tmp_path / "r.usdc"))
    (mesh,) = (UsdGeom.Mesh(prim) for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh))
    st = UsdGeom.PrimvarsAPI(mesh).GetPrimvar("st")
    assert len(mesh.GetPointsAttr().Get()) == 8
    assert len(st.Get()) == 4
    size = scene.catalogue.materials["marking_white"].size
    flat = np.asarray(st.ComputeFlattened(), float) * size
    np.testing.assert_allclose(flat, np.asarray(mesh.GetPointsAttr().Get())[:, :2], atol=1e-5)


def test_vertices_are_welded(stage):
    """The strips were given as loose triangles; a grid of 41 x 2 vertices is left of each."""
    for mesh in roads(stage).values():
        points = np.asarray(mesh.GetPointsAttr().Get())
        assert len(np.unique(points, axis=0)) == len(points)
    mark = roads(stage)["road_lane_marking_marking_white"]
    assert len(mark.GetPointsAttr().Get()) == 82


def test_kerb_faces_look_at_the_road(stage):
    kerb = roads(stage)["sidewalk_kerb_curb_stone"]
    points = np.asarray(kerb.GetPointsAttr().Get())[kerb.GetFaceVertexIndicesAttr().Get()]
    stated = UsdGeom.PrimvarsAPI(kerb).GetPrimvar("normals")
    normals = np.asarray(stated.ComputeFlattened())
    assert stated.GetInterpolation() == "faceVarying"
    inwards = np.sign(100.0 - points[:, 1])
    np.testing.assert_allclose(normals[:, 1] * inwards, 1.0, atol=1e-5)


def test_textures_have_their_real_size(stage, scene):
    for mesh in roads(stage).values():
        material, _ = UsdShade.MaterialBindingAPI(mesh).ComputeBoundMaterial()
        size = scene.catalogue.materials[material.GetPrim().GetName()].size
        index = np.asarray(mesh.GetFaceVertexIndicesAttr().Get())
        points = np.asarray(mesh.GetPointsAttr().Get(), float)[index].reshape(-1, 3, 3)
        st = UsdGeom.PrimvarsAPI(mesh).GetPrimvar("st")
        values = np.asarray(st.ComputeFlattened(), float)
        uv = (values if st.GetInterpolation() == "faceVarying" else values[index]).reshape(-1, 3, 2)
        e = uv[:, 1:] - uv[:, :1]
        texture = np.abs(e[:, 0, 0] * e[:, 1, 1] - e[:, 0, 1] * e[:, 1, 0]) * size**2
        e = points[:, 1:] - points[:, :1]
        real = np.linalg.norm(np.cross(e[:, 0], e[:, 1]), axis=1)
        np.testing.assert_allclose(texture, real, rtol=2e-3)


def test_lane_lines_run_with_the_traffic_and_know_the_next(stage):
    lane = UsdGeom.BasisCurves(
        stage.GetPrimAtPath("/World/chunk_0_0/Roads/Lanes/lane__1_chunk_0_0")
    )
    np.testing.assert_allclose(lane.GetPointsAttr().Get()[0], [0, 98.2, 0], atol=1e-5)
    np.testing.assert_allclose(lane.GetPointsAttr().Get()[-1], [200, 98.2, 0], atol=1e-5)
    assert lane.GetPurposeAttr().Get() == "guide"
    facts = {
        a.GetBaseName(): a.Get() for a in lane.GetPrim().GetPropertiesInNamespace("userProperties")
    }
    assert facts["lane_id"] == "lane_-1_chunk_0_0"
    assert list(facts["successors"]) == ["lane_-1_chunk_1_0"]
    assert list(facts["predecessors"]) == []
    assert facts["speed"] == pytest.approx(13.9)


@pytest.mark.parametrize(
    ("kind", "attributes", "expected"),
    [
        ("TrafficArea", {"opendrive_lane_type": "driving"}, ("road", "driving", "asphalt")),
        ("TrafficArea", {"opendrive_lane_type": "parking"}, ("road", "parking", "asphalt")),
        ("TrafficArea", {"opendrive_lane_type": "sidewalk"},
         ("sidewalk", "sidewalk", "paving_asphalt")),
        ("AuxiliaryTrafficArea", {"opendrive_lane_type": "shoulder"},
         ("road", "shoulder", "asphalt_worn")),
        ("AuxiliaryTrafficArea", {"opendrive_lane_type": "median"},
         ("terrain", "median", "grass_verge")),
        ("AuxiliaryTrafficArea", {"opendrive_lane_type": "none"},
         ("terrain", "none", "grass_verge")),
        ("AuxiliaryTrafficArea", {"opendrive_lane_type": "driving", "opendrive_kind": "kerb"},
         ("road", "kerb", "curb_stone")),
        ("AuxiliaryTrafficArea", {"opendrive_lane_type": "sidewalk", "opendrive_kind": "kerb"},
         ("sidewalk", "kerb", "curb_stone")),
        ("Marking", {"colour": "yellow"}, ("road", "lane_marking", "marking_yellow")),
        ("Marking", {}, ("road", "lane_marking", "marking_white")),
        ("TrafficArea", {"function": "2"}, ("sidewalk", "sidewalk", "paving_asphalt")),
        ("TrafficArea", {}, ("road", "driving", "asphalt")),
        ("AuxiliaryTrafficArea", {}, ("terrain", "border", "grass_verge")),
    ],
)  # fmt: skip
def test_meaning(scene, kind, attributes, expected):
    surface = ThematicSurface("a", kind, NOTHING, 2)
    found = road_meaning(surface, attributes, scene.profile)
    assert (found.label, found.part, found.material) == expected


def test_material_of_the_city_wins(scene):
    surface = ThematicSurface("a", "TrafficArea", NOTHING, 2, "gravel")
    assert road_meaning(surface, {}, scene.profile).material == "gravel"


def test_surfaces_of_neighbouring_meshes_share_their_edges(stage):
    """Asphalt, mark, kerb and sidewalk close up: only the chunk's and the verge's edges are."""
    edges = Counter()
    for mesh in roads(stage).values():
        points = np.round(np.asarray(mesh.GetPointsAttr().Get(), float), 4)
        for triangle in np.asarray(mesh.GetFaceVertexIndicesAttr().Get()).reshape(-1, 3):
            for a, b in zip(triangle, np.roll(triangle, -1), strict=True):
                edges[frozenset((tuple(points[a]), tuple(points[b])))] += 1
    open_edges = [np.array(list(edge)) for edge, count in edges.items() if count == 1]
    for edge in open_edges:
        x, y = edge[:, 0], edge[:, 1]
        assert np.isin(x, (0.0, 200.0)).all() or np.isin(y, (94.3, 105.7)).all()
    assert max(edges.values()) == 2


def test_an_empty_chunk_is_written(tmp_path, scene):
    empty = City((CityObject("tree", "SolitaryVegetationObject"),))
    write_roads(empty, Chunk(0, 0), scene.profile, scene.catalogue, tmp_path / "roads.usdc")
    stage = Usd.Stage.Open(str(tmp_path / "roads.usdc"))
    assert not stage.GetDefaultPrim().GetChildren()
