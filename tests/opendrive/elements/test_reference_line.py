import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from envgen_usd.models.plan_view import Curve
from envgen_usd.opendrive.geometry.curve_evaluation import evaluate


def geometry(s, length, shape="<line/>", *, x=None, y=0.0, heading=0.0):
    place = f'x="{s if x is None else x}" y="{y}" hdg="{heading}"'
    return f'<geometry s="{s}" {place} length="{length}">{shape}</geometry>'


def read_plan(network_of, road_xml, plan_view, length):
    network = network_of(road_xml(plan_view=plan_view, length=str(length)))
    return network.roads["1"], [issue.kind for issue in network.issues]


@pytest.mark.parametrize(
    ("shape", "curve", "issue"),
    [
        ('<arc curvature="0"/>', (Curve.LINE, 0), "plan_view.straight_arc"),
        ('<spiral curvStart="0" curvEnd="0"/>', (Curve.LINE, 0), "plan_view.constant_spiral"),
        (
            '<spiral curvStart="0.1" curvEnd="0.1"/>',
            (Curve.ARC, 0.1),
            "plan_view.constant_spiral",
        ),
        ("", (Curve.LINE, 0), "plan_view.no_shape"),
    ],
)
def test_degenerate_curves_are_what_they_degenerate_to(network_of, road_xml, shape, curve, issue):
    """Trap 3."""
    road, kinds = read_plan(network_of, road_xml, geometry(0, 100, shape), 100)
    kind, curvature = curve
    assert road.plan_view.kind.tolist() == [kind]
    assert road.plan_view.curvature.tolist() == [[curvature, curvature]]
    assert kinds == [issue]


def test_tiny_geometries_are_left_out(network_of, road_xml):
    """Trap 4."""
    plan = geometry(0, 50) + geometry(50, 0) + geometry(50, 1e-9) + geometry(50, 50)
    road, kinds = read_plan(network_of, road_xml, plan, 100)
    assert road.plan_view.s.tolist() == [0, 50]
    assert kinds == ["plan_view.too_short"] * 2


def test_unsorted_geometries_are_sorted(network_of, road_xml):
    """Trap 4."""
    plan = geometry(70, 30) + geometry(0, 20) + geometry(20, 50)
    road, kinds = read_plan(network_of, road_xml, plan, 100)
    assert road.plan_view.x.tolist() == [0, 20, 70]
    assert kinds == ["order.descending"]


@pytest.mark.parametrize("declared", [20, 99.9, 250])
def test_the_road_is_as_long_as_its_geometries(network_of, road_xml, declared):
    """Trap 4."""
    road, kinds = read_plan(network_of, road_xml, geometry(0, 60) + geometry(60, 40), declared)
    assert road.length == 100
    assert road.sections[-1].end == 100
    assert kinds == ["road.length"]


def test_a_road_that_starts_later_starts_at_0(network_of, road_xml):
    plan = geometry(10, 60, x=0) + geometry(70, 40, x=60)
    road, kinds = read_plan(network_of, road_xml, plan, 100)
    assert road.plan_view.s.tolist() == [0, 60]
    assert kinds == ["plan_view.start"]


def test_an_s_far_beyond_the_line_is_moved_back(network_of, road_xml):
    """The first curve would else go on for 218 km; fuzzing waited for it for minutes."""
    plan = geometry(0, 60) + geometry(218_756, 40, x=60) + geometry(218_796, 10, x=100)
    road, kinds = read_plan(network_of, road_xml, plan, 110)
    assert road.plan_view.s.tolist() == [0, 60, 100]
    assert road.length == 110
    assert kinds == ["plan_view.s_jump"]


@pytest.mark.parametrize("place", [0, 1, 2])
def test_a_geometry_kilometres_away_is_put_back(network_of, road_xml, place):
    """Its lanes would be torn over 130 km, which took minutes and gigabytes."""
    parts = [geometry(20 * n, 20, y=-130_617.5 if n == place else 0) for n in range(3)]
    road, kinds = read_plan(network_of, road_xml, "".join(parts), 60)
    assert road.plan_view.x.tolist() == pytest.approx([0, 20, 40])
    assert road.plan_view.y.tolist() == pytest.approx([0, 0, 0])
    assert kinds == ["plan_view.stray"]


def test_a_road_in_two_places_ends_at_the_first(network_of, road_xml):
    parts = [geometry(20 * n, 20, y=5000 * (n > 1)) for n in range(4)]
    road, kinds = read_plan(network_of, road_xml, "".join(parts), 80)
    assert road.length == 40
    assert sorted(kinds) == ["plan_view.stray", "road.length"]


def test_gaps_kinks_and_steps_of_s_are_reported(network_of, road_xml):
    plan = (
        geometry(0, 20)
        + geometry(20, 20, x=20.02)
        + geometry(40, 20, x=40.02, heading=0.02)
        + geometry(60.5, 20, x=60.016, y=0.4, heading=0.02)
    )
    road, kinds = read_plan(network_of, road_xml, plan, 80.5)
    assert sorted(kinds) == ["plan_view.gap", "plan_view.kink", "plan_view.s_gap"]
    assert len(road.plan_view.s) == 4


def test_a_gap_below_a_centimetre_is_no_issue(network_of, road_xml):
    _, kinds = read_plan(network_of, road_xml, geometry(0, 50) + geometry(50, 50, x=50.009), 100)
    assert kinds == []


def parabola(scale, bend, more=""):
    """The curve v = bend u² by p = u / scale."""
    return (
        f'<paramPoly3 aU="0" bU="{scale}" cU="0" dU="0" aV="0" bV="0" cV="{bend * scale**2}" dV="0"'
        f" {more}/>"
    )


@settings(max_examples=25)
@given(
    length=st.floats(5, 60),
    bend=st.floats(-0.01, 0.01),
    normalised=st.booleans(),
    p_range=st.sampled_from(["", 'pRange="normalized"', 'pRange="arcLength"', 'pRange="x"']),
)
def test_the_range_of_p_follows_from_the_curve(xodr_reader, length, bend, normalised, p_range):
    """Trap 5: the curve says what p is, whatever pRange says."""
    shape = parabola(length if normalised else 1.0, bend, p_range)
    road = xodr_reader(plan_view=geometry(0, length, shape), length=str(length)).roads["1"]
    x, y, _ = evaluate(road.plan_view, np.array([length]))
    assert x[0] == pytest.approx(length)
    assert y[0] == pytest.approx(bend * length**2)


def test_a_declared_length_that_is_not_the_arc_length_is_reported(network_of, road_xml):
    """Trap 5."""
    shape = parabola(50, 0.008, 'pRange="normalized"')
    _, kinds = read_plan(network_of, road_xml, geometry(0, 50, shape), 50)
    assert kinds == ["plan_view.arc_length"]


@pytest.mark.parametrize(("share", "is_wrong"), [(1.0, False), (1.02, True), (0.98, True)])
def test_the_length_of_a_cubic_in_both_coordinates_is_that_of_the_integral(
    network_of, road_xml, share, is_wrong
):
    u, v = np.array([0.0, 60.0, 12.0, -9.0]), np.array([0.0, 0.0, 25.0, -14.0])
    along, aside = (np.polynomial.Polynomial(each).deriv() for each in (u, v))
    length = round(share * quad(lambda p: np.hypot(along(p), aside(p)), 0.0, 1.0)[0], 4)
    figures = {f"{name}U": a for name, a in zip("abcd", u, strict=True)}
    figures |= {f"{name}V": a for name, a in zip("abcd", v, strict=True)}
    given = " ".join(f'{name}="{a}"' for name, a in figures.items())
    plan = geometry(0, length, f'<paramPoly3 pRange="normalized" {given}/>')
    _, kinds = read_plan(network_of, road_xml, plan, length)
    assert ("plan_view.arc_length" in kinds) == is_wrong
