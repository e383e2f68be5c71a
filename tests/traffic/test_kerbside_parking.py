"""Where vehicles park along roads, against the distances of the traffic regulations."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import shapely
from tests.traffic.parked_streets import (
    CHUNK,
    LOOKS,
    NARROW,
    WIDE,
    Y,
    actors_of,
    full_kerbs,
    places,
    plans,
    road_text,
    rules,
    street_of,
)

from envgen_usd.models.actor_rules import BayRules, PeopleRules
from envgen_usd.models.city_model import City, CityObject, Placement
from envgen_usd.traffic.standing.street_life import place_actors, signs_beside_rows

NO_STOPPING = '<rule sOffset="0" value="no stopping at any time"/>'
SIGN = "street_sign"
BAYS = (("driving", 3.5), ("parking", 2.0), ("sidewalk", 3.0, 0.12))
FLUSH = (("driving", 3.0), ("shoulder", 1.5), ("sidewalk", 3.0, 0.12))
"""Room for a vehicle on the shoulder and beside it."""
SEVERAL = (("driving", 3.5), ("driving", 6.0), ("sidewalk", 3.0, 0.12))
BESIDE = (("driving", 3.5), ("driving", 3.5), ("shoulder", 2.0), ("shoulder", 0.6),
          ("sidewalk", 3.0, 0.12))  # fmt: skip
"""A strip of 2.6 m beside the lanes."""


def test_vehicles_stand_beside_the_kerb_in_the_direction_of_travel(tmp_path):
    actors = actors_of(tmp_path, road_text(WIDE, WIDE), full_kerbs())
    assert places(actors).keys() == {"kerb"}
    right = [a for a in actors if a.position[1] < Y]
    left = [a for a in actors if a.position[1] > Y]
    assert len(right) > 20
    assert len(left) > 20
    for side, heading, sign in ((right, 0.0, -1.0), (left, np.pi, 1.0)):
        assert np.allclose(np.cos([a.heading - heading for a in side]), 1.0)
        flank = np.array([sign * (a.position[1] - Y) + a.look.width / 2 for a in side])
        assert np.allclose(flank, 6.0 - 0.2, atol=2e-3)


def test_left_hand_traffic_parks_on_the_left(tmp_path):
    actors = actors_of(tmp_path, road_text(WIDE, WIDE, rule="LHT"), full_kerbs())
    assert len(actors) > 40
    for actor in actors:
        forwards = np.cos(actor.heading) > 0.0
        assert forwards == (actor.position[1] > Y)
        assert 4.8 < abs(actor.position[1] - Y) < 5.0


def test_places_of_a_row_keep_their_gap(tmp_path):
    rule = full_kerbs(gap=(0.9, 0.9), both=0.0)
    actors = sorted(actors_of(tmp_path, road_text(WIDE, WIDE), rule), key=lambda a: a.position[0])
    ends = np.array(
        [[a.position[0] - a.look.size[0] / 2, a.position[0] + a.look.size[0] / 2] for a in actors]
    )
    assert len({a.position[1] > Y for a in actors}) == 1
    assert np.allclose(ends[1:, 0] - ends[:-1, 1], 0.9, atol=5e-3)


def test_occupancy_by_length(tmp_path):
    text = road_text(WIDE, WIDE)
    taken = [
        len(actors_of(tmp_path, text, full_kerbs(occupancy=(0.4, 0.4)), seed=seed))
        for seed in range(12)
    ]
    full = [len(actors_of(tmp_path, text, full_kerbs(), seed=seed)) for seed in range(12)]
    assert sum(taken) / sum(full) == pytest.approx(0.4, abs=0.06)


@pytest.mark.parametrize(
    ("text", "rows"),
    [
        (road_text(WIDE, WIDE, speed=70), 0),
        (road_text(WIDE, WIDE, kind="motorway"), 0),
        (road_text(WIDE, WIDE, kind="rural"), 0),
        (road_text(WIDE[:1], WIDE[:1], kind="unknown"), 0),
        (road_text(WIDE[:1], WIDE[:1]), 2),
        (road_text(FLUSH, FLUSH, mark="solid"), 0),
        (road_text(FLUSH, FLUSH), 2),
        (road_text(WIDE, WIDE, mark="solid"), 2),
        (road_text((), WIDE), 1),
        (road_text(NARROW, NARROW), 0),
        (road_text((("bus", 6.0), WIDE[1]), WIDE), 1),
        (road_text((WIDE[0], ("biking", 1.5), WIDE[1]), WIDE), 1),
        (road_text(SEVERAL, SEVERAL), 0),
        (road_text(BESIDE, BESIDE, speed=64), 2),
        (road_text(BESIDE, BESIDE, speed=80), 0),
        (road_text((("driving", 6.0, 0.0, NO_STOPPING), WIDE[1]), WIDE), 1),
    ],
    ids=[
        "fast", "motorway", "rural", "no kerb outside of towns", "no kerb in a town", "solid line",
        "no solid line", "3 m beside a solid line", "one way", "narrow", "bus lane", "cycle lane",
        "several lanes", "a strip beside several lanes", "a strip beside fast lanes",
        "rule of the lane",
    ],
)  # fmt: skip
def test_the_road_file_says_where_nobody_parks(tmp_path, text, rows):
    actors = actors_of(tmp_path, text, full_kerbs())
    assert len({actor.position[1] > Y for actor in actors}) == rows


@pytest.mark.parametrize(
    ("text", "some_rules", "kerbs"),
    [
        (road_text(WIDE, WIDE), full_kerbs(), (6.0, 6.0)),
        (road_text(WIDE, WIDE), full_kerbs(both=0.0), (6.0, 6.0)),
        (road_text(WIDE, WIDE), full_kerbs(streets=0.0), (6.0, 6.0)),
        (road_text(NARROW, NARROW), full_kerbs(raised=1.0), (3.5, 3.5)),
        (road_text(NARROW, NARROW), full_kerbs(), (3.5, 3.5)),
        (
            road_text(BAYS, NARROW),
            rules(bays=BayRules((1.0, 1.0), {"parallel": 1.0}, {"car": 1.0})),
            (5.5, 3.5),
        ),
    ],
    ids=["both sides", "one side", "no street", "half on the sidewalk", "narrow", "parking lane"],
)
def test_signs_beside_rows_are_those_beside_vehicles(tmp_path, text, some_rules, kerbs):
    """A sign 0.65 m behind the kerb of either side, and one in a garden."""
    left, right = kerbs
    spots = {"left": (60.0, left + 0.65), "right": (90.0, -right - 0.65), "garden": (90.0, 20.0)}
    signs = tuple(
        CityObject(
            name,
            "CityFurniture",
            placement=Placement(np.array([x, Y + y, 5.0]), 0.0, np.zeros(3), SIGN),
        )
        for name, (x, y) in spots.items()
    )
    street = street_of(tmp_path, text, city=City(signs))
    actors, _ = place_actors(street, some_rules)
    sides = {"left" if actor.position[1] > Y else "right" for actor in actors}
    assert signs_beside_rows(street, some_rules) == sides


def test_lanes_keep_their_room(tmp_path):
    for width in np.arange(3.0, 6.0, 0.25):
        text = road_text((("driving", width), WIDE[1]), (("driving", width), WIDE[1]))
        actors = actors_of(tmp_path, text, full_kerbs(raised=1.0))
        inner = min((abs(a.position[1] - Y) - a.look.width / 2 for a in actors), default=9.0)
        assert 2 * inner >= 3.05 - 1e-3
        assert inner - width / 2 >= 0.75 - 1e-3
        outer = max((abs(a.position[1] - Y) + a.look.width / 2 for a in actors), default=0.0)
        assert outer <= width + 2.0


def test_half_on_the_sidewalk_where_the_carriageway_is_narrow(tmp_path):
    actors = actors_of(tmp_path, road_text(NARROW, NARROW), full_kerbs(raised=1.0))
    assert len(actors) > 40
    for actor in actors:
        assert actor.place == "raised_kerb"
        assert abs(abs(actor.position[1] - Y) - 3.5) < 2e-3
        # The wheels of one side stand 12 cm higher.
        track = 2 * 0.42 * actor.look.width
        outward = -1.0 if actor.position[1] < Y else 1.0
        left = outward * np.cos(actor.heading)
        assert np.tan(actor.roll) * track == pytest.approx(0.12 * np.sign(left), abs=1e-3)


@pytest.mark.parametrize(
    ("walk", "raised"),
    [(2.0, 0.5), (1.75, 0.4), (1.6, None)],
    ids=["half", "two wheels", "no room"],
)
def test_kerb_stones_belong_to_what_vehicles_stand_on(tmp_path, walk, raised):
    """Beyond a lane of kerb stones lies the sidewalk; 1 m of it stays free.

    The carriageway leaves 1.15 m at the kerb: a car of 1.84 m needs 0.69 m of the sidewalk.
    """
    lanes = (("driving", 3.8), ("curb", 0.3, 0.12), ("sidewalk", walk - 0.3, 0.12))
    actors = actors_of(tmp_path, road_text(lanes, lanes), full_kerbs(raised=1.0))
    assert bool(actors) == (raised is not None)
    for actor in actors:
        inner = abs(actor.position[1] - Y) - actor.look.width / 2
        assert 3.8 - inner == pytest.approx((1.0 - raised) * actor.look.width, abs=2e-3)
        outer = inner + actor.look.width
        assert 3.8 + walk - outer >= 1.0 - 0.5 * max(actor.look.width - 1.84, 0.0) - 1e-3


@pytest.mark.parametrize(("rise", "bank"), [(0.0, 0.0), (0.08, 0.0), (-0.05, 0.04)])
def test_wheels_stand_on_slopes(tmp_path, rise, bank):
    actors = actors_of(tmp_path, road_text(WIDE, WIDE, rise=rise, bank=bank), full_kerbs())
    assert len(actors) > 40
    for actor in actors:
        length, width = actor.look.size[0], actor.look.width
        local = np.array([[u, v, 0.0] for u in (0.29, -0.29) for v in (0.42, -0.42)])
        local *= [length, width, 1.0]
        wheels = actor.position + local @ rotation(actor).T
        x, y = wheels[:, 0] - 20.0, wheels[:, 1] - Y
        # t is measured in the banked plane: the surface rises by its sine.
        assert np.allclose(wheels[:, 2], 5.0 + rise * x + np.tan(bank) * y, atol=0.01)


def rotation(actor):
    """Heading about z, then pitch (raises +x), then roll (raises +y)."""
    (ch, cp, cr), (sh, sp, sr) = (
        f([actor.heading, actor.pitch, actor.roll]) for f in (np.cos, np.sin)
    )
    about_z = np.array([[ch, -sh, 0], [sh, ch, 0], [0, 0, 1]])
    about_y = np.array([[cp, 0, -sp], [0, 1, 0], [sp, 0, cp]])
    about_x = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    return about_z @ about_y @ about_x


CROSSWALK = """<objects><object id="1" type="crosswalk" s="80" t="0" zOffset="0" length="4"
  width="12" height="0.01" hdg="0" orientation="none"/></objects>"""


def test_crossings_stay_free(tmp_path):
    actors = actors_of(tmp_path, road_text(WIDE, WIDE, rest=CROSSWALK), full_kerbs())
    for side in (1.0, -1.0):
        row = np.array([a.position for a in actors if side * (a.position[1] - Y) > 0.0])
        sizes = np.array([a.look.size[0] for a in actors if side * (a.position[1] - Y) > 0.0])
        ahead = (98.0 - (row[:, 0] + sizes / 2)) if side < 0.0 else (row[:, 0] - sizes / 2 - 102.0)
        behind = (row[:, 0] - sizes / 2 - 102.0) if side < 0.0 else (98.0 - row[:, 0] - sizes / 2)
        assert ahead[ahead > -2.0].min() == pytest.approx(5.0, abs=5.0)
        assert ahead[ahead > -2.0].min() >= 5.0 - 0.01
        assert behind[behind > -2.0].min() >= 1.0 - 0.01


def furniture(template, x, y, heading=0.0):
    place = Placement(np.array([x, y, 5.12]), heading, np.zeros(3), template)
    return CityObject(f"{template}_{x}", "CityFurniture", placement=place)


@pytest.mark.parametrize(
    ("template", "before", "after"), [("bus_stop", 15, 15), ("traffic_light", 10, 1)]
)
def test_stops_and_lights_stay_free(tmp_path, template, before, after):
    city = City((furniture(template, 100.0, Y - 7.0),))
    actors = actors_of(tmp_path, road_text((), WIDE), full_kerbs(), city=city)
    fronts = np.array([a.position[0] + a.look.size[0] / 2 for a in actors])
    backs = np.array([a.position[0] - a.look.size[0] / 2 for a in actors])
    assert len(actors) > 10
    assert not ((fronts > 100.0 - before) & (backs < 100.0 + after)).any()
    free = np.sort(backs[backs > 100.0])[0] - np.sort(fronts[fronts < 100.0])[-1]
    assert free < before + after + 2 * 5.6


def test_no_stopping_sign_holds_to_the_end(tmp_path):
    sign = """<signals><signal id="3" s="60" t="-7" dynamic="no" orientation="+" country="DE"
      type="283" subtype="-1" zOffset="2" height="0.6" width="0.6"/></signals>"""
    actors = actors_of(tmp_path, road_text(WIDE, WIDE, rest=sign), full_kerbs())
    right = [a.position[0] + a.look.size[0] / 2 for a in actors if a.position[1] < Y]
    left = [a.position[0] for a in actors if a.position[1] > Y]
    assert 70.0 < max(right) <= 80.0
    assert max(left) > 150.0


def test_ends_of_the_road_stay_free(tmp_path):
    corners = plans(actors_of(tmp_path, road_text(WIDE, WIDE), full_kerbs()))
    assert corners[..., 0].min() >= 25.0 - 1e-3
    assert corners[..., 0].max() <= 175.0 + 1e-3


@pytest.mark.parametrize(
    ("width", "wide", "angle"),
    [(2.2, "perpendicular", 0.0), (5.2, "perpendicular", 90.0), (5.2, "angled", 60.0)],
)
def test_parking_lanes_decide_the_angle(tmp_path, width, wide, angle):
    side = (("driving", 3.5), ("parking", width), ("sidewalk", 2.0, 0.12))
    bays = BayRules((1.0, 1.0), {wide: 1.0}, {"car": 1.0}, nose_in=1.0)
    actors = actors_of(tmp_path, road_text(side, side), rules(bays=bays))
    assert len(actors) > 30
    for actor in actors:
        sign = -1.0 if actor.position[1] < Y else 1.0
        along = 0.0 if sign < 0.0 else np.pi
        turn = np.degrees(actor.heading - along) % 360.0
        assert turn == pytest.approx(-angle % 360.0, abs=0.1)
        middle = sign * (actor.position[1] - Y)
        assert middle == pytest.approx(3.5 + width / 2, abs=2e-3)
    assert np.abs(plans(actors)[..., 1] - Y).min() >= 3.5 - 0.2


def test_a_parking_space_holds_its_vehicle(tmp_path):
    space = """<objects><object id="7" type="parkingSpace" s="50" t="-9" zOffset="0" length="5.2"
      width="2.5" height="0.01" hdg="1.5708" orientation="none"/></objects>"""
    bays = BayRules((1.0, 1.0), {"parallel": 1.0}, {"car": 1.0})
    (actor,) = actors_of(tmp_path, road_text(NARROW, NARROW, rest=space), rules(bays=bays))
    assert actor.place == "parking_space"
    assert np.allclose(actor.position[:2], [70.0, Y - 9.0], atol=0.05)
    assert abs(np.sin(actor.heading)) == pytest.approx(1.0, abs=1e-3)


def test_nothing_overlaps(tmp_path):
    posts = [shapely.Point(40.0 + 9.0 * n, Y - 3.9).buffer(0.1) for n in range(15)]
    text = road_text(NARROW, NARROW)
    actors = actors_of(tmp_path, text, full_kerbs(raised=1.0), obstacles=posts)
    assert len(actors) > 20
    shapes = shapely.polygons(plans(actors))
    first, second = shapely.STRtree(shapes).query(shapes, predicate="intersects")
    assert (first == second).all()
    assert not len(shapely.STRtree(posts).query(shapes, predicate="intersects")[0])


def test_much_that_has_no_room_is_an_issue(tmp_path):
    walls = [shapely.box(0.0, Y - 7.0, 200.0, Y - 3.5), shapely.box(0.0, Y + 3.5, 200.0, Y + 7.0)]
    street = street_of(tmp_path, road_text(NARROW, NARROW), obstacles=walls)
    crowd = PeopleRules((8.0, 8.0), {"1": 1.0}, 0.5)
    actors, issues = place_actors(street, rules(people=crowd))
    assert not actors
    (issue,) = issues
    assert issue.kind == "actors.no_room"
    assert "'sidewalk'" in issue.message


def test_rows_close_up_to_posts(tmp_path):
    posts = [shapely.Point(100.0, Y + side * 3.9).buffer(0.1) for side in (1, -1)]
    text = road_text(NARROW, NARROW)
    actors = actors_of(tmp_path, text, full_kerbs(raised=1.0), obstacles=posts)
    for side in (1, -1):
        row = [a for a in actors if side * (a.position[1] - Y) > 0.0]
        # The first vehicle behind the post, in the direction of travel.
        rear = [-side * (a.position[0] - 100.0) - a.look.size[0] / 2 for a in row]
        assert min(x for x in rear if x > 0.0) == pytest.approx(0.1 + 0.15, abs=0.02)


def test_rows_end_at_the_border_of_a_chunk(tmp_path):
    text = road_text(WIDE, WIDE).replace('x="20"', 'x="120"')
    street = street_of(tmp_path, text)
    near = replace(CHUNK, x=1)
    east = replace(street, chunk=near)
    first, second = (place_actors(each, full_kerbs())[0] for each in (street, east))
    assert len({a.id for a in (*first, *second)}) == len(first) + len(second)
    assert all(a.position[0] < 200.0 for a in first)
    assert all(a.position[0] >= 200.0 for a in second)
    row = sorted((a.position[0], a.look.size[0]) for a in (*first, *second) if a.position[1] < Y)
    gaps = np.diff([x for x, _ in row]) - [(a + b) / 2 for (_, a), (_, b) in pairwise(row)]
    assert np.count_nonzero(np.abs(gaps - 0.6) > 5e-3) <= 1
    assert gaps.min() > 0.2


def test_without_assets_there_is_nobody(tmp_path):
    looks = {kind: LOOKS[kind] for kind in ("bicycle",)}
    assert not actors_of(tmp_path, road_text(WIDE, WIDE), full_kerbs(), looks=looks)
