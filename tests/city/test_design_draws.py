"""Every decision about a building has a random figure of its own."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from scipy.stats import chi2_contingency

from envgen_usd.chunks import HEIGHT_SAMPLES, Chunk
from envgen_usd.city.buildings.design_draws import draw_design
from envgen_usd.city.city_scene import Scene
from envgen_usd.city.footprints import Footprints
from envgen_usd.city.ground_heights import Ground
from envgen_usd.city.plots.building_placement import find_gates
from envgen_usd.city.plots.building_plans import plan_buildings
from envgen_usd.city.road_plan import RoadPlan
from envgen_usd.city.roads.road_index import RoadIndex
from envgen_usd.environment_files import read_profile
from envgen_usd.models.ground import HeightMap
from envgen_usd.models.landuse import LanduseClass, Plot
from envgen_usd.seeds import Draws

COUNT = 1000
SPACE = (60.0, 40.0)
"""Room for all that can be drawn, so that no figure is cut off."""
TIED = {
    ("bay storeys", "storeys"),
    *(("bay", f"bay {size}") for size in ("depth", "storeys", "width")),
    *(("chimney", f"chimney {size}") for size in ("across", "along", "height", "width")),
}
"""A bay is lower than its house; what is not there has no size."""


@pytest.fixture(scope="module")
def designs():
    """Houses with a wing on one side and all else that a house can have."""
    rules = read_profile("2", "residential").buildings
    details = replace(
        rules.details,
        footprints={"l": 1.0},
        front_gable=0.5,
        bays=0.6,
        dormers=0.5,
        roof_windows=0.5,
        balconies=0.5,
        porches=0.5,
        garages=0.5,
        embrasure=(0.0, 0.2),
    )
    rules = replace(
        rules,
        width=(14.0, 18.0),
        depth=(24.0, 30.0),
        storeys=(3.0, 6.0),
        roofs={"gabled": 1.0, "hipped": 1.0},
        overhang=(0.1, 0.5),
        materials={"flagstone": 1.0, "brick_red": 1.0},
        doors=replace(rules.doors, sill=(0.0, 0.2), spacing=(50.0, 100.0)),
        details=details,
    )
    return [draw_design(rules, SPACE, Draws(0, "test", number)) for number in range(COUNT)]


def decisions(design):
    """The figures of a house that the environment does not tie to one another."""
    (wing,) = design.extras.wings
    bay, chimney = design.extras.bay, design.chimney
    found = {
        "width": design.width,
        "depth": design.depth,
        "storeys": design.storeys,
        "storey height": design.storey_height,
        "roof": design.roof == "hipped",
        "slope": design.slope,
        "overhang": design.overhang,
        "plinth": design.plinth,
        "wall material": design.wall_material == "flagstone",
        "roof material": design.roof_material == "roof_slate",
        "window width": design.windows.width,
        "window height": design.windows.height,
        "window sill": design.windows.sill,
        "window spacing": design.windows.spacing,
        "door width": design.doors.width,
        "door height": design.doors.height,
        "door sill": design.doors.sill,
        "door spacing": design.doors.spacing,
        "wing side": wing.left > 1.0,
        "wing storeys": design.storeys - wing.storeys,
        "wing width": wing.width / design.width,
        "main depth": design.main_depth / design.depth,
        "front gable": wing.front,
        "dormers": design.extras.dormers > 0,
        "dormer width": design.extras.dormer_width,
        "balconies": design.extras.balconies,
        "porch": design.extras.porch,
        "garage": design.extras.garage > 0,
        "embrasure": design.extras.embrasure,
        "bay": bay is not None,
        "chimney": chimney is not None,
    }
    if bay is not None:
        found["bay width"] = bay.width - design.windows.width
        found["bay depth"] = bay.depth
        found["bay storeys"] = bay.storeys
    if chimney is not None:
        found["chimney along"] = chimney.along
        found["chimney across"] = chimney.across
        found["chimney width"] = chimney.width
        found["chimney height"] = chimney.height
    return found


def halves(values):
    """For each value: 1 in the upper half, 0 in the lower half, -1 where there is none."""
    known = values[~np.isnan(values)]
    middle = np.median(known)
    upper = values > middle if (known > middle).any() else values >= middle
    return np.where(np.isnan(values), -1, upper)


def test_no_decision_tells_another(designs):
    """Chi-square of every pair of decisions, each cut into halves."""
    tables = [decisions(design) for design in designs]
    names = sorted({name for table in tables for name in table})
    cut = {
        name: halves(np.array([table.get(name, np.nan) for table in tables], dtype=np.float64))
        for name in names
    }
    pairs = set(combinations(names, 2)) - TIED
    for one, other in sorted(pairs):
        a, b = cut[one], cut[other]
        counts = np.array([[np.sum((a == i) & (b == j)) for j in (0, 1)] for i in (0, 1)])
        assert counts.sum() >= 400, (one, other)
        # Bonferroni: all pairs together raise a false alarm with a probability of 1 %.
        assert chi2_contingency(counts).pvalue > 0.01 / len(pairs), (one, other, counts)


def test_the_side_of_a_wing_does_not_tell_its_storeys(designs):
    """The defect that this file guards: right-hand wings were lower in every case."""
    wings = [(design, design.extras.wings[0]) for design in designs]
    right = np.array([wing.left > 1.0 for _, wing in wings])
    low = np.array([wing.storeys < design.storeys for design, wing in wings])
    assert right.mean() == pytest.approx(0.5, abs=0.06)
    assert low[right].mean() == pytest.approx(0.6, abs=0.08)
    assert low[~right].mean() == pytest.approx(0.6, abs=0.08)


def test_a_weight_that_changes_moves_no_other_choice():
    """Figures follow from their names, so a flat roof leaves windows and walls as they are."""
    rules = read_profile("2", "residential").buildings
    flat = replace(rules, roofs={"flat": 1.0}, chimney=0.0)
    for number in range(50):
        pitched, level = (draw_design(r, SPACE, Draws(0, "t", number)) for r in (rules, flat))
        assert level.roof == "flat"
        assert (level.windows, level.doors) == (pitched.windows, pitched.doors)
        assert (level.storeys, level.plinth) == (pitched.storeys, pitched.plinth)
        assert level.wall_material == pitched.wall_material


def flat_scene(surface):
    chunk = Chunk(0, 0)
    ground = Ground(HeightMap(chunk, np.zeros((HEIGHT_SAMPLES, HEIGHT_SAMPLES))))
    roads = RoadIndex(surface)
    road = RoadPlan(roads.triangles_near(chunk.bounds, 0.0))
    return Scene(chunk, roads, road, Footprints([]), ground, 0)


def test_side_walls_have_windows_where_no_house_stands_beside_them(surface):
    """Four plots in a row, then a gap, then one plot: of ten side walls four are open."""
    scene, rules = flat_scene(surface), read_profile("1", "residential").buildings
    corners = np.array([[0.0, 0.0], [9.0, 0.0], [9.0, 35.0], [0.0, 35.0]])
    places = [20.0, 29.0, 38.0, 47.0, 66.0]
    plots = [
        Plot(f"plot_{n}", c, LanduseClass.LAWN, c[:2], "7", side="left")
        for n, c in enumerate(corners + np.array([x, 106.0]) for x in places)
    ]

    def gables(share):
        details = replace(rules.details, gable_windows=share, back_buildings=0.0)
        return [
            plan.design.gables
            for plan in plan_buildings(scene, plots, replace(rules, details=details))
        ]

    none, both = (False, False), (True, True)
    # From the street the first house is the leftmost; its right neighbour stands beside it.
    assert gables(1.0) == [(False, True), none, none, (True, False), both]
    assert gables(0.0) == [none] * 5


def test_the_two_rows_of_a_street_have_building_lines_of_their_own(surface):
    """Houses of a row stand in a line; the row across the street says nothing about it."""
    scene, rules = flat_scene(surface), read_profile("1", "residential").buildings
    corners = np.array([[0, 0], [9, 0], [9, 35], [0, 35]]) + np.array([20.0, 120.0])

    def setback(road, side, number):
        plot = Plot(
            f"plot_{road}_{side}_{number}",
            corners,
            LanduseClass.LAWN,
            corners[:2],
            road,
            side=side,
        )
        (gate, *_) = find_gates(plan_buildings(scene, [plot], rules))
        return np.hypot(*(gate.place - gate.foot))

    roads = [str(number) for number in range(400)]
    left, right, next_door = (
        np.array([setback(road, side, number) for road in roads])
        for side, number in (("left", 0), ("right", 0), ("left", 1))
    )
    spread = rules.setback[1] - rules.setback[0]
    assert np.abs(left - next_door).max() < 0.061 * spread
    a, b = halves(left), halves(right)
    counts = np.array([[np.sum((a == i) & (b == j)) for j in (0, 1)] for i in (0, 1)])
    assert chi2_contingency(counts).pvalue > 0.01, counts


def test_a_shed_roof_is_no_wall():
    """Its one slope spans the house, so that the pitch of a gable would double the height."""
    rules = replace(read_profile("1", "residential").buildings, roofs={"shed": 1.0})
    steep = [draw_design(rules, SPACE, Draws(0, "t", number)) for number in range(20)]
    assert rules.roof_pitch[0] > 14.0
    assert max(design.slope for design in steep) == pytest.approx(np.tan(np.radians(14.0)))
    level = replace(rules, roof_pitch=(5.0, 6.0))
    low = draw_design(level, SPACE, Draws(0, "t", 0)).slope
    assert np.tan(np.radians(5.0)) <= low <= np.tan(np.radians(6.0))
