"""Joins all plan views of a network for a single evaluation of all geometries."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.models.plan_view import PlanView
from envgen_usd.models.road import Road
from envgen_usd.opendrive.geometry.curve_evaluation import evaluate


@dataclass(frozen=True)
class Joined:
    """G geometries of R roads in sequence.

    Attributes:
        plan_view: All geometries on a common s with gaps of 1 m, so that each end can be
            evaluated.
        road: G, index of the road.
        number: G, index within the road's geometries.
        start: G x 3, x, y, heading at the start of each geometry.
        end: G x 3, x, y, heading at the end of each geometry.
        first: R, index of each road's first geometry.
        last: R, index of each road's last geometry.
    """

    plan_view: PlanView
    road: IntArray
    number: IntArray
    start: FloatArray
    end: FloatArray
    first: IntArray
    last: IntArray


def join_plan_views(roads: Sequence[Road]) -> Joined:
    """Joins the plan views of roads."""
    views = [road.plan_view for road in roads]
    counts = np.array([len(view.s) for view in views])
    last = np.cumsum(counts) - 1
    first = last - counts + 1
    length = np.concatenate([view.length for view in views])
    start = np.cumsum(length + 1) - length - 1
    joined = PlanView(
        start,
        np.concatenate([view.x for view in views]),
        np.concatenate([view.y for view in views]),
        np.concatenate([view.heading for view in views]),
        length,
        np.concatenate([view.kind for view in views]),
        np.concatenate([view.curvature for view in views]),
        np.concatenate([view.cubic for view in views]),
        np.concatenate([view.p_range for view in views]),
    )
    x, y, heading = evaluate(joined, np.stack([start, start + length]))
    begin, end = np.stack([x, y, heading], axis=-1)  # each G x 3
    owner = np.repeat(np.arange(len(views)), counts)
    number = np.arange(len(start)) - first[owner]
    return Joined(joined, owner, number, begin, end, first, last)
