"""Reference lines against closed forms and numerical integration."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.special import fresnel

from envgen_usd.models.plan_view import Curve, PlanView
from envgen_usd.opendrive.geometry.curve_evaluation import bend, evaluate

curvatures = st.floats(-0.2, 0.2)
lengths = st.floats(0.01, 200.0)
headings = st.floats(-7.0, 7.0)


def one(kind, length, *, curvature=(0.0, 0.0), cubic=(0.0,) * 8, p_range=1.0, pose=(0, 0, 0)):
    x, y, heading = (np.array([float(value)]) for value in pose)
    return PlanView(
        np.zeros(1),
        x,
        y,
        heading,
        np.array([length]),
        np.array([kind]),
        np.array([curvature]),
        np.array([cubic]),
        np.array([p_range]),
    )


def integrated(turn, length):
    """Where a curve of unit speed ends that turns by the given function."""
    u = quad(lambda s: np.cos(turn(s)), 0, length, limit=400, epsabs=1e-11)[0]
    v = quad(lambda s: np.sin(turn(s)), 0, length, limit=400, epsabs=1e-11)[0]
    return u, v


@given(lengths, headings)
def test_line(length, heading):
    s = np.linspace(0, length, 5)
    x, y, found = evaluate(one(Curve.LINE, length, pose=(3, -2, heading)), s)
    np.testing.assert_allclose(x, 3 + s * np.cos(heading), atol=1e-12)
    np.testing.assert_allclose(y, -2 + s * np.sin(heading), atol=1e-12)
    np.testing.assert_allclose(found, heading)


@given(lengths, curvatures.filter(lambda k: abs(k) > 1e-3), headings)
def test_arc_stays_at_its_radius(length, curvature, heading):
    s = np.linspace(0, length, 7)
    x, y, found = evaluate(
        one(Curve.ARC, length, curvature=(curvature,) * 2, pose=(1, 2, heading)), s
    )
    centre = 1 - np.sin(heading) / curvature, 2 + np.cos(heading) / curvature
    np.testing.assert_allclose(np.hypot(x - centre[0], y - centre[1]), 1 / abs(curvature))
    np.testing.assert_allclose(found, heading + curvature * s, atol=1e-12)


@given(lengths)
def test_arc_without_curvature_is_a_line(length):
    s = np.linspace(0, length, 4)
    for kind in (Curve.ARC, Curve.SPIRAL):
        x, y, heading = evaluate(one(kind, length), s)
        np.testing.assert_allclose(x, s)
        np.testing.assert_allclose((y, heading), 0.0, atol=1e-15)


@given(lengths, st.floats(1e-3, 0.2))
def test_spiral_from_a_straight_is_fresnels(length, curvature):
    s = np.linspace(0, length, 6)
    x, y, _ = evaluate(one(Curve.SPIRAL, length, curvature=(0.0, curvature)), s)
    scale = np.sqrt(np.pi * length / curvature)
    sine, cosine = fresnel(s / scale)
    np.testing.assert_allclose(x, scale * cosine, atol=1e-9)
    np.testing.assert_allclose(y, scale * sine, atol=1e-9)


@given(lengths, curvatures, st.floats(-1e-8, 1e-8) | curvatures)
def test_spiral_is_the_integral_of_its_turn(length, start, change):
    rate = change / length

    def turn(s):
        return s * (start + rate * s / 2)

    x, y, heading = evaluate(
        one(Curve.SPIRAL, length, curvature=(start, start + change)), np.array([length])
    )
    np.testing.assert_allclose((x[0], y[0]), integrated(turn, length), atol=1e-8)
    np.testing.assert_allclose(heading, turn(length), atol=1e-9)


@given(st.floats(1.0, 50.0), st.floats(-0.5, 0.5), st.floats(-0.01, 0.01), st.floats(-1e-4, 1e-4))
def test_poly3_is_followed_by_arc_length(length, b, c, d):
    s = np.linspace(0, length, 4)
    x, y, _ = evaluate(one(Curve.POLY3, length, cubic=(0.3, b, c, d, 0, 0, 0, 0)), s)
    np.testing.assert_allclose(y, 0.3 + b * x + c * x**2 + d * x**3, atol=1e-9)
    for end, travelled in zip(x, s, strict=True):
        arc = quad(lambda u: np.hypot(1, b + 2 * c * u + 3 * d * u * u), 0, end)[0]
        assert arc == pytest.approx(travelled, abs=1e-6)


@given(st.floats(0.5, 80.0), st.booleans(), st.lists(st.floats(-3, 3), min_size=8, max_size=8))
def test_param_poly3_is_its_polynomials(length, normalised, cubic):
    p_range = 1.0 if normalised else length
    part = np.linspace(0, 1, 5)
    plan_view = one(Curve.PARAM_POLY3, length, cubic=cubic, p_range=p_range)
    x, y, _ = evaluate(plan_view, part * length)
    p = part * p_range
    np.testing.assert_allclose(x, np.polyval(cubic[3::-1], p), rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(y, np.polyval(cubic[:3:-1], p), rtol=1e-9, atol=1e-9)
    beyond = evaluate(plan_view, np.array([length + 5.0]))
    np.testing.assert_allclose((beyond[0][0], beyond[1][0]), (x[-1], y[-1]))


@pytest.mark.parametrize(
    "plan_view",
    [
        one(Curve.ARC, 30.0, curvature=(0.05, 0.05), pose=(1, 1, 1)),
        one(Curve.SPIRAL, 30.0, curvature=(-0.02, 0.1), pose=(1, 1, 1)),
        one(Curve.POLY3, 30.0, cubic=(0, 0.1, 0.01, 1e-4, 0, 0, 0, 0), pose=(1, 1, 1)),
        one(Curve.PARAM_POLY3, 30.0, cubic=(0, 30, -2, 1, 0, 0, 9, -3), pose=(1, 1, 1)),
    ],
)
def test_heading_is_the_tangent_and_bend_the_second_derivative_across(plan_view):
    s = np.linspace(1, 29, 15)
    step = 1e-3
    (x0, y0, _), (x1, y1, heading), (x2, y2, _) = (
        evaluate(plan_view, s + shift) for shift in (-step, 0, step)
    )
    turned = np.arctan2(y2 - y0, x2 - x0) - heading
    np.testing.assert_allclose(np.sin(turned), 0.0, atol=1e-5)
    second = (y0 - 2 * y1 + y2) * np.cos(heading) - (x0 - 2 * x1 + x2) * np.sin(heading)
    if plan_view.kind[0] != Curve.POLY3:
        np.testing.assert_allclose(
            bend(plan_view, s), np.abs(second) / step**2, rtol=1e-2, atol=1e-4
        )


def test_many_geometries_are_evaluated_like_each_alone():
    kinds = [Curve.LINE, Curve.ARC, Curve.SPIRAL, Curve.PARAM_POLY3]
    parts = [
        one(
            kind,
            10.0,
            curvature=(0.01, 0.01 + 0.02 * (kind == Curve.SPIRAL)),
            cubic=np.arange(8.0),
            pose=(k, -k, k),
        )
        for k, kind in enumerate(kinds)
    ]
    parts[0] = replace(parts[0], curvature=np.zeros_like(parts[0].curvature))
    joined = PlanView(*(np.concatenate(values) for values in zip(*map(fields, parts), strict=True)))
    joined = replace(joined, s=np.arange(4) * 10.0)
    s = np.arange(40.0).reshape(8, 5)
    together = np.array(evaluate(joined, s))
    assert together.shape == (3, 8, 5)
    for k, part in enumerate(parts):
        alone = np.array(evaluate(part, np.arange(10.0)))
        np.testing.assert_allclose(together.reshape(3, 4, 10)[:, k], alone)


def fields(plan_view):
    return list(vars(plan_view).values())
