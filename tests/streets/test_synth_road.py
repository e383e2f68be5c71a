"""Street networks that are written as OpenDRIVE, read back and held against geometry."""

from itertools import pairwise

import numpy as np
import pytest
from lxml import etree
from tests.streets.lane_gaps import lane_gaps
from typer.testing import CliRunner

from envgen_usd.commands.command_line import app
from envgen_usd.environment_files import read_profile
from envgen_usd.errors import EnvgenError
from envgen_usd.geometry.hermite_curves import smooth_curve, turning_cubic
from envgen_usd.models.street_network import CrossSection, Street, StreetNetwork
from envgen_usd.opendrive.reader import read_network
from envgen_usd.recipe.map_land import read_road
from envgen_usd.streets.junction_arms import arms_of, trims
from envgen_usd.streets.network_roads import network_xml
from envgen_usd.streets.street_layouts import LAYOUTS

SECTION = CrossSection(lane_width=3.0, parking=2.0, sidewalk=2.0)


def star(*degrees, length=80.0, section=SECTION):
    """Streets from one node outwards."""
    ends = length * np.stack([np.cos(np.radians(degrees)), np.sin(np.radians(degrees))], axis=1)
    nodes = np.concatenate([np.zeros((1, 2)), ends])
    streets = [Street(0, n + 1, nodes[[0, n + 1]], section) for n in range(len(degrees))]
    return StreetNetwork(nodes, tuple(streets))


def write(network, path):
    path.write_bytes(network_xml(network, "test"))
    return path


@pytest.mark.parametrize("layout", sorted(LAYOUTS))
@pytest.mark.parametrize("seed", [0, 1])
def test_layouts_are_read_without_any_issue(layout, seed, tmp_path):
    path = write(LAYOUTS[layout]((3, 4), seed), tmp_path / "town.xodr")
    reading, surface = read_road(path, 0.05, read_profile("1", "residential").road)
    assert not reading.network.issues
    kinds = {issue.kind for issue in surface.issues}
    # Between the turns of a junction with four lanes lies land that no lane covers.
    assert kinds <= {"road_mark.size", "junction.filled"}, kinds


@pytest.mark.parametrize("layout", sorted(LAYOUTS))
def test_linked_lanes_meet_exactly(layout, tmp_path):
    path = write(LAYOUTS[layout]((3, 4), 2), tmp_path / "town.xodr")
    _, surface = read_road(path, 0.01, read_profile("1", "residential").road)
    gaps = lane_gaps(surface)
    assert len(gaps) > 50
    assert max(gaps) < 0.01


def test_two_kerbs_meet_in_an_arc_of_the_right_radius():
    """At a right angle with half widths of 3 m: 3 + radius from the node."""
    network = star(0, 90, 180, 270)
    right = trims(network, arms_of(network)[0])
    assert right == pytest.approx([9.5] * 4)
    sharp = star(0, 60)
    # Kerbs at 60 degrees meet 3 / tan 30 from the node; an arc of 6.5 m touches 6.5 / tan 30 on.
    assert trims(sharp, arms_of(sharp)[0]) == pytest.approx([9.5 / np.tan(np.radians(30))] * 2)


def test_a_crossing_has_every_turn_once_and_a_sidewalk_at_every_corner():
    root = etree.fromstring(network_xml(star(0, 90, 180, 270), "crossing"))
    connections = root.findall("junction/connection")
    roads = {road.get("id"): road for road in root.findall("road")}
    ends = {number: road.find("link/successor") for number, road in roads.items()}
    turns = {
        (c.get("incomingRoad"), ends[c.get("connectingRoad")].get("elementId")) for c in connections
    }
    assert len(connections) == len(turns) == 12
    walks = [road for road in roads.values() if road.get("junction") != "-1"]
    walks = [road for road in walks if road.find(".//right/lane[@type='sidewalk']") is not None]
    assert len(walks) == 4
    # Right turns: a quarter of a circle around the corner, of radius 6.5 + 3 at the inner border.
    for road in walks:
        assert float(road.get("length")) == pytest.approx(np.pi / 2 * 9.5, rel=1e-3)


def test_traffic_keeps_right(tmp_path):
    """Lane ends that enter a junction lie on the right of the street as one drives towards it."""
    path = write(star(0, 90, 180, 270), tmp_path / "crossing.xodr")
    _, surface = read_road(path, 0.01, read_profile("1", "residential").road)
    entering = [
        lane
        for lane in surface.lanes
        if lane.lane_type == "driving" and lane.successors and np.hypot(*lane.points[0][:2]) > 70.0
    ]
    assert len(entering) == 4
    for lane in entering:
        before, after = lane.points[-2][:2], lane.points[-1][:2]
        heading = after - before
        middle = -after  # from the end of the lane to the node
        assert heading @ middle > 0.0
        assert heading[0] * middle[1] - heading[1] * middle[0] > 0.0  # the node lies to its left


def test_one_way_streets_lead_one_way():
    one_way = CrossSection(forward=1, backward=0, sidewalk=2.0)
    network = star(0, 120, 240)
    streets = (Street(0, 1, network.streets[0].line, one_way), *network.streets[1:])
    root = etree.fromstring(network_xml(StreetNetwork(network.nodes, streets), "one way"))
    connections = root.findall("junction/connection")
    driven = [c.get("incomingRoad") for c in connections if c.findall("laneLink")]
    assert "1" not in driven
    assert len(driven) == 4


def test_streets_too_short_for_their_junctions_are_named():
    near = star(0, 90, 180, length=12.0)
    nodes = np.concatenate([near.nodes, [[12.0, 80.0], [12.0, -80.0]]])
    more = [Street(1, n, nodes[[1, n]], SECTION) for n in (4, 5)]
    network = StreetNetwork(nodes, (*near.streets, *more))
    with pytest.raises(EnvgenError, match=r"street 0 at 6, 0: is 12 m long"):
        network_xml(network, "short")


def test_a_cubic_turns_like_an_arc():
    curve = turning_cubic(np.zeros(2), 0.0, np.array([10.0, 10.0]), np.pi / 2)
    assert curve.length == pytest.approx(5.0 * np.pi, rel=3e-4)
    place, heading = curve.end()
    assert place == pytest.approx([10.0, 10.0])
    assert heading == pytest.approx(np.pi / 2)


def test_a_smooth_curve_passes_its_points_without_kinks():
    angles = np.linspace(0.0, 2.0, 9)
    points = 50.0 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    curve = smooth_curve(points)
    assert sum(piece.length for piece in curve) == pytest.approx(100.0, rel=2e-3)
    for before, after in pairwise(curve):
        place, heading = before.end()
        assert place == pytest.approx(after.start)
        assert heading % (2 * np.pi) == pytest.approx(after.heading % (2 * np.pi))


def test_the_command_writes_the_same_file_again(tmp_path):
    runs = []
    for name in ("a", "b"):
        path = tmp_path / name / "town.xodr"
        path.parent.mkdir()
        words = ["synth-road", "organic", "--blocks", "3x3", "--seed", "7", "--out", str(path)]
        result = CliRunner().invoke(app, words)
        assert result.exit_code == 0, result.output
        runs.append(path.read_bytes())
    assert runs[0] == runs[1]
    assert read_network(path).roads


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["star"], "LAYOUT star: unknown; choose from grid, ring, organic"),
        (["grid", "--blocks", "0x3"], "--blocks 0x3: expected two numbers"),
        (["grid", "--blocks", "many"], "--blocks many: expected two numbers"),
        (["grid", "--blocks", "900x900"], "at most 10,000 blocks"),
    ],
)
def test_bad_input_is_named(words, said, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(app, ["synth-road", *words])
    assert isinstance(result.exception, EnvgenError)
    assert said in str(result.exception)
    assert not list(tmp_path.iterdir())
