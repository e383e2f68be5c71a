"""A straight road with a kerb and a sidewalk through two chunks, with plots on both sides."""

from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest

from envgen_usd.chunks import HEIGHT_SAMPLES, LANDUSE_CELLS, Chunk, snap
from envgen_usd.city.generate import build_city, plan_city
from envgen_usd.city.roads.road_index import RoadIndex
from envgen_usd.environment_files import read_profile
from envgen_usd.models.ground import HeightMap
from envgen_usd.models.landuse import LanduseClass, LanduseMap, Plot
from envgen_usd.models.road_surface import LaneLine, Patch, RoadLine, RoadSurface

ROAD_Y = 100.0
LENGTH = 400.0
# (patch, y from, y to, z)
STRIPS = (
    ("road_7_s0_lane_1", "driving", 1, 0.0, 3.5, 0.0),
    ("road_7_s0_lane_-1", "driving", -1, -3.5, 0.0, 0.0),
    ("road_7_s0_lane_-2", "sidewalk", -2, -5.5, -3.5, 0.12),
)


def _strip(y0, y1, z0, z1, step):
    """Quads along x as triangles, counter-clockwise from above."""
    x = np.arange(0.0, LENGTH + step / 2, step)
    low = np.column_stack([x, np.full_like(x, ROAD_Y + y0), np.full_like(x, z0)])
    high = np.column_stack([x, np.full_like(x, ROAD_Y + y1), np.full_like(x, z1)])
    n = len(x)
    i = np.arange(n - 1)
    triangles = np.concatenate(
        [np.stack([i, i + 1, n + i + 1], 1), np.stack([i, n + i + 1, n + i], 1)]
    )
    return np.concatenate([low, high]), triangles


def make_surface(step=10.0):
    patches, vertices, triangles, owners = [], [], [], []

    def add(patch, part):
        offset = sum(len(v) for v in vertices)
        vertices.append(part[0])
        triangles.append(part[1] + offset)
        owners.append(np.full(len(part[1]), len(patches)))
        patches.append(patch)

    for name, lane_type, lane, y0, y1, z in STRIPS:
        patch = Patch(name, "lane", lane_type, road="7", section=0, lane=lane)
        add(patch, _strip(y0, y1, z, z, step))
    kerb = Patch("road_7_s0_kerb_-2", "kerb", "sidewalk", road="7", section=0, lane=-2)
    add(kerb, _strip(-3.5, -3.5, 0.12, 0.0, step))
    mark = Patch(
        "road_7_s0_mark_0", "mark", "driving", "7", 0, 0, colour="standard", mark_type="solid"
    )
    add(mark, _strip(3.5, 3.62, 0.0, 0.0, step))
    points, inverse = np.unique(snap(np.concatenate(vertices)), axis=0, return_inverse=True)
    x = np.arange(0.0, LENGTH + 1.0, 10.0)
    lanes = tuple(
        _lane(name, lane_type, lane, (y0, y1), x) for name, lane_type, lane, y0, y1, _ in STRIPS
    )
    road = RoadLine(
        road="7",
        junction="",
        s=x,
        points=np.column_stack([x, np.full_like(x, ROAD_Y), np.zeros_like(x)]),
        heading=np.zeros_like(x),
        t_left=np.full_like(x, 3.62),
        t_right=np.full_like(x, -5.5),
        town="town",
    )
    return RoadSurface(
        vertices=points,
        triangles=inverse.reshape(-1)[np.concatenate(triangles)],
        triangle_patch=np.concatenate(owners),
        triangle_level=np.zeros(sum(len(t) for t in triangles), dtype=np.int64),
        patches=tuple(patches),
        outline=(),
        lanes=lanes,
        roads=(road,),
        crs="EPSG:25832",
        offset=(0.0, 0.0, 0.0),
    )


def _lane(name, lane_type, lane, sides, x):
    middle, width = sum(sides) / 2, sides[1] - sides[0]
    points = np.column_stack([x, np.full_like(x, ROAD_Y + middle), np.zeros_like(x)])
    if lane > 0:
        points = points[::-1]
    beside = {1: "", -1: "road_7_s0_lane_-2", -2: ""}[lane]
    return LaneLine(
        name, "7", 0, lane, lane_type, "", points, np.full(len(x), width), 13.9, right=beside
    )


def make_plots(width, depth, verge, landuse, road="7"):
    """Plots in rows on both sides of the road."""
    plots = []
    for number, x in enumerate(np.arange(2.0, LENGTH - width, width)):
        y = ROAD_Y + 3.62 + verge
        corners = np.array([[x, y], [x + width, y], [x + width, y + depth], [x, y + depth]])
        plots.append(Plot(f"plot_l{number}", corners, landuse, corners[:2], road))
        y = ROAD_Y - 5.5 - verge
        corners = np.array([[x + width, y], [x, y], [x, y - depth], [x + width, y - depth]])
        plots.append(Plot(f"plot_r{number}", corners, landuse, corners[:2], road))
    return tuple(plots)


def make_landuse(chunk, plots, landuse):
    x, y = (
        axis.reshape(shape)
        for axis, shape in zip(chunk.cell_centres(), ((1, -1), (-1, 1)), strict=True)
    )
    classes = np.full((LANDUSE_CELLS, LANDUSE_CELLS), LanduseClass.GRASS, dtype=np.uint8)
    classes[np.broadcast_to((y > ROAD_Y - 5.5) & (y < ROAD_Y + 3.62), classes.shape)] = 1
    classes[np.broadcast_to(y < ROAD_Y - 70.0, classes.shape)] = LanduseClass.WOOD
    numbers = np.zeros(classes.shape, dtype=np.int64)
    for number, plot in enumerate(plots, start=1):
        low, high = plot.polygon.min(axis=0), plot.polygon.max(axis=0)
        inside = (x > low[0]) & (x < high[0]) & (y > low[1]) & (y < high[1])
        classes[inside], numbers[inside] = landuse, number
    return LanduseMap(chunk, classes, numbers)


def make_heights(chunk, slope=0.0):
    """A plane that rises along y beside the road."""
    _, y = chunk.corner_axes()
    rise = np.maximum(np.abs(y - ROAD_Y) - 6.0, 0.0) * slope
    heights = np.broadcast_to(snap(rise)[:, None], (HEIGHT_SAMPLES, HEIGHT_SAMPLES)).copy()
    return HeightMap(chunk, heights)


@pytest.fixture(scope="session")
def surface():
    return make_surface()


@pytest.fixture(scope="session")
def by_place(surface):
    return RoadIndex(surface)


@pytest.fixture(scope="session")
def chunks():
    return (Chunk(0, 0), Chunk(1, 0))


SIZES = {"row": (9.0, 35.0, 1.5), "detached": (25.0, 30.0, 2.5), "hall": (60.0, 65.0, 3.0)}


@pytest.fixture(scope="session")
def make_map(by_place, chunks):
    """Function that builds both chunks of an environment."""

    @cache
    def make(country, area, seed=0, slope=0.05, *, doubled=False, door=None):
        profile = read_profile(country, area)
        if door is not None:
            doors = replace(profile.buildings.doors, width=(door, door))
            profile = replace(profile, buildings=replace(profile.buildings, doors=doors))
        kind = profile.plots.landuse
        plots = make_plots(*SIZES[profile.buildings.style], kind)
        if doubled:
            aside = np.array([1.0, 0.0])
            moved = [replace(p, id=f"other_{p.id}", polygon=p.polygon + aside) for p in plots]
            plots = (*plots, *moved)
        landuse = {chunk: make_landuse(chunk, plots, kind) for chunk in chunks}
        heights = {chunk: make_heights(chunk, slope) for chunk in chunks}
        cities = tuple(
            build_city(
                plan_city(chunk, plots, by_place, heights[chunk], profile, seed),
                landuse[chunk],
                profile,
            )
            for chunk in chunks
        )
        return SimpleNamespace(
            profile=profile, plots=plots, landuse=landuse, heights=heights, cities=cities
        )

    return make
