import numpy as np
import pytest
import shapely

from envgen_usd.chunks import CELL_SIZE, Chunk
from envgen_usd.models.land_rules import TerrainRules
from envgen_usd.models.landuse import LanduseClass, Plot
from envgen_usd.terrain.heightmaps import build_heightmaps
from envgen_usd.terrain.terrain_field import fit_terrain

FLAT = TerrainRules(0.0, 100.0, 0.5)
HILLS = TerrainRules(5.0, 90.0, 0.5)


def plot(west: float, south: float, size: tuple[float, float], name: str) -> Plot:
    east, north = west + size[0], south + size[1]
    corners = np.array([(west, south), (east, south), (east, north), (west, north)])
    return Plot(name, corners, LanduseClass.LAWN, corners[:2], "1")


@pytest.fixture(scope="module")
def plots() -> tuple[Plot, ...]:
    """A row of plots north of a street, and one at the foot of a hill behind it."""
    row = [plot(20.0 + 25 * i, 109.0, (25.0, 30.0), f"p{i}") for i in range(5)]
    return (*row, plot(20.0, 150.0, (30.0, 25.0), "back"))


@pytest.fixture(scope="module")
def street(make_surface):
    return make_surface(
        shapely.box(-40.0, 100.0, 260.0, 107.0), lambda x, y: 5.0 + 0.03 * x + 0.0 * y
    )


def hillside(points: np.ndarray) -> np.ndarray:
    return 5.0 + 0.03 * points[:, 0] + 0.25 * (points[:, 1] - 100.0)


def inside(one: Plot, room: float) -> np.ndarray:
    (west, south), (east, north) = one.polygon.min(axis=0) + room, one.polygon.max(axis=0) - room
    return np.stack(np.meshgrid(np.arange(west, east), np.arange(south, north)), -1).reshape(-1, 2)


def test_plots_on_a_hillside_become_planes_that_begin_at_the_street(street, plots):
    field = fit_terrain(street, FLAT, 0, hillside, plots)
    for one in plots:
        places = inside(one, 3.0)
        heights = field(places)
        matrix = np.column_stack([places, np.ones(len(places))])
        plane = np.linalg.lstsq(matrix, heights, rcond=None)[0]
        assert np.allclose(matrix @ plane, heights, atol=0.02)
        assert abs(plane[1]) <= 0.08 + 1e-3
        assert plane[0] == pytest.approx(0.03, abs=0.01)
    beside_street = field(np.array([[32.0, 112.0], [120.0, 112.0]]))
    assert np.allclose(beside_street, 5.0 + 0.03 * np.array([32.0, 120.0]), atol=1.0)


def test_banks_around_plots_keep_the_slope_and_the_road_its_height(street, plots):
    field = fit_terrain(street, FLAT, 0, hillside, plots[:5])
    samples, _ = field.outline.samples(0.5)
    assert np.allclose(field(samples), samples[:, 2], atol=1e-9)
    heights = field.on_grid(*Chunk(0, 0).corner_axes())
    east, north = np.diff(heights, axis=1)[:-1], np.diff(heights, axis=0)[:, :-1]
    assert np.max(np.hypot(east, north)) / CELL_SIZE <= 0.5 + 0.01


def test_real_terrain_away_from_road_and_plots_is_left_alone(street, plots):
    field = fit_terrain(street, FLAT, 0, hillside, plots)
    far = np.array([[100.0, 330.0], [-190.0, 105.0], [100.0, -10.0], [5e3, 7e3]])
    assert np.allclose(field(far), hillside(far), atol=1e-6)


def test_hills_are_levelled_under_plots_too(street, plots):
    places = inside(plots[-1], 3.0)
    rough, level = (fit_terrain(street, HILLS, 3, None, built)(places) for built in ((), plots))
    matrix = np.column_stack([places, np.ones(len(places))])

    def unevenness(heights: np.ndarray) -> float:
        return np.abs(matrix @ np.linalg.lstsq(matrix, heights, rcond=None)[0] - heights).max()

    assert unevenness(level) < 0.05 < unevenness(rough)


def test_on_the_roads_own_plane_plots_change_nothing(street, plots):
    chunks = [Chunk(0, 0)]
    with_plots = build_heightmaps(street, chunks, FLAT, 0, None, plots)
    without = build_heightmaps(street, chunks, FLAT, 0)
    assert np.array_equal(with_plots[chunks[0]].heights, without[chunks[0]].heights)


def test_neighbours_rise_alike_where_the_land_behind_them_does_not(street, plots):
    def twisted(points: np.ndarray) -> np.ndarray:
        side = np.tanh((points[:, 0] - 82.0) / 8.0)
        return 5.0 + 0.03 * points[:, 0] + 0.2 * side * (points[:, 1] - 100.0)

    field = fit_terrain(street, FLAT, 0, twisted, plots[:5])
    heights = field.on_grid(np.arange(21.0, 144.0, CELL_SIZE), np.arange(110.0, 136.0, CELL_SIZE))
    east, north = np.diff(heights, axis=1)[:-1], np.diff(heights, axis=0)[:, :-1]
    assert np.max(np.hypot(east, north)) / CELL_SIZE <= 0.5 + 0.01
    rises = np.array([np.ptp(field(inside(one, 3.0)[[0, -1]])) for one in plots[:5]])
    assert np.ptp(rises) > 0.2
