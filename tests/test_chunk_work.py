"""A chunk costs what lies in it: the same work on a small map and on a large one.

Work is counted, not timed: calls of functions, and memory that is taken. The chunk in the middle of
both maps holds the same, and so do its products.
"""

import gc
import pickle
import sys
import tracemalloc
from collections.abc import Callable
from types import FrameType
from typing import NamedTuple

import numpy as np
import pytest

from envgen_usd.chunks import HEIGHT_SAMPLES, LANDUSE_CELLS, Chunk
from envgen_usd.city.generate import CityPlan, build_city, pave_ways, plan_city
from envgen_usd.city.roads.road_index import RoadIndex
from envgen_usd.environment_files import read_profile
from envgen_usd.geometry.road_outline import Outline
from envgen_usd.landuse.landuse_regions import find_regions
from envgen_usd.landuse.plot_index import PlotIndex
from envgen_usd.landuse.road_areas import RoadAreas
from envgen_usd.models.ground import HeightMap
from envgen_usd.models.landuse import LanduseClass, LanduseMap, Plot
from envgen_usd.recipe.map_land import read_road
from envgen_usd.terrain.ground_mesh import build_ground

MIDDLE = Chunk(0, 0)
PROFILE = read_profile("1", "residential")
LENGTH = 200
MARK = '<roadMark sOffset="0" type="solid" color="standard" width="0.12"/>'
SMALL, LARGE = 1, 4
"""Roads on either side of the middle, along both axes: 9 and 81 roads."""


def lane(number: int, kind: str, width: float, link: str) -> str:
    return (
        f'<lane id="{number}" type="{kind}"><link>{link.format(number)}</link>'
        f'<width sOffset="0" a="{width}" b="0" c="0" d="0"/>'
        f"{MARK}</lane>"
    )


def road(column: int, row: int, reach: int) -> str:
    """A road of a street that runs through all columns, with a crosswalk and a sign."""
    ends = {"predecessor": column - 1, "successor": column + 1}
    there = {role: beside for role, beside in ends.items() if abs(beside) <= reach}
    links = "".join(
        f'<{role} elementType="road" elementId="{beside}_{row}" contactPoint="{point}"/>'
        for (role, beside), point in zip(ends.items(), ("end", "start"), strict=True)
        if role in there
    )
    link = "".join(f'<{role} id="{{0}}"/>' for role in there)
    sides = {
        "left": lane(2, "sidewalk", 2, link) + lane(1, "driving", 3.5, link),
        "center": f'<lane id="0" type="none">{MARK}</lane>',
        "right": lane(-1, "driving", 3.5, link) + lane(-2, "sidewalk", 2, link),
    }
    lanes = "".join(f"<{side}>{text}</{side}>" for side, text in sides.items())
    corners = "".join(
        f'<cornerRoad s="{s}" t="{t}" dz="0" height="0"/>'
        for s, t in ((88.5, -3.4), (91.5, -3.4), (91.5, 3.4), (88.5, 3.4))
    )
    return f"""<road id="{column}_{row}" length="{LENGTH}" junction="-1"><link>{links}</link>
        <planView><geometry s="0" x="{LENGTH * column - 30}" y="{LENGTH * row + 100}" hdg="0"
        length="{LENGTH}"><line/></geometry></planView>
        <lanes><laneSection s="0">{lanes}</laneSection></lanes>
        <objects><object id="walk" type="crosswalk" s="90" t="0" zOffset="0" orientation="none">
        <outline>{corners}</outline></object></objects>
        <signals><signal id="sign_{column}_{row}" s="80" t="-6" zOffset="2" orientation="+"
        dynamic="no" type="274" country="DE"/></signals></road>"""


class Map(NamedTuple):
    """What the chunk in the middle is built from, all as a new worker process has it."""

    roads: RoadIndex
    outline: Outline
    areas: RoadAreas
    plots: tuple[Plot, ...]


@pytest.fixture(scope="module")
def new_map(tmp_path_factory) -> Callable[[int], Map]:
    """Function that gives a map of streets, never asked before, by its reach."""
    made = {}
    for reach in (SMALL, LARGE):
        path = tmp_path_factory.mktemp("maps") / f"{reach}.xodr"
        places = range(-reach, reach + 1)
        roads = "".join(road(column, row, reach) for row in places for column in places)
        path.write_text(f'<OpenDRIVE><header revMajor="1" revMinor="7"/>{roads}</OpenDRIVE>')
        surface = read_road(path, 0.02)[1]
        plots = PlotIndex([p for x in places for y in places for p in plots_of(Chunk(x, y))])
        whole = Map(
            RoadIndex(surface), Outline.of(surface), RoadAreas(surface), plots.touching(MIDDLE)
        )
        made[reach] = pickle.dumps(whole)
    return lambda reach: pickle.loads(made[reach])


def plots_of(chunk: Chunk) -> list[Plot]:
    outline = np.array([(0.0, 0.0), (30.0, 0.0), (30.0, 40.0), (0.0, 40.0)])
    corners = [outline + chunk.origin + (x, 110.0) for x in (20.0, 60.0, 100.0)]
    return [
        Plot(f"plot_{chunk.prim_name}_{n}", polygon, LanduseClass.LAWN, polygon[:2])
        for n, polygon in enumerate(corners)
    ]


HEIGHTS = HeightMap(MIDDLE, np.zeros((HEIGHT_SAMPLES, HEIGHT_SAMPLES)))
LANDUSE = LanduseMap(
    MIDDLE,
    np.full((LANDUSE_CELLS, LANDUSE_CELLS), LanduseClass.LAWN, dtype=np.uint8),
    np.zeros((LANDUSE_CELLS, LANDUSE_CELLS), dtype=np.int64),
)


def plan_of(map_: Map) -> CityPlan:
    return plan_city(MIDDLE, map_.plots, map_.roads, HEIGHTS, PROFILE, 0)


STEPS: dict[str, Callable[[Map], object]] = {
    "ways": lambda map_: pave_ways(plan_of(map_), LANDUSE).classes.tobytes(),
    "regions": lambda map_: [
        region.shape.wkb for region in find_regions(LANDUSE, map_.plots, map_.areas)
    ],
    "ground": lambda map_: build_ground(HEIGHTS, map_.outline, LANDUSE).vertices.tobytes(),
    "city": lambda map_: pickle.dumps(build_city(plan_of(map_), LANDUSE, PROFILE).objects),
}


def calls_of(step: Callable[[Map], object], map_: Map) -> int:
    """Number of functions, of Python and of libraries, that a step calls."""
    count = 0

    def see(_frame: FrameType, event: str, _argument: object) -> None:
        nonlocal count
        count += event in {"call", "c_call"}

    sys.setprofile(see)
    try:
        step(map_)
    finally:
        sys.setprofile(None)
    return count


def memory_of(step: Callable[[Map], object], map_: Map) -> int:
    """Bytes that a step takes at most."""
    gc.collect()
    gc.disable()  # When it runs is chance, and what it has not freed yet counts.
    tracemalloc.start()
    try:
        step(map_)
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
        gc.enable()


@pytest.mark.parametrize("name", STEPS)
def test_a_chunk_is_the_same_work_on_any_map(new_map, name):
    step = STEPS[name]
    assert step(new_map(SMALL)) == step(new_map(LARGE))
    small, large = (calls_of(step, new_map(reach)) for reach in (SMALL, LARGE))
    assert large <= 1.01 * small
    small, large = (memory_of(step, new_map(reach)) for reach in (SMALL, LARGE))
    assert large <= 1.02 * small
