"""Lanelet2 files: what is read, what is turned or left out, and what is refused."""

import re

import numpy as np
import pytest
from pyproj import Transformer
from tests.places.lanelet_files import LaneletWriter, bend, crossing, two_lanes

from envgen_usd.errors import EnvgenError
from envgen_usd.places.lanelets.lanelet_reading import read_lanelet_map, speed_of


def along(source, side):
    points = source.lines[side.line].points
    return points if side.forward else points[::-1]


def test_bounds_run_along_their_lanelet_with_the_left_one_on_its_left(tmp_path):
    source = read_lanelet_map(crossing().write(tmp_path / "map.osm"))
    assert len(source.lanelets) == 16
    for lanelet in source.lanelets:
        left, right = (along(source, side)[:, :2] for side in (lanelet.left, lanelet.right))
        for a, b in ((left[0], right[0]), (left[-1], right[-1])):
            assert np.hypot(*(a - b)) == pytest.approx(3.5)
        ahead, across = left[-1] - left[0], left.mean(0) - right.mean(0)
        assert ahead[0] * across[1] - ahead[1] * across[0] > 0.0


def test_a_bound_that_runs_the_wrong_way_is_turned_and_named(tmp_path):
    file = LaneletWriter()
    left = file.way([[0.0, 3.0], [40.0, 3.0]])
    right = file.way([[40.0, 0.0], [0.0, 0.0]])
    file.lanelet(left, right)
    source = read_lanelet_map(file.write(tmp_path / "map.osm"))
    (lanelet,) = source.lanelets
    assert along(source, lanelet.right)[:, 0].tolist() == [0.0, 40.0]
    assert "lanelet.turned" in {issue.kind for issue in source.issues}


def test_degrees_become_metres_of_utm_near_the_origin(tmp_path):
    source = read_lanelet_map(two_lanes(local=False).write(tmp_path / "map.osm"))
    points = np.concatenate([line.points[:, :2] for line in source.lines])
    utm = points + source.offset
    assert utm.min(0) == pytest.approx([455_000.0, 5_427_994.5], abs=1e-3)
    assert np.abs(points).max() < 1000.0
    lon, _ = Transformer.from_crs(source.crs, 4326, always_xy=True).transform(*utm.T)
    assert 6.0 < lon.min() <= lon.max() < 12.0


def test_local_coordinates_belong_to_a_zone_also_where_a_node_is_wrong(tmp_path):
    file = two_lanes(local=False)
    path = file.write(tmp_path / "map.osm")
    text = path.read_text()
    for (x, y, _), number in file._nodes.items():
        local = f'<tag k="local_x" v="{x}"/><tag k="local_y" v="{y + 1000.0 * (x == y)}"/>'
        text = re.sub(rf'(<node id="{number}"[^>]*>)', rf"\1{local}", text)
    path.write_text(text)
    source = read_lanelet_map(path)
    assert source.crs.startswith("+proj=utm +zone=32")
    assert source.offset == pytest.approx((455_000.0, 5_428_000.0), abs=1e-3)


def test_limits_have_units():
    assert speed_of("50") == speed_of("50 km/h") == speed_of("50km/h") == 50.0
    assert speed_of("20 mph") == pytest.approx(32.18688)
    assert speed_of("10 m/s") == pytest.approx(36.0)
    assert speed_of("fast") == speed_of("-3") == speed_of("nan") == speed_of("1e9") == 0.0


def test_faulty_elements_are_left_out_and_the_rest_is_used(tmp_path):
    file = two_lanes()
    way = next(iter(file.bounds))
    file.raw('<node id="1" lat="nan" lon="inf"/><node id="2" lat="89.9" lon="500"/>')
    file.raw('<way id="3"><nd ref="1"/><nd ref="2"/><nd ref="77"/></way>')
    file.lanelet(3, way)
    file.lanelet(way, 999)
    file.lanelet(way, way)
    file.lanelet(way, file.way([[0.0, 900.0], [60.0, 900.0]]))
    file.lanelet(file.way([[0.0, 7.0], [30.0, 7.0], [-2000.0, 7.0], [60.0, 7.0]]), way)
    file.raw('<relation id="x"/><relation id="7"><member type="way" ref="y"/></relation>')
    source = read_lanelet_map(file.write(tmp_path / "map.osm"))
    assert len(source.lanelets) == 3
    assert source.counts["lanelets"] == 8
    assert source.counts["lanelets_left_out"] == 5
    kinds = {issue.kind for issue in source.issues}
    assert {"lanelet.left_out", "lanelet.incomplete_way", "lanelet.node", "lanelet.id"} <= kinds


def test_participants_decide_where_a_road_is_for_pedestrians_or_bicycles_alone(tmp_path):
    file = LaneletWriter()
    wanted = []
    for n, (users, subtype) in enumerate(
        (
            (("pedestrian", "bicycle"), "shared_walkway"),
            (("bicycle",), "bicycle_lane"),
            (("vehicle:car", "pedestrian"), "road"),
            ((), "road"),
        )
    ):
        sides = [file.way([[0.0, 20.0 * n + y], [30.0, 20.0 * n + y]]) for y in (3.0, 0.0)]
        file.lanelet(*sides, **{f"participant:{user}": "yes" for user in users})
        wanted.append(subtype)
    source = read_lanelet_map(file.write(tmp_path / "map.osm"))
    assert [lanelet.subtype for lanelet in source.lanelets] == wanted
    assert [lanelet.one_way for lanelet in source.lanelets] == [False, True, True, True]


def test_ids_beyond_64_bits_are_counted(tmp_path):
    file = two_lanes()
    file.raw(f'<node id="{2**63}" lat="49" lon="8"/><relation id="-{2**64}"/>')
    file.raw(f'<node id="{2**63 - 1}" lat="49" lon="8"/>')
    source = read_lanelet_map(file.write(tmp_path / "map.osm"))
    (issue,) = [issue for issue in source.issues if issue.kind == "lanelet.id"]
    assert issue.message.startswith("2 elements")


@pytest.mark.parametrize("local", [True, False])
def test_missing_and_impossible_heights_follow_from_the_nodes_around(local, tmp_path):
    """As in maps whose editor left a node at 0, and the next ones halfway to it."""
    file = bend(climb=5.0)
    file.local = local
    path = file.write(tmp_path / "map.osm")
    right = read_lanelet_map(path)
    text = path.read_text()
    heights = re.findall(r'k="ele" v="([0-9.]+)"', text)
    for old, new in ((heights[20], "0"), (heights[21], "-19.5")):
        text = text.replace(f'k="ele" v="{old}"', f'k="ele" v="{new}"', 1)
    text = text.replace(f'<tag k="ele" v="{heights[12]}"/>', "", 1)
    path.write_text(text)
    source = read_lanelet_map(path)
    for mine, truth in zip(source.lines, right.lines, strict=True):
        assert mine.points[:, 2] == pytest.approx(truth.points[:, 2], abs=0.5)
    messages = [issue.message for issue in source.issues if issue.kind == "lanelet.height"]
    assert messages[0].startswith("1 nodes of bounds have no height")
    assert messages[1].startswith("2 nodes of bounds lie far")


def test_heights_that_a_writer_leaves_out_at_zero_are_zero(tmp_path):
    file = two_lanes()
    path = file.write(tmp_path / "map.osm")
    text = path.read_text().replace('<tag k="ele" v="0.0"/>', "")
    kerb = sorted(file.bounds)[2]
    for node in re.findall(r"ref=\"(\d+)\"", re.search(rf'<way id="{kerb}">.*?</way>', text)[0]):
        text = re.sub(rf'(<node id="{node}".*?)</node>', r'\1<tag k="ele" v="0.12"/></node>', text)
    path.write_text(text)
    source = read_lanelet_map(path)
    heights = [line.points[:, 2].tolist() for line in source.lines]
    assert heights == [[0.12 if n == 2 else 0.0] * 7 for n in range(4)]
    assert "lanelet.height" not in {issue.kind for issue in source.issues}


def test_steep_kerbs_stairs_and_bridges_are_kept(tmp_path):
    file = LaneletWriter()
    for level, turn in ((0.0, False), (6.0, True)):
        for y in (0.0, 4.0):
            line = [[-30.0, y, level], [0.0, y, level], [30.0, y, level + 20.0]]
            rows = [[q, p, z] for p, q, z in line] if turn else line
            file.way(rows)
    ways = list(file.bounds)
    file.lanelet(ways[1], ways[0])
    file.lanelet(ways[2], ways[3])
    source = read_lanelet_map(file.write(tmp_path / "map.osm"))
    assert "lanelet.height" not in {issue.kind for issue in source.issues}
    assert sorted({z for line in source.lines for z in line.points[:, 2]}) == [0.0, 6.0, 20.0, 26.0]


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("<osm/>", "no usable lanelet"),
        ("<gml/>", "root element is gml"),
        ("<osm><node", "no Lanelet2 map"),
        ('<!DOCTYPE osm [<!ENTITY a "b">]><osm/>', "declares entity"),
    ],
)
def test_what_is_no_map_is_refused(text, reason, tmp_path):
    path = tmp_path / "map.osm"
    path.write_text(text)
    with pytest.raises(EnvgenError, match=reason):
        read_lanelet_map(path)


def test_a_map_larger_than_allowed_is_refused(tmp_path):
    path = bend().write(tmp_path / "map.osm")
    with pytest.raises(EnvgenError, match="--max-area"):
        read_lanelet_map(path, 0.0005)
    assert read_lanelet_map(path, 0.002).lanelets


def test_the_library_orders_bounds_alike(tmp_path):
    lanelet2 = pytest.importorskip("lanelet2")
    path = crossing_in_degrees().write(tmp_path / "map.osm")
    origin = lanelet2.io.Origin(49.0, 8.4)
    theirs = lanelet2.io.load(str(path), lanelet2.projection.UtmProjector(origin))
    source = read_lanelet_map(path)
    start = np.array(Transformer.from_crs(4326, source.crs, always_xy=True).transform(8.4, 49.0))
    for lanelet in source.lanelets:
        other = theirs.laneletLayer[lanelet.id]
        for side, bound in ((lanelet.left, other.leftBound), (lanelet.right, other.rightBound)):
            points = np.array([[p.x, p.y] for p in bound]) + start
            mine = along(source, side)[:, :2] + source.offset
            assert np.abs(points - mine).max() < 0.02


def crossing_in_degrees():
    file = crossing()
    file.local = False
    return file
