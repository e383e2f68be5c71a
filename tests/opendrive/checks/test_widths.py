import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

# Within 250 m at 10 m: beyond it a width is no road's and is taken as constant (`bounds`).
small = st.floats(-0.2, 0.2).map(lambda value: round(value, 4))


def lanes_of(pieces):
    widths = "".join(
        f'<width sOffset="{s}" a="{a}" b="{b}" c="{c}" d="{d}"/>' for s, a, b, c, d in pieces
    )
    return (
        '<laneSection s="0"><center><lane id="0"/></center><right>'
        f'<lane id="-1" type="driving">{widths}</lane></right></laneSection>'
    )


@settings(max_examples=40)
@given(
    first=st.tuples(small, small, small, small),
    second=st.tuples(small, small, small, small),
    border=st.floats(1, 9).map(lambda value: round(value, 3)),
)
def test_widths_are_cut_off_at_0_and_else_as_they_were(xodr_reader, first, second, border):
    """Trap 8."""
    plan = '<geometry s="0" x="0" y="0" hdg="0" length="10"><line/></geometry>'
    lanes = lanes_of([(0, *first), (border, *second)])
    network = xodr_reader(plan_view=plan, length="10", lanes=lanes)
    width = network.roads["1"].sections[0].right[0].width
    ds = np.linspace(0, 10, 301)
    rest = np.where(ds < border, ds, ds - border)
    a, b, c, d = np.where(ds < border, np.array(first)[:, None], np.array(second)[:, None])
    given_width = a + b * rest + c * rest**2 + d * rest**3
    expected = np.where(given_width < -1e-6, 0, given_width)
    np.testing.assert_allclose(width(ds), expected, atol=1e-5)
    assert bool([i for i in network.issues if i.kind == "lane.negative_width"]) or (
        given_width.min() > -1e-5
    )


def test_a_negative_width_is_reported_once(network_of, road_xml, kinds):
    network = network_of(road_xml(lanes=lanes_of([(0, 1, -0.05, 0, 0)])))
    assert kinds(network) == ["lane.negative_width"]
    (lane,) = network.roads["1"].sections[0].right
    assert lane.width(np.array([10.0, 20.0, 60.0])) == pytest.approx([0.5, 0, 0], abs=1e-9)


@pytest.mark.parametrize("second", [(0.0, 0.0, 0.0, 0.0), (3.0, 0.0, 0.0, 0.0)])
def test_only_the_piece_below_0_changes(network_of, road_xml, second):
    """3 - 0.4 s + 0.01 s² is 0 at s = 10 and 30 and least, -1, between them."""
    pieces = [(0, 3.0, -0.4, 0.01, 0), (40, *second)]
    network = network_of(road_xml(lanes=lanes_of(pieces)))
    (issue,) = [each for each in network.issues if each.kind == "lane.negative_width"]
    assert "-1 m" in issue.message
    (lane,) = network.roads["1"].sections[0].right
    s = np.array([0, 5, 10, 15, 20, 25, 30, 35, 39.99, 40, 70, 100.0])
    expected = [3, 1.25, 0, 0, 0, 0, 0, 1.25, 2.996001, *[second[0]] * 3]
    assert lane.width(s) == pytest.approx(expected, abs=1e-6)
