"""Bridges and tunnels of a road file, and lanes that own no area."""

from dataclasses import replace

import numpy as np
import pytest

from envgen_usd.chunks import Chunk
from envgen_usd.city.roads.road_city import build_road_city
from envgen_usd.city.roads.road_index import RoadIndex
from envgen_usd.city.roads.road_model import make_roads
from envgen_usd.citygml.city_validation import schema_issues
from envgen_usd.citygml.read import read_city
from envgen_usd.citygml.write import write_city
from envgen_usd.environment_files import read_profile
from envgen_usd.models.road_surface import LaneLine
from envgen_usd.recipe.map_land import read_road

ROAD = """<?xml version="1.0"?>
<OpenDRIVE><header revMajor="1" revMinor="7" name="small"/>
<road name="a" length="150" id="7" junction="-1">
<planView><geometry s="0" x="10" y="90" hdg="0" length="150"><arc curvature="0.001"/></geometry>
</planView>
<lanes><laneSection s="0">
<left><lane id="1" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane></left>
<center><lane id="0" type="none"/></center>
<right><lane id="-1" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane></right>
</laneSection></lanes>
<objects><bridge id="1" s="20" length="30" name="" type="concrete"/>
<tunnel id="2" s="90" length="40" name="" type="standard" lighting="0" daylight="0"/></objects>
</road></OpenDRIVE>
"""


@pytest.fixture(scope="module")
def city(tmp_path_factory):
    folder = tmp_path_factory.mktemp("road")
    (folder / "road.xodr").write_text(ROAD, encoding="utf-8")
    _, surface = read_road(folder / "road.xodr", 0.02)
    city = build_road_city(surface, read_profile("1", "residential"))
    write_city(city, folder / "city.gml")
    return folder / "city.gml", read_city(folder / "city.gml")


def test_a_bridge_and_a_tunnel_are_features_of_their_own(city, citygml_schemas):
    path, found = city
    (bridge,) = found.of_kind("Bridge")
    (tunnel,) = found.of_kind("Tunnel")
    assert bridge in found.objects
    assert tunnel in found.objects
    assert bridge.attributes["opendrive_road"] == tunnel.attributes["opendrive_road"] == "7"
    assert schema_issues(path, citygml_schemas) == ()
    assert all(s.attributes["opendrive_kind"] == "lane" for road in found.of_kind("Road")
               for part in road.walk() for s in part.surfaces)  # fmt: skip


def test_their_faces_have_the_class_of_their_direction(city):
    _, found = city
    (bridge,) = found.of_kind("Bridge")
    (tunnel,) = found.of_kind("Tunnel")
    under = {s.kind: s.polygons.points for s in bridge.surfaces}
    # The deck is 0.9 m thick, its parapets 1 m high.
    assert under["OuterCeilingSurface"][:, 2].max() == pytest.approx(-0.9)
    assert np.ptp(under["OuterCeilingSurface"][:, 0]) == pytest.approx(30.0, abs=0.5)
    assert under["OuterFloorSurface"][:, 2].min() == pytest.approx(1.0)
    over = {s.kind: s.polygons.points for s in tunnel.surfaces}
    assert over["OuterFloorSurface"][:, 2].max() == pytest.approx(5.5)
    assert over["OuterCeilingSurface"][:, 2].max() == pytest.approx(5.0)


def test_a_lane_without_an_area_is_there_with_its_line(surface):
    """As in junctions, where another lane's area lies over it."""
    profile = read_profile("1", "residential")
    line = np.array([[150.0, 98.0, 0.0], [250.0, 99.0, 0.0]])
    lane = LaneLine("road_9_s0_lane_-1", "9", 0, -1, "driving", "5", line, np.full(2, 3.5), 13.9)
    first = replace(surface.lanes[1], successors=(lane.id,))
    whole = replace(surface, lanes=(surface.lanes[0], first, surface.lanes[2], lane))
    roads = RoadIndex(whole)
    spaces = {
        space.id: space
        for chunk in (Chunk(0, 0), Chunk(1, 0))
        for road in make_roads(chunk, roads, profile)
        for space in road.walk()
    }
    one, two = (spaces[f"{lane.id}_chunk_{x}_0"] for x in (0, 1))
    assert one.surfaces == two.surfaces == ()
    assert one.relations["successor"] == (f"../1_0/city.gml#{two.id}",)
    assert sum(np.ptp(space.curves["lod2MultiCurve"][0][:, 0]) for space in (one, two)) == 100.0
    before = spaces["road_7_s0_lane_-1_chunk_1_0"]
    assert before.relations["successor"] == (f"../0_0/city.gml#{one.id}",)
