"""Islands at crossings of a map, read back from the road file and from its surface."""

from collections import Counter

import numpy as np
import pytest
import shapely
from tests.places.places_extracts import Extract, crossing
from tests.streets.lane_gaps import lane_gaps
from tests.streets.test_mapped_roads import roads_of
from tests.streets.test_mirrored_roads import left_roads

from envgen_usd.places.osm_streets import read_street_extract
from envgen_usd.places.street_chains import street_plan
from envgen_usd.streets.mapped_roads import mapped_roads

STREET = {"highway": "secondary", "sidewalk": "both", "lanes": "2"}
ISLAND = {"highway": "crossing", "crossing": "zebra", "crossing__island": "yes"}


def street(at=(0.0, 0.0), tags=ISLAND, **more):
    """A street of 300 m with a node of an island."""
    extract = Extract()
    extract.way((-150.0, 0.0), at, (150.0, 0.0), **{**STREET, **more})
    extract.node(*at, **tags)
    return extract


def islands_of(root):
    return root.findall("road/objects/object[@type='trafficIsland']")


def triangles(surface, kind):
    chosen = np.array([patch.kind == kind for patch in surface.patches])
    return surface.vertices[surface.triangles[chosen[surface.triangle_patch]]]


def plan_area(corners):
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]).sum() / 2


def borders_across(reading, s_from_middle):
    """T of all borders of the only road, from the right, at a distance from its middle."""
    (road,) = reading.network.roads.values()
    s = road.length / 2.0 + s_from_middle
    section = [x for x in road.sections if x.s <= s][-1]
    at = np.array([s - section.s])
    right = [float(lane.width(at)[0]) for lane in section.right]
    left = [float(lane.width(at)[0]) for lane in section.left]
    offset = float(road.lane_offset(np.array([s]))[0])
    kinds = [lane.type for lane in [*section.right[::-1], *section.left]]
    t = offset + np.append(-np.cumsum(right)[::-1], np.append(0.0, np.cumsum(left)))
    return kinds, t


def test_an_island_is_raised_but_where_the_crossing_leads_through(tmp_path):
    """8 m long and 2 m wide with round heads, 12 cm high; 3 m of it are 3 cm high."""
    _, root, reading, surface = roads_of(street(), tmp_path)
    assert not reading.network.issues
    (island,) = islands_of(root)
    (zebra,) = root.findall("road/objects/object[@type='crosswalk']")
    assert float(zebra.get("s")) == pytest.approx(float(island.get("s")))
    top = triangles(surface, "island")
    # Heads are halves of a twelve-sided polygon.
    assert plan_area(top) == pytest.approx(6.0 * 2.0 + 3.0, abs=1e-2)
    points = top.reshape(-1, 3)
    assert np.abs(points[:, 0]).max() == pytest.approx(4.0, abs=0.05)
    assert np.abs(points[:, 1]).max() == pytest.approx(1.0, abs=0.02)
    near = np.abs(points[:, 0]) < 1.6
    assert points[near, 2] == pytest.approx(0.03, abs=1e-3)
    far = np.abs(points[:, 0]) > 1.9
    assert points[far, 2] == pytest.approx(0.12, abs=1e-3)
    labels = {p.lane_type for p in surface.patches if p.kind == "island"}
    assert labels == {"sidewalk"}


def test_the_surface_around_an_island_is_watertight(tmp_path):
    """The street bends at the island."""
    _, _, _, surface = roads_of(street((-20.0, 3.0)), tmp_path)
    edges = Counter(
        edge for a, b, c in surface.triangles.tolist() for edge in ((a, b), (b, c), (c, a))
    )
    assert set(edges.values()) == {1}
    rim = {edge for edge in edges if edge[::-1] not in edges}
    loops = [loop.tolist() for loop in surface.outline]
    assert rim == {e for loop in loops for e in zip(loop, loop[1:] + loop[:1], strict=True)}


@pytest.mark.parametrize(
    ("width", "lane", "kerb"), [("10", 3.75, 5.0), ("9", 3.25, 4.5), ("6", 2.75, 4.0)]
)
def test_lanes_lead_around_an_island(width, lane, kerb, tmp_path):
    """They become narrower down to 2.75 m; what is missing widens the carriageway on both sides."""
    _, _, reading, _ = roads_of(street(width=width), tmp_path)
    usual = float(width) / 2.0
    kinds, t = borders_across(reading, 60.0)
    assert kinds == ["sidewalk", "driving", "driving", "sidewalk"]
    assert t[1:4] == pytest.approx([-usual, 0.0, usual], abs=1e-6)
    kinds, t = borders_across(reading, 0.0)
    assert kinds == ["sidewalk", "driving", "restricted", "driving", "sidewalk"]
    assert t[1:5] == pytest.approx([-kerb, lane - kerb, kerb - lane, kerb], abs=1e-3)
    for away in np.arange(-40.0, 40.5, 1.0):
        kinds, t = borders_across(reading, away)
        driving = np.diff(t)[np.array(kinds) == "driving"]
        assert driving.min() > min(2.75, usual) - 1e-3
        assert np.abs(t[1]) == pytest.approx(t[-2], abs=1e-6)
        assert min(usual, kerb) - 1e-6 < t[-2] < max(usual, kerb) + 1e-6


def test_nobody_parks_beside_an_island_and_the_kerbs_stay_where_they_are(tmp_path):
    """6 m for driving and 2 m for parking are 8 m: 2.5 m around the island and 2.75 m a lane."""
    tags = {"width": "8", "parking__right": "lane", "sidewalk": "both"}
    _, _, reading, _ = roads_of(street(**tags), tmp_path)
    _, before = borders_across(reading, 60.0)
    for away in np.arange(-40.0, 40.5, 1.0):
        _, t = borders_across(reading, away)
        assert t[[1, -2]] == pytest.approx(before[[1, -2]], abs=1e-3)
    kinds, t = borders_across(reading, 0.0)
    assert np.diff(t)[np.array(kinds) == "parking"] == pytest.approx(0.0)
    assert np.diff(t)[[2, 3, 4]] == pytest.approx([2.75, 2.5, 2.75], abs=1e-3)


def test_signs_on_both_ends_tell_traffic_to_keep_right(tmp_path):
    _, root, _, _ = roads_of(street(), tmp_path)
    (island,) = islands_of(root)
    signs = root.findall("road/signals/signal[@type='222']")
    middle = float(island.get("s"))
    ahead = {sign.get("orientation"): float(sign.get("s")) - middle for sign in signs}
    assert ahead.keys() == {"+", "-"}
    # Traffic along the road comes from smaller s.
    assert -4.0 < ahead["+"] < -1.5
    assert 1.5 < ahead["-"] < 4.0
    assert {sign.get("t") for sign in signs} == {island.get("t")}


def test_traffic_on_the_left_passes_an_island_on_the_left(tmp_path):
    _, root, reading, surface = left_roads(street(), tmp_path)
    assert not reading.network.issues
    assert len(islands_of(root)) == 1
    assert {s.get("type") for s in root.findall("road/signals/signal")} == {"222-10"}
    island = shapely.union_all(shapely.polygons(triangles(surface, "island")[:, :, :2]))
    assert island.centroid.distance(shapely.Point(0.0, 0.0)) < 0.05


def test_an_island_beside_a_junction_reaches_up_to_it_and_lanes_meet(tmp_path):
    extract = crossing(lanes="2", highway="secondary")
    extract.way((0.0, 0.0), (14.0, 0.0), (100.0, 0.0), **STREET)
    extract.items.pop(0)
    extract.way((-100.0, 0.0), (0.0, 0.0), **STREET)
    extract.node(14.0, 0.0, **ISLAND)
    _, root, reading, surface = roads_of(extract, tmp_path)
    assert not reading.network.issues
    (island,) = islands_of(root)
    road = next(r for r in root.findall("road") if r.find("objects/object") is not None)
    first = road.find("lanes/laneSection")
    assert first.find("left/lane[@type='restricted']") is not None
    assert float(island.get("s")) >= 4.5
    gaps = lane_gaps(surface)
    assert len(gaps) > 12
    assert max(gaps) < 0.01


@pytest.mark.parametrize(
    "tags",
    [
        {"highway": "crossing", "crossing": "island"},
        {"highway": "crossing", "crossing": "traffic_signals;island"},
        {"traffic_calming": "island"},
    ],
)
def test_each_way_of_mapping_an_island_counts(tags, tmp_path):
    _, root, _, _ = roads_of(street(tags=tags), tmp_path)
    assert len(islands_of(root)) == 1


def test_a_footway_across_the_street_may_name_the_island(tmp_path):
    extract = street(tags={"highway": "crossing"})
    across = {"highway": "footway", "footway": "crossing", "crossing__island": "yes"}
    extract.way((0.0, -8.0), (0.0, 0.0), (0.0, 8.0), **across)
    _, root, _, _ = roads_of(extract, tmp_path)
    assert len(islands_of(root)) == 1


@pytest.mark.parametrize(
    ("more", "why"),
    [({"oneway": "yes"}, "two directions"), ({"lanes": "1"}, "two directions")],
)
def test_an_island_without_room_is_counted(more, why, tmp_path):
    path = street(**more).write(tmp_path / "place.osm")
    made = mapped_roads(street_plan(read_street_extract(path), path, "1"), "place")
    assert b"trafficIsland" not in made.xml
    (issue,) = [each for each in made.issues if each.kind == "streets.island"]
    assert why in issue.message


@pytest.mark.parametrize("value", ["1e9", "NaN", "YES", "-1"])
def test_a_value_that_is_neither_yes_nor_no_builds_none_and_is_named(value, tmp_path):
    tags = {"highway": "crossing", "crossing__island": value}
    path = street(tags=tags).write(tmp_path / "place.osm")
    made = mapped_roads(street_plan(read_street_extract(path), path, "1"), "place")
    assert b"trafficIsland" not in made.xml
    (issue,) = [each for each in made.issues if each.kind == "osm.implausible_tag"]
    assert "crossing:island" in issue.message
    assert "node" in issue.where


@pytest.mark.parametrize("length", [17.0, 21.0, 26.0])
def test_islands_on_short_streets_leave_the_junctions_as_they_are(length, tmp_path):
    """Between two junctions, as long as wider mouths would not make one of them."""

    def junctions(tags):
        extract = Extract()
        middle = length / 2.0, 0.0
        extract.way((-80.0, 0.0), (0.0, 0.0), middle, (length, 0.0), (90.0, 0.0), **STREET)
        for x in (0.0, length):
            extract.way((x, -80.0), (x, 0.0), (x, 80.0), highway="residential", sidewalk="both")
        extract.node(*middle, **tags)
        path = extract.write(tmp_path / "place.osm")
        made = mapped_roads(street_plan(read_street_extract(path), path, "1"), "place")
        islands = [x for x in made.issues if x.kind == "streets.island"]
        assert made.counts.get("islands", 0) + len(islands) == (1 if "highway" in tags else 0)
        return made.counts["junctions"]

    assert junctions(ISLAND) == junctions({"note": "none"})


def test_hundreds_of_islands_of_one_street_are_bounded(tmp_path):
    """Nodes each 2 m: islands keep 1 m, the others are counted."""
    extract = Extract()
    places = [(2.0 * n, 0.0) for n in range(301)]
    extract.way(*places, **STREET)
    for place in places:
        extract.node(*place, **ISLAND)
    _, root, reading, _ = roads_of(extract, tmp_path)
    assert not reading.network.issues
    s = np.sort([float(x.get("s")) for x in islands_of(root)])
    assert 30 < len(s) < 70
    assert np.diff(s).min() >= 9.0 - 1e-6
