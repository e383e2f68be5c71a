"""Paved ways: from the street to every door, and houses that stand where a way leads."""

from dataclasses import replace

import numpy as np
import pytest

from envgen_usd.chunks import CELL_SIZE, Chunk
from envgen_usd.city.generate import build_city, pave_ways
from envgen_usd.models.landuse import LanduseClass
from envgen_usd.profiles import known_environments

ENVIRONMENTS = [
    (country, area) for country, areas in known_environments().items() for area in areas
]
ROAD = (94.5, 103.62)
"""Borders of the road along x."""


def street_doors(building):
    """Middles of the doors of a building and its garage, in plan."""
    return [
        opening.polygons.points[:, :2].mean(axis=0)
        for part in building.walk()
        for wall in part.surfaces
        for opening in wall.openings
        if opening.kind == "DoorSurface"
    ]


@pytest.mark.parametrize(("country", "area"), ENVIRONMENTS)
def test_a_way_leads_from_the_road_to_every_door(make_map, surface, country, area):
    scene = make_map(country, area)
    chunk = Chunk(0, 0)
    paved = pave_ways(
        chunk, scene.plots, surface, scene.heights[chunk], scene.landuse[chunk], scene.profile, 0
    )
    doors = [door for b in scene.cities[0].of_kind("Building") for door in street_doors(b)]
    inside = [door for door in doors if 2.0 < door[0] < 198.0]
    assert len(inside) > 3
    for x, y in inside:
        near = ROAD[0] if y < 100.0 else ROAD[1]
        places = np.arange(min(y, near) + 0.5, max(y, near) - 0.5, 0.3)
        rows, column = (places / CELL_SIZE).astype(int), int(x / CELL_SIZE)
        found = paved.classes[rows, column]
        assert np.isin(found, (LanduseClass.ACCESS, LanduseClass.ROAD)).all()
    road = scene.landuse[chunk].classes == LanduseClass.ROAD
    assert (paved.classes[road] == LanduseClass.ROAD).all()
    assert (paved.plots == scene.landuse[chunk].plots).all()


def test_chunks_agree_on_a_way_over_their_border(make_map, surface, chunks):
    """Ways along the border are the same whichever chunk paves them."""
    scene = make_map("2", "residential")
    one, two = (
        pave_ways(c, scene.plots, surface, scene.heights[c], scene.landuse[c], scene.profile, 0)
        for c in chunks
    )
    assert ((one.classes == LanduseClass.ACCESS).any(axis=0)).any()
    before, after = one.classes[:, -1], two.classes[:, 0]
    assert np.mean((before == LanduseClass.ACCESS) != (after == LanduseClass.ACCESS)) < 0.05


@pytest.mark.parametrize(("country", "area"), ENVIRONMENTS)
def test_houses_stand_where_the_way_crosses_the_frontage(make_map, surface, country, area):
    scene = make_map(country, area)
    chunk = Chunk(0, 0)
    share = 0.4
    plots = tuple(
        replace(p, access=p.frontage[0] + share * (p.frontage[1] - p.frontage[0]))
        for p in scene.plots
    )
    city = build_city(
        chunk, plots, surface, scene.heights[chunk], scene.landuse[chunk], scene.profile, 0
    )
    offsets = []
    for building in city.of_kind("Building"):
        plot = next(p for p in plots if f"building_{p.id}" == building.id)
        offsets.append(min(abs(door[0] - plot.access[0]) for door in street_doors(building)))
    limit = {"row": 2.5, "detached": 0.5, "hall": 6.0}[scene.profile.buildings.style]
    assert np.median(offsets) < limit
