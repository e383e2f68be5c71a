"""Signs without a face in the library are named, each kind once."""

import pytest

from envgen_usd.assets.asset_catalogue import read_catalogue
from envgen_usd.opendrive.features.road_features import road_features
from envgen_usd.opendrive.reader import read_network
from envgen_usd.recipe.unknown_signs import unknown_signs

ROAD = """<OpenDRIVE><header revMajor="1" revMinor="8"/>
  <road name="" id="1" length="100" junction="-1">
  <planView><geometry s="0" x="0" y="0" hdg="0" length="100"><line/></geometry></planView>
  <lanes><laneSection s="0"><center><lane id="0" type="none"/></center><right>
  <lane id="-1" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane></right>
  </laneSection></lanes><signals>{}</signals></road></OpenDRIVE>"""


@pytest.fixture
def issues_of(tmp_path):
    """Issues of signals given as (id, country, type, subtype, name)."""

    def read(*signals):
        path = tmp_path / "map.xodr"
        path.write_text(ROAD.format("".join(signal(*facts) for facts in signals)))
        return unknown_signs(road_features(read_network(path)), read_catalogue())

    return read


def signal(name_id, country, type_, subtype="-1", name=""):
    return (
        f'<signal id="{name_id}" s="{10 * int(name_id)}" t="-6" zOffset="2" dynamic="no"'
        f' orientation="+" country="{country}" type="{type_}" subtype="{subtype}" name="{name}"/>'
    )


def test_known_signs_and_lights_are_no_issue(issues_of):
    limit = ("4", "DE", "274", "56")
    light = ("3", "OpenDRIVE", "1000001")
    assert issues_of(("1", "DE", "206"), ("2", "US", "R1-1"), light, limit) == ()


def test_each_unknown_kind_is_named_once_with_its_number_and_first_place(issues_of):
    known, unknown = ("1", "DE", "206"), [("2", "DE", "457"), ("3", "DE", "457")]
    issues = issues_of(known, *unknown, ("4", "DE", "458"), ("5", "", "-1", "-1", "Sign_Foo"))
    assert [issue.kind for issue in issues] == ["signal.no_face"] * 3
    assert [issue.where for issue in issues] == [
        f"road[id=1]/signals/signal[id={number}]" for number in (2, 4, 5)
    ]
    assert "2 signs" in issues[0].message
    assert "'457'" in issues[0].message
    assert "'Sign_Foo'" in issues[2].message
