"""People on sidewalks, at crossings and stops; bicycles and bins."""

import numpy as np
import pytest
import shapely
from tests.traffic.parked_streets import (
    NARROW,
    WIDE,
    Y,
    actors_of,
    full_kerbs,
    places,
    plans,
    road_text,
    rules,
)

from envgen_usd.models.actor_rules import KerbObjectRules, PeopleRules
from envgen_usd.models.city_model import City, CityObject, Placement

STREET = road_text(NARROW, NARROW)


def test_density_is_that_of_the_rules(tmp_path):
    crowd = PeopleRules((6.0, 6.0), {"1": 0.6, "2": 0.3, "3": 0.1}, 0.8)
    found = [len(actors_of(tmp_path, STREET, rules(people=crowd), seed=s)) for s in range(20)]
    # Two sidewalks of 160 m; a few have no room beside others.
    assert np.mean(found) == pytest.approx(6.0 * 3.2, rel=0.15)


def test_people_are_on_the_sidewalk_with_their_feet(tmp_path):
    crowd = PeopleRules((12.0, 12.0), {"1": 0.6, "2": 0.3, "3": 0.1}, 0.5)
    actors = actors_of(tmp_path, STREET, rules(people=crowd))
    assert len(actors) > 25
    for actor in actors:
        assert 3.5 < abs(actor.position[1] - Y) < 6.5
        assert actor.position[2] == pytest.approx(5.12, abs=1e-3)
        assert abs(actor.pitch) < 1e-6
    shapes = shapely.polygons(plans(actors))
    first, second = shapely.STRtree(shapes).query(shapes, predicate="intersects")
    assert (first == second).all()


def test_people_who_walk_go_along_the_sidewalk(tmp_path):
    for walking, pose in ((1.0, "walk"), (0.0, "standing")):
        crowd = PeopleRules((12.0, 12.0), {"1": 1.0}, walking)
        actors = actors_of(tmp_path, STREET, rules(people=crowd))
        assert len(actors) > 20
        assert all(a.look.selections["pose"].startswith(pose) for a in actors)
        along = np.abs(np.cos([a.heading for a in actors]))
        assert (along.mean() > 0.95) == (walking == 1.0)


def test_people_wait_at_both_ends_of_a_crossing(tmp_path):
    crosswalk = """<objects><object id="1" type="crosswalk" s="80" t="0" zOffset="0" length="4"
      width="7" height="0.01" hdg="0" orientation="none"/></objects>"""
    waiting = PeopleRules((0.0, 0.0), {"1": 1.0}, 0.5, crossing=(3.0, 3.0))
    text = road_text(NARROW, NARROW, rest=crosswalk)
    actors = actors_of(tmp_path, text, rules(people=waiting))
    assert places(actors).keys() == {"crossing"}
    assert {a.position[1] > Y for a in actors} == {True, False}
    for actor in actors:
        assert abs(actor.position[0] - 100.0) < 3.0
        assert 3.5 < abs(actor.position[1] - Y) < 5.5
        assert np.sin(actor.heading) * (Y - actor.position[1]) > 0.0


def shelter():
    place = Placement(np.array([100.0, Y - 5.6, 5.12]), np.pi / 2, np.zeros(3), "bus_stop")
    return City((CityObject("stop", "CityFurniture", placement=place),))


def test_people_wait_before_the_shelter_of_a_stop(tmp_path):
    waiting = PeopleRules((0.0, 0.0), {"1": 1.0}, 0.5, stop=(4.0, 4.0))
    actors = actors_of(tmp_path, STREET, rules(people=waiting), city=shelter())
    assert 2 <= len(actors) <= 4
    for actor in actors:
        assert actor.place == "stop"
        assert np.hypot(*(actor.position[:2] - [100.0, Y - 5.6])) < 3.5
        assert actor.position[1] > Y - 5.6


def test_bicycles_stand_beside_racks(tmp_path):
    place = Placement(np.array([100.0, Y - 5.0, 5.12]), 0.0, np.zeros(3), "bicycle_rack")
    city = City((CityObject("rack", "CityFurniture", placement=place),))
    some = KerbObjectRules(bicycles=(4.0, 4.0))
    actors = actors_of(tmp_path, STREET, rules(kerbside=some), city=city)
    # At two of the four places, the sidewalk ends.
    assert actors
    for actor in actors:
        assert actor.look.kind == "bicycle"
        assert abs(actor.position[0] - 100.0) < 0.2
        assert 1.0 < abs(actor.position[1] - (Y - 5.0)) < 2.5


def test_bins_stand_behind_the_kerb_and_not_in_vehicles(tmp_path):
    bins = KerbObjectRules(bins=20.0, bin_group=(2.0, 3.0))
    actors = actors_of(tmp_path, STREET, rules(kerbside=bins))
    assert len(actors) > 20
    for actor in actors:
        assert 3.5 + 0.3 < abs(actor.position[1] - Y) < 3.5 + 1.0
        # Their front looks to the road.
        assert np.sin(actor.heading) * (Y - actor.position[1]) > 0.0
    kerbs = full_kerbs(raised=1.0, occupancy=(0.6, 0.6)).kerbs
    mixed = actors_of(tmp_path, STREET, rules(kerbside=bins, kerbs=kerbs))
    shapes = shapely.polygons(plans(mixed))
    first, second = shapely.STRtree(shapes).query(shapes, predicate="intersects")
    assert {a.look.kind for a in mixed} == {"car", "wheelie_bin"}
    assert (first == second).all()


def test_the_same_seed_gives_the_same_street(tmp_path):
    crowd = PeopleRules((5.0, 9.0), {"1": 0.6, "2": 0.4}, 0.5)
    some = rules(people=crowd, kerbs=full_kerbs(occupancy=(0.3, 0.9)).kerbs)
    text = road_text(WIDE, WIDE)
    first, again = (actors_of(tmp_path, text, some, seed=3) for _ in range(2))
    other = actors_of(tmp_path, text, some, seed=4)
    assert first == again
    assert [a.id for a in first] != [a.id for a in other]
