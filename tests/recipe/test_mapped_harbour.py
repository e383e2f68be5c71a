"""An invented harbour as a map: a basin between quays, a pier, cranes, a pond, a sea mark."""

import numpy as np
import pytest
import shapely
from benchmarks.watertight import find_leaks
from tests.kept_work import kept
from tests.places.places_extracts import crossing

from envgen_usd.chunks import CELL_SIZE
from envgen_usd.citygml.read import read_city
from envgen_usd.environment_files import read_profile
from envgen_usd.layers.stage_surface import StageSurface
from envgen_usd.models.landuse import QUAY_WALL
from envgen_usd.recipe.build_options import BuildOptions
from envgen_usd.recipe.environment_build import build

YARD = (12.0, 12.0, 150.0, 70.0)
BASIN = (12.0, 70.0, 150.0, 112.0)
PIER = ((60.0, 70.0), (60.0, 95.0))
WIDE_PIER = shapely.LineString(PIER).buffer(3.0, cap_style="flat")
POND = shapely.Point(-60.0, 60.0).buffer(18.0, quad_segs=8)
SHED = (20.0, 16.0, 50.0, 34.0)
CRANES = ((90.0, 64.0), (120.0, 64.0))
RULES = read_profile("1", "harbour").terrain


def ring(box):
    x0, y0, x1, y1 = box
    return [(x0, y0), (x1, y0), (x1, y1), (x0, y1), (x0, y0)]


@pytest.fixture(scope="module")
def harbour(tmp_path_factory):
    return kept(tmp_path_factory, "mapped_harbour", built)


def built(folder):
    extract = crossing(160.0)
    extract.way(*ring(YARD), landuse="harbour")
    extract.way(*ring(BASIN), waterway="dock")
    extract.way(*PIER, man_made="pier", width="6")
    extract.way(*ring(SHED), building="warehouse", height="8")
    extract.way(*[(round(x, 2), round(y, 2)) for x, y in POND.exterior.coords], natural="water")
    for place in CRANES:
        extract.node(*place, man_made="crane")
    extract.node(100.0, 90.0, seamark__type="buoy_lateral")
    extract.node(30.0, 66.0, seamark__type="light_minor")
    out = folder / "out"
    result = build(
        BuildOptions(
            road=out / "road.xodr",
            country="1",
            area="harbour",
            out=out,
            osm=extract.write(folder / "harbour.osm"),
            workers=1,
            actors=False,
        )
    )
    return out, result


@pytest.fixture(scope="module")
def parts(harbour):
    """Corners of the faces of the ground, M x 3, by the name of their subset."""
    from pxr import Usd, UsdGeom  # noqa: PLC0415 - only this needs the stage

    stage = Usd.Stage.Open(str(harbour[0] / "stage.usda"))
    found: dict[str, list[np.ndarray]] = {}
    for chunk in stage.GetPrimAtPath("/World").GetChildren():
        prim = chunk.GetPrimAtPath("Terrain/Ground")
        if not prim:
            continue
        mesh = UsdGeom.Mesh(prim)
        matrix = np.array(UsdGeom.XformCache().GetLocalToWorldTransform(prim))
        points = np.array(mesh.GetPointsAttr().Get(), np.float64) @ matrix[:3, :3] + matrix[3, :3]
        sizes = np.array(mesh.GetFaceVertexCountsAttr().Get())
        corners = np.split(
            points[np.array(mesh.GetFaceVertexIndicesAttr().Get())], np.cumsum(sizes)[:-1]
        )
        for part in prim.GetChildren():
            faces = np.array(UsdGeom.Subset(part).GetIndicesAttr().Get())
            found.setdefault(part.GetName(), []).extend(corners[face] for face in faces)
    return found


def in_the(shape, faces):
    return [face for face in faces if shapely.contains_xy(shape, *face[:, :2].mean(axis=0))]


def test_the_water_of_the_basin_is_level_below_its_quay(parts):
    dock = in_the(shapely.box(*BASIN).buffer(2.0), parts["water"])
    levels = np.unique(np.concatenate(dock)[:, 2])
    assert np.ptp(levels) < 1e-6
    quay = np.concatenate(in_the(shapely.box(*YARD), parts["quay"]))[:, 2]
    assert quay.min() - levels[0] == pytest.approx(RULES.quay_height, abs=0.01)
    area = sum(shapely.Polygon(face[:, :2]).area for face in dock)
    expected = shapely.box(*BASIN).difference(WIDE_PIER)
    assert area == pytest.approx(expected.area, rel=0.03)


def test_the_pond_lies_less_deep_and_has_no_wall(parts):
    pond = np.concatenate(in_the(POND.buffer(2.0), parts["water"]))[:, 2]
    assert np.ptp(pond) < 1e-6
    land = np.concatenate(in_the(POND.buffer(40.0), parts["grass"]))[:, 2]
    assert np.median(land) - pond[0] == pytest.approx(RULES.bank_height, abs=0.05)
    assert not in_the(POND.buffer(4.0), parts[QUAY_WALL])


def test_quay_walls_follow_the_map_in_straight_lines(parts):
    dock = shapely.box(*BASIN)
    shore = dock.difference(WIDE_PIER).boundary
    walls = in_the(dock.buffer(2.0), parts[QUAY_WALL])
    corners = np.concatenate(walls)
    beside = shapely.distance(shore, shapely.points(corners[:, :2]))
    # The corners of the pier are cut by a metre.
    assert beside.max() < 1.3 * CELL_SIZE
    assert np.quantile(beside, 0.95) < CELL_SIZE
    tall = [np.ptp(wall[:, 2]) for wall in walls]
    np.testing.assert_allclose(tall, RULES.quay_height, atol=0.01)
    length = sum(np.hypot(*(wall[1] - wall[0])[:2]) for wall in walls)
    assert length == pytest.approx(shore.length, rel=0.03)
    # Away from its ends and from the borders of chunks, the front of the yard is a line.
    front = corners[(np.abs(corners[:, 1] - BASIN[1]) < 1.5) & (corners[:, 0] > 66.0)]
    front = front[front[:, 0] < 146.0]
    slope, offset = np.polyfit(front[:, 0], front[:, 1], 1)
    assert np.abs(front[:, 1] - slope * front[:, 0] - offset).max() < 0.05
    assert abs(slope) < 0.01


def test_ground_walls_and_road_have_no_open_edge(harbour):
    leaks = find_leaks(harbour[0])
    assert leaks.edges > 10_000
    assert not leaks


def test_no_street_lies_in_the_water(harbour, parts):
    surface = StageSurface(harbour[0] / "stage.usda")
    roads = surface.triangles("Roads", np.array([[0.0, 0.0], [100.0, 0.0], [0.0, 100.0]]))
    water = shapely.union_all([shapely.Polygon(face[:, :2]) for face in parts["water"]])
    flat = shapely.union_all(shapely.convex_hull(shapely.multipoints(roads[..., :2])))
    assert flat.intersection(water).area < 1e-3
    level = np.concatenate(parts["water"])[:, 2].max()
    assert roads[..., 2].min() > level + 0.3


def test_cranes_stand_where_the_map_has_them_and_face_the_basin(harbour):
    cities = [read_city(path) for path in sorted(harbour[0].glob("chunks/*/city.gml"))]
    found = [
        each.placement
        for city in cities
        for each in city.objects
        if each.placement is not None and each.placement.template == "crane"
    ]
    assert len(found) == len(CRANES)
    for placement, place in zip(sorted(found, key=lambda p: p.position[0]), CRANES, strict=True):
        assert placement.position[:2] == pytest.approx(place, abs=0.3)
        assert placement.heading == pytest.approx(np.pi / 2, abs=0.2)
    containers = [
        each.placement
        for city in cities
        for each in city.objects
        if each.placement is not None and each.placement.template == "container"
    ]
    # The rails of a gantry would lie beyond the quay, 6 m from these places.
    designs = {
        each.attributes["design"]
        for city in cities
        for each in city.objects
        if each.placement is not None and each.placement.template == "crane"
    }
    assert designs <= {"portal", "portal_large"}
    away = [
        np.hypot(*(container.position - crane.position)[:2])
        for container in containers
        for crane in found
    ]
    assert min(away) > 4.0


def test_sea_marks_are_counted_as_unused(harbour):
    issues = harbour[1].issues
    (used,) = [issue for issue in issues if issue.kind == "osm.used"]
    assert "cranes: 2" in used.message
    (unused,) = [issue for issue in issues if issue.kind == "osm.unused"]
    assert "2 elements" in unused.message
    assert "seamark" in unused.message
