"""One geometry that cannot be used does not cost its road."""

import numpy as np
import pytest

from envgen_usd.opendrive.document.write import write_document
from envgen_usd.opendrive.geometry.curve_evaluation import evaluate
from envgen_usd.opendrive.reader import read_network

ARC = '<arc curvature="0.02"/>'


def geometry(s=0, x=0, y=0, hdg=0, *, length=50, shape="<line/>"):
    values = {"s": s, "x": x, "y": y, "hdg": hdg, "length": length}
    given = " ".join(f'{name}="{value}"' for name, value in values.items() if value is not None)
    return f"<geometry {given}>{shape}</geometry>"


def end_of_arc(length=50, curvature=0.02):
    turn = length * curvature
    return np.sin(turn) / curvature, (1 - np.cos(turn)) / curvature, turn


def places(road):
    s = np.linspace(0, road.length, 41)
    return np.column_stack(evaluate(road.plan_view, s))


@pytest.mark.parametrize(
    "broken",
    [
        {"x": "nan"},
        {"y": "inf"},
        {"hdg": None},
        {"x": None, "y": None, "hdg": None},
        {"s": "nan"},
        {"length": "nan"},
        {"x": 1e9},
    ],
)
@pytest.mark.parametrize("number", [0, 1])
def test_what_the_neighbours_tell_is_taken(network_of, road_xml, broken, number):
    """An arc, a line along its tangent, and an arc again; the same road as without the fault."""
    x, y, turn = end_of_arc()
    line = {"s": 50, "x": x, "y": y, "hdg": turn}
    after = {"s": 100, "x": x + 50 * np.cos(turn), "y": y + 50 * np.sin(turn), "hdg": turn}
    parts = [{"shape": ARC}, line, {**after, "shape": ARC}]
    whole = network_of(road_xml(plan_view="".join(geometry(**part) for part in parts)))
    parts[number] = {**parts[number], **broken}
    network = network_of(road_xml(plan_view="".join(geometry(**part) for part in parts)))
    np.testing.assert_allclose(places(network.roads["1"]), places(whole.roads["1"]), atol=1e-9)
    (issue,) = [issue for issue in network.issues if issue.severity == "error"]
    assert issue.where == f"road[id=1]/planView/geometry[{number + 1}]"
    assert issue.action


@pytest.mark.parametrize(
    "curve",
    [
        '<spiral curvStart="0"/>',
        '<arc curvature="nan"/>',
        '<spiral curvStart="-10" curvEnd="10"/>',
        '<arc curvature="1e7"/>',
        '<paramPoly3 pRange="normalized" aU="0" bU="50" cU="1e9" dU="0" aV="0" bV="0" cV="0"'
        ' dV="1e11"/>',
    ],
)
def test_a_curve_that_cannot_be_used_leads_to_the_next_geometry(network_of, road_xml, curve):
    x, y, turn = end_of_arc()
    plan = geometry() + geometry(50, 50, shape=curve) + geometry(100, 50 + x, y, turn)
    network = network_of(road_xml(length="150", plan_view=plan))
    road = network.roads["1"]
    at = np.column_stack(evaluate(road.plan_view, np.array([50.0, 75.0, 100 - 1e-9])))
    np.testing.assert_allclose(at[0], (50, 0, 0), atol=1e-9)
    np.testing.assert_allclose(at[2], (50 + x, y, turn), atol=1e-6)
    true = (50 + np.sin(0.5) / 0.02, (1 - np.cos(0.5)) / 0.02)
    assert np.hypot(*(at[1, :2] - true)) < 0.5
    assert [issue.severity for issue in network.issues].count("error") == 1


def test_where_nothing_tells_the_road_ends(network_of, road_xml):
    plan = geometry() + geometry(50, 50, shape='<spiral curvStart="0"/>')
    network = network_of(road_xml(plan_view=plan))
    assert network.roads["1"].length == 50
    assert [
        (issue.kind, issue.action) for issue in network.issues if issue.severity == "error"
    ] == [("attribute.missing", "road ends here")]


def test_the_only_geometry_without_a_heading(network_of, road_xml):
    network = network_of(road_xml(plan_view=geometry(x=3, y=4, hdg=None, length=100)))
    np.testing.assert_allclose(places(network.roads["1"])[-1], (103, 4, 0))
    (issue,) = network.issues
    assert (issue.severity, issue.action) == ("error", "hdg set to 0")


def test_the_repaired_tree_reads_the_same(read_xodr, road_xml, tmp_path):
    x, y, turn = end_of_arc()
    bad = geometry(50, "nan", shape='<spiral curvStart="0"/>')
    reading = read_xodr(road_xml(plan_view=geometry() + bad + geometry(100, 50 + x, y, turn)))
    write_document(reading.document, tmp_path / "fixed.xodr")
    again = read_network(tmp_path / "fixed.xodr")
    assert not [issue for issue in again.issues if issue.severity == "error"]
    np.testing.assert_allclose(places(again.roads["1"]), places(reading.network.roads["1"]))
