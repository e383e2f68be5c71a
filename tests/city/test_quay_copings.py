"""Copings run along the upper edges of quay walls, closed bodies over the water's edge."""

import numpy as np
import pytest
import shapely
from tests.terrain.test_water import BASIN, RULES, flat, land, landuse

from envgen_usd.chunks import Chunk
from envgen_usd.city.footprints import footprint_of
from envgen_usd.city.plots.quay_copings import HEIGHTS, WIDTH, place_copings
from envgen_usd.geometry.iso19107.fault_search import Bodies, find_faults
from envgen_usd.geometry.road_outline import Outline
from envgen_usd.models.landuse import LanduseClass
from envgen_usd.models.road_surface import RoadSurface
from envgen_usd.terrain.ground_mesh import build_ground
from envgen_usd.terrain.water_levels import lower_water

SMALL = shapely.affinity.rotate(shapely.box(40.0, 50.0, 160.0, 130.0), 8.0)


def copings(shapes, chunks, rules=RULES):
    maps = landuse(shapes, chunks)
    none = np.empty(0, np.int64)
    road = RoadSurface(np.empty((0, 3)), none.reshape(0, 3), none, none, (), (), (), ())
    lowered = lower_water(land(flat, chunks), maps, rules)
    outline = Outline.of(road)
    return [
        each for c in chunks for each in place_copings(build_ground(lowered[c], outline, maps[c]))
    ]


def quays(basin):
    return [(basin.buffer(9.0), LanduseClass.QUAY), (basin, LanduseClass.WATER)]


@pytest.mark.parametrize(
    ("basin", "chunks"), [(SMALL, (Chunk(0, 0),)), (BASIN, (Chunk(0, 0), Chunk(1, 0)))]
)
def test_a_coping_runs_around_the_basin(basin, chunks):
    found = copings(quays(basin), chunks)
    plan = shapely.union_all([footprint_of(each) for each in found])
    assert plan.area == pytest.approx(WIDTH * basin.length, rel=0.05)
    assert basin.boundary.buffer(1.2).contains(plan)
    # It lies on the quay but for its overhang, up to the steps of cells.
    assert plan.intersection(basin).area < 0.5 * plan.area
    assert basin.boundary.difference(plan.buffer(0.7)).length < 1.0
    for each in found:
        heights = each.geometry["lod2MultiSurface"].points[:, 2]
        np.testing.assert_allclose(np.unique(heights), np.array(HEIGHTS) + 7.0, atol=2e-3)
        assert each.attributes["template"] == "wall"


def test_copings_are_closed_bodies():
    for each in copings(quays(BASIN), (Chunk(0, 0), Chunk(1, 0))):
        polygons = each.geometry["lod2MultiSurface"]
        assert not list(find_faults(Bodies.of_solid(polygons)))


@pytest.mark.parametrize("angle", [0.0, 8.0, 21.0, 35.0, 50.0])
def test_copings_of_neighbouring_chunks_meet_without_gap_and_overlap(angle):
    """A basin across the border at x = 200 m: in plan, its copings are one ring of stone."""
    basin = shapely.affinity.rotate(shapely.box(150.0, 60.0, 250.0, 120.0), angle)
    plans = [footprint_of(each) for each in copings(quays(basin), (Chunk(0, 0), Chunk(1, 0)))]
    whole = shapely.union_all(plans)
    assert sum(plan.area for plan in plans) == pytest.approx(whole.area, abs=1e-2)
    near = shapely.box(197.0, 0.0, 203.0, 200.0)
    ring = whole.buffer(0.01).intersection(near)
    assert len(shapely.get_parts(ring)) == 2
    for part in shapely.get_parts(ring):
        assert part.bounds[0] == pytest.approx(197.0)
        assert part.bounds[2] == pytest.approx(203.0)
        # As wide at the border as beside it.
        widths = [
            part.intersection(shapely.LineString([(x, 0.0), (x, 200.0)])).length
            for x in (199.98, 200.02)
        ]
        assert min(widths) > 0.9 * WIDTH


def test_a_pool_of_a_few_cells_has_no_coping_or_a_whole_one():
    for side in (0.9, 1.7, 2.5, 3.3):
        pool = shapely.box(100.0, 100.0, 100.0 + side, 100.0 + side)
        for each in copings(quays(pool), (Chunk(0, 0),)):
            assert np.isfinite(each.geometry["lod2MultiSurface"].points).all()


def test_low_walls_have_none():
    pond = [(SMALL.buffer(3.0), LanduseClass.PARKING), (SMALL, LanduseClass.WATER)]
    assert not copings(pond, (Chunk(0, 0),))
