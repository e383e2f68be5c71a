from dataclasses import replace

import numpy as np
import pytest
import shapely
from scipy.spatial import cKDTree

from envgen_usd.chunks import CELL_SIZE, CHUNK_SIZE, Chunk, chunks_of_points, snap
from envgen_usd.errors import EnvgenError
from envgen_usd.geometry.road_outline import Outline
from envgen_usd.models.ground import GroundMesh, HeightMap
from envgen_usd.models.land_rules import TerrainRules
from envgen_usd.models.landuse import LanduseClass, LanduseMap
from envgen_usd.models.road_surface import RoadSurface
from envgen_usd.opendrive.reader import read_network
from envgen_usd.opendrive.surface import build_surface
from envgen_usd.terrain.ground_mesh import build_ground
from envgen_usd.terrain.heightmaps import build_heightmaps

RULES = TerrainRules(0.0, 100.0, 0.5)
NAMES = ["straight", "curved", "cross", "ring", "lane", "border", "sliver"]


def level(x, y):
    return 0.0 * (x + y)


def hilly(x, y):
    return 4.0 * np.sin(x / 70.0) + 0.02 * y


def rough(x, y):
    return 0.05 * np.sin(17.0 * x) * np.cos(13.0 * y)


def heights_on(triangles: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Heights of triangles (T x 3 x 3) at the places (N x 2) that lie in them; NaN elsewhere."""
    tree = shapely.STRtree(shapely.points(places))
    face, place = tree.query(shapely.polygons(triangles[..., :2]), "intersects")
    a, b, c = np.moveaxis(triangles[face], 1, 0)
    normal = np.cross(b - a, c - a)
    flat = np.abs(normal[:, 2]) < 1e-9
    offset = ((places[place] - a[:, :2]) * normal[:, :2]).sum(axis=1)
    heights = np.full(len(places), np.nan)
    heights[place[~flat]] = (a[:, 2] - offset / np.where(flat, 1.0, normal[:, 2]))[~flat]
    return heights


def grounds(surface: RoadSurface, chunks: tuple[Chunk, ...]) -> list[GroundMesh]:
    maps = build_heightmaps(surface, chunks, RULES, 0)
    outline = Outline.of(surface)
    return [build_ground(maps[chunk], outline) for chunk in chunks]


def chunks_on(area: shapely.Geometry) -> tuple[Chunk, ...]:
    return chunks_of_points(shapely.get_coordinates(area.segmentize(50.0)), 1.0)


def corners_of(mesh: GroundMesh) -> tuple[np.ndarray, np.ndarray]:
    """Face number and position of every corner of every face."""
    face = np.repeat(np.arange(len(mesh.face_sizes)), mesh.face_sizes)
    return face, mesh.vertices[mesh.face_vertices]


def directed_edges(mesh: GroundMesh) -> np.ndarray:
    """E x 2 x 3, whole millimetres."""
    face, points = corners_of(mesh)
    first = np.searchsorted(face, np.arange(len(mesh.face_sizes)))
    following = np.arange(1, len(face) + 1)
    following[np.append(first[1:], len(face)) - 1] = first
    return np.round(np.stack([points, points[following]], axis=1) * 1000).astype(np.int64)


def road_edges(surface: RoadSurface) -> np.ndarray:
    points = surface.vertices[surface.triangles[surface.triangle_level == 0]]
    edges = np.stack([points, np.roll(points, -1, axis=1)], axis=2).reshape(-1, 2, 3)
    return np.round(edges * 1000).astype(np.int64)


def open_edges(edges: np.ndarray) -> np.ndarray:
    """Edges without an opposite one, in metres; no directed edge may occur twice.

    Places are compared by a 64-bit hash of their whole millimetres.
    """
    factors = np.random.default_rng(0).integers(1 << 62, size=4) * 2 + 1
    start, end = np.moveaxis((edges * factors[:3]).sum(axis=2), 1, 0)
    forth, back = start * factors[3] + end, end * factors[3] + start
    assert len(np.unique(forth)) == len(forth)
    return edges[~np.isin(back, forth)] / 1000


def face_areas(mesh: GroundMesh) -> np.ndarray:
    """Signed areas in plan by the shoelace formula."""
    face, _ = corners_of(mesh)
    (x0, y0), (x1, y1) = np.moveaxis(directed_edges(mesh)[..., :2] / 1000, 0, -1)
    return np.bincount(face, (x0 * y1 - x1 * y0) / 2)


@pytest.mark.parametrize(("name", "height"), [*((name, hilly) for name in NAMES), ("cross", level)])
def test_ground_and_road_are_watertight_over_chunk_borders(make_surface, areas, name, height):
    surface = make_surface(areas[name], height)
    chunks = chunks_on(areas[name])
    meshes = grounds(surface, chunks)
    edges = np.concatenate([road_edges(surface), *map(directed_edges, meshes)])
    rim = shapely.union_all([shapely.box(*chunk.bounds) for chunk in chunks]).boundary
    middle = shapely.points(open_edges(edges)[..., :2].mean(axis=1))
    assert np.max(shapely.distance(rim, middle)) < 1e-6
    for mesh in meshes:
        signed = face_areas(mesh)
        box = shapely.box(*mesh.chunk.bounds)
        assert signed.min() > 0
        # Millimetre snapping moves a road's border by up to 0.7 mm along its length.
        assert signed.sum() == pytest.approx(box.area - areas[name].intersection(box).area, abs=1.0)


@pytest.mark.parametrize(
    "name", ["esmini/fabriksgatan", "esmini/e6mini", "carla_test/Town03", "esmini/tunnels"]
)
def test_ground_and_a_real_road_are_watertight(corpus, name):
    surface = build_surface(read_network(corpus / f"{name}.xodr"))
    chunks = chunks_of_points(surface.vertices, 1.0)
    meshes = grounds(surface, chunks)
    edges = np.concatenate([road_edges(surface), *map(directed_edges, meshes)])
    rim = shapely.union_all([shapely.box(*chunk.bounds) for chunk in chunks]).boundary
    middle = shapely.points(open_edges(edges)[..., :2].mean(axis=1))
    assert np.max(shapely.distance(rim, middle)) < 1e-6
    assert min(face_areas(mesh).min() for mesh in meshes) > 0
    corners = surface.vertices[surface.triangles[surface.triangle_level == 0], :2]
    (ax, ay), (bx, by) = (np.moveaxis(corners[:, i] - corners[:, 0], -1, 0) for i in (1, 2))
    areas = np.sum(ax * by - ay * bx) / 2 + sum(face_areas(mesh).sum() for mesh in meshes)
    assert areas == pytest.approx(len(chunks) * CHUNK_SIZE**2, abs=1e-3)


@pytest.mark.parametrize(("height", "most"), [(level, 4000), (hilly, 20_000), (rough, 65_025)])
def test_ground_follows_its_grid_with_as_few_faces_as_its_shape_allows(
    make_surface, areas, height, most
):
    """Flat ground has blocks of 16 cells; the border of a chunk keeps all its vertices."""
    surface, chunk = make_surface(areas["straight"], level), Chunk(3, 3)
    x, y = np.meshgrid(*chunk.corner_axes())
    heights = HeightMap(chunk, height(x, y))
    mesh = build_ground(heights, Outline.of(surface))
    places = np.column_stack([x.ravel(), y.ravel(), snap(heights.heights).ravel()])
    away, nearest = cKDTree(places).query(mesh.vertices)
    assert away.max() < 1e-9
    on_border = ((x == x.min()) | (x == x.max()) | (y == y.min()) | (y == y.max())).ravel()
    assert set(np.flatnonzero(on_border)) <= set(nearest.tolist())
    face, points = corners_of(mesh)
    first = np.searchsorted(face, np.arange(len(mesh.face_sizes)))
    a, b, c = (points[first + step] for step in range(3))
    d = points[first + mesh.face_sizes - 1]
    halves = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    seen = heights_on(halves, places[:, :2])
    assert np.abs(seen - places[:, 2]).max() < 0.006
    assert len(mesh.face_sizes) <= most
    assert face_areas(mesh).sum() == pytest.approx(40000.0, abs=1e-3)


def test_cell_of_a_face_holds_its_centre(make_surface, areas):
    surface = make_surface(areas["cross"], hilly)
    (mesh,) = grounds(surface, (Chunk(0, 0),))
    face, points = corners_of(mesh)
    centre = np.stack([np.bincount(face, points[:, i]) for i in (0, 1)], axis=1)
    centre /= mesh.face_sizes[:, None]
    row, column = np.divmod(mesh.face_cell, 255)
    low = np.stack([column, row], axis=1) * CELL_SIZE
    outside = np.max(np.maximum(low - centre, centre - low - CELL_SIZE), axis=1)
    # A cell whose centre is on the road has no landuse; its ground takes that of the next cell.
    x, y = Chunk(0, 0).cell_centres()
    road = areas["cross"].buffer(-2e-3)
    assert not shapely.contains_xy(road, x[column], y[row]).any()
    assert np.average(outside < 1e-3, weights=face_areas(mesh)) > 0.98
    assert np.max(outside) < 2 * CELL_SIZE


def painted(chunk: Chunk, degrees: float) -> LanduseMap:
    """Lawn on one side of a line through the chunk's middle, grass on the other."""
    x, y = np.meshgrid(*chunk.cell_centres())
    x, y = x - chunk.origin[0] - 100.0, y - chunk.origin[1] - 100.0
    lawn = np.cos(np.radians(degrees)) * x + np.sin(np.radians(degrees)) * y > 0.1
    classes = np.where(lawn, LanduseClass.LAWN, LanduseClass.GRASS).astype(np.uint8)
    return LanduseMap(chunk, classes, np.zeros((255, 255), dtype=np.int64))


def border_length(mesh: GroundMesh, landuse: LanduseMap) -> float:
    """Length of the edges between faces of different landuse."""
    face, _ = corners_of(mesh)
    edges = np.sort(directed_edges(mesh)[..., 0] * 10**6 + directed_edges(mesh)[..., 1], axis=1)
    _, edge = np.unique(edges, axis=0, return_inverse=True)
    lawn = (landuse.classes.ravel()[mesh.face_cell] == LanduseClass.LAWN)[face]
    sides = np.bincount(edge, lawn)
    between = (sides == 1) & (np.bincount(edge) == 2)
    _, first = np.unique(edge, return_index=True)
    length = np.linalg.norm(np.diff(directed_edges(mesh)[first, :, :2], axis=1)[:, 0], axis=1)
    return float(np.sum(length[between]) / 1000)


def smooth_lawn(mesh: GroundMesh, landuse: LanduseMap) -> np.ndarray:
    return landuse.classes.ravel()[mesh.face_cell] == LanduseClass.LAWN


@pytest.mark.parametrize("degrees", [0.0, 4.0, 10.0, 27.0, 45.0, 70.0, 205.0])
def test_straight_borders_of_landuse_are_straight(make_surface, areas, degrees):
    surface, chunk = make_surface(areas["lane"], level), Chunk(3, 3)
    heights = build_heightmaps(surface, [chunk], RULES, 0)[chunk]
    landuse = painted(chunk, degrees)
    outline = Outline.of(surface)
    smooth = build_ground(heights, outline, landuse)
    c, s = abs(np.cos(np.radians(degrees))), abs(np.sin(np.radians(degrees)))
    # A staircase is c + s times as long, one with cut corners up to 1.08 times.
    assert border_length(smooth, landuse) == pytest.approx(200.0 / max(c, s), rel=1e-2)
    sizes = face_areas(smooth)[smooth_lawn(smooth, landuse)]
    # The line lies on the wrong side of half a cell at most.
    assert sizes.sum() == pytest.approx(20000.0, abs=0.5 * CELL_SIZE * 283.0 + 100.0)
    assert face_areas(smooth).sum() == pytest.approx(40000.0, abs=1e-3)


def test_ground_with_cut_corners_is_watertight(make_surface, areas):
    surface, chunks = make_surface(areas["cross"], hilly), chunks_on(areas["cross"])
    maps = build_heightmaps(surface, chunks, RULES, 0)
    draw = np.random.default_rng(0)
    meshes = []
    for chunk in chunks:
        blocks = draw.integers(2, 8, (85, 85)).astype(np.uint8)
        classes = blocks.repeat(3, axis=0).repeat(3, axis=1)
        landuse = LanduseMap(chunk, classes, np.zeros((255, 255), dtype=np.int64))
        meshes.append(build_ground(maps[chunk], Outline.of(surface), landuse))
        assert face_areas(meshes[-1]).min() > 0
    edges = np.concatenate([road_edges(surface), *map(directed_edges, meshes)])
    rim = shapely.union_all([shapely.box(*chunk.bounds) for chunk in chunks]).boundary
    middle = shapely.points(open_edges(edges)[..., :2].mean(axis=1))
    assert np.max(shapely.distance(rim, middle)) < 1e-6


def test_an_outline_without_a_vertex_on_the_border_is_refused(make_surface, areas):
    surface = make_surface(areas["lane"], hilly)
    loop = surface.outline[0]
    off_border = loop[surface.vertices[loop][:, 1] != 200.0]
    with pytest.raises(EnvgenError, match="without a vertex"):
        grounds(replace(surface, outline=(off_border,)), (Chunk(0, 0),))
