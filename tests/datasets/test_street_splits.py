"""Streets, and the splits that they are in."""

import numpy as np
import pytest

from envgen_usd.errors import EnvgenError
from envgen_usd.opendrive.reader import read_network
from envgen_usd.recipe.build_options import demo_road
from envgen_usd.recipe.dataset_recipe import DatasetRecipe, EnvironmentChoice, RoadChoice
from envgen_usd.recipe.street_splits import share_streets, streets_of
from envgen_usd.render.cameras.camera_pose import Pose, look_at
from envgen_usd.render.render_scene import Lane
from envgen_usd.render.trajectories.nearest_lanes import nearest_lanes

HEADER = '<OpenDRIVE><header revMajor="1" revMinor="4" name="" version="1.00"/>'
ROAD = (
    '<road id="{id}" length="100.0" junction="{junction}"><link>{links}</link><planView>'
    '<geometry s="0" x="{x}" y="0" hdg="0" length="100.0"><line/></geometry></planView>'
    '<lanes><laneSection s="0"><center><lane id="0" type="none" level="false"/></center><right>'
    '<lane id="-1" type="driving" level="false"><width sOffset="0" a="3.5" b="0" c="0" d="0"/>'
    "</lane></right></laneSection></lanes></road>"
)


def _link(end, kind, id_):
    point = ' contactPoint="start"' if kind == "road" else ""
    return f'<{end} elementType="{kind}" elementId="{id_}"{point}/>'


def recipe(*roads, seed=0, **splits):
    chosen = tuple(RoadChoice(str(road)) if isinstance(road, str) else road for road in roads)
    return DatasetRecipe(
        chosen, (EnvironmentChoice("1", "residential"),), 1, splits=splits, seed=seed
    )


@pytest.fixture
def row(tmp_path):
    """Roads 1 and 2 in a row, a junction with road 7, and road 3 beyond it."""
    links = {
        "1": _link("successor", "road", "2"),
        "2": _link("predecessor", "road", "1") + _link("successor", "junction", "9"),
        "7": _link("predecessor", "road", "2") + _link("successor", "road", "3"),
        "3": _link("predecessor", "junction", "9"),
    }
    roads = "".join(
        ROAD.format(id=id_, junction="9" if id_ == "7" else "-1", links=text, x=100 * n)
        for n, (id_, text) in enumerate(links.items())
    )
    junction = (
        '<junction id="9" name=""><connection id="0" incomingRoad="2" connectingRoad="7" '
        'contactPoint="start"><laneLink from="-1" to="-1"/></connection></junction>'
    )
    path = tmp_path / "row.xodr"
    path.write_text(f"{HEADER}{roads}{junction}</OpenDRIVE>")
    return path


def test_roads_in_a_row_are_a_street_and_a_connecting_road_belongs_to_what_leads_in(row):
    streets = streets_of(read_network(row))
    assert streets == {"1": "1", "2": "1", "7": "1", "3": "3"}


def test_each_street_is_in_one_split_and_each_split_has_a_street(row):
    splits = share_streets(recipe(str(row), train=0.8, val=0.2), row)["row"]
    assert splits.splits == {"1": "train", "3": "val"}
    assert splits.of_lane("road_7_s0_lane_-1_chunk_0_0") == "1"
    assert splits.split_of("road_3_s2_lane_2") == "val"
    assert splits.split_of("") == "train"


def test_too_few_streets_for_the_splits_are_named(row):
    wanted = recipe(str(row), train=0.4, val=0.3, test=0.3)
    with pytest.raises(
        EnvgenError, match=r"splits: .* gets no street: 2 streets are too few for 3"
    ):
        share_streets(wanted, row)


def test_a_road_can_be_a_split_of_its_own(row):
    other = RoadChoice(str(demo_road("straight")), "test")
    streets = share_streets(recipe(str(row), other, train=0.5, val=0.5, test=0.0), row)
    assert set(streets["straight"].splits.values()) == {"test"}
    assert set(streets["row"].splits.values()) == {"train", "val"}


def test_metres_follow_the_shares_on_a_town():
    road = str(demo_road("town"))
    streets = share_streets(recipe(road, train=0.7, val=0.3), demo_road("town"))["town"]
    metres = dict.fromkeys(("train", "val"), 0.0)
    for street, length in streets.lengths.items():
        metres[streets.splits[street]] += length
    assert metres["train"] / sum(metres.values()) == pytest.approx(0.7, abs=0.15)


def test_a_frame_is_on_the_nearest_lane_that_it_follows():
    lanes = [
        Lane("east", np.array([(0.0, 0.0, 0.0), (100.0, 0.0, 0.0)])),
        Lane("west", np.array([(100.0, 3.5, 0.0), (0.0, 3.5, 0.0)])),
        Lane("above", np.array([(0.0, 0.0, 8.0), (100.0, 0.0, 8.0)])),
    ]
    eyes = [(30.0, 0.4, 1.5), (30.0, 1.9, 1.5), (30.0, 3.1, 1.5), (30.0, 0.0, 9.5)]
    ways = [(1.0, 0.0), (-1.0, 0.0), (-1.0, 0.1), (1.0, 0.1)]
    poses = [
        Pose(look_at(np.array(eye), np.add(eye, (*way, 0.0))))
        for eye, way in zip(eyes, ways, strict=True)
    ]
    assert nearest_lanes(lanes, poses) == ["east", "west", "west", "above"]
    assert nearest_lanes([], poses) == [""] * 4
    assert nearest_lanes(lanes, []) == []
