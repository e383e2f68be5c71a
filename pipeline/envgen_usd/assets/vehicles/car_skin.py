"""The skin of a car's body: lower body, lid and cabin as half skins with parameters.

Parameters of the lower body: the way along its outline from the middle of the front, of its widest
ring, and the height. Those of the lid: along and y. Those of the cabin: the way along its outline
half way up, and the height.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from envgen_usd.assets.vehicles.body_shell import Skin, grid_skin, smoothed
from envgen_usd.assets.vehicles.car_form import (
    CarForm,
    Detail,
    Outline,
    curve,
    half_outline,
)
from envgen_usd.models.array_types import FloatArray

Height: TypeAlias = Callable[[FloatArray, FloatArray], FloatArray]
"""Heights by places (N x 2 or more) and shares of the way from an edge (N)."""
_EDGE = 0.035
"""Height of the rounded edge between flank and lid, metres."""


@dataclass(frozen=True)
class CarSkin:
    """The half skins of a body.

    Attributes:
        lower: Flanks, front and rear.
        lid: Bonnet, shoulder and deck.
        cabin: Walls of the greenhouse.
        roof: The roof.
        side: Way of the lower body's outline at along 0, so that a place of the flank has the way
            `side` + along.
        corners: Ways of the cabin's outline at the corners of windscreen and rear window, and at
            the middle of the rear.
        length: Way of the lower body's outline at the middle of the rear.
        walls: C x 3, columns of the cabin: way, along half way up, height of the roof's edge.
    """

    lower: Skin
    lid: Skin
    cabin: Skin
    roof: Skin
    side: float
    corners: tuple[float, float, float]
    length: float
    walls: FloatArray


def car_skin(form: CarForm, detail: Detail) -> CarSkin:
    """Builds the skins of a body."""
    lower, params, side, length = _lower(form, detail)
    top = lower[-1]
    lid = _lid(form, top, detail)
    walls, wall_params, corners, table = _walls(form, detail)
    roof = _lid_rows(walls[-1], _roof_height(form), detail.lid)
    lower_skin, lid_skin = smoothed(
        [grid_skin(lower, params), grid_skin(lid, np.stack([-lid[..., 0], lid[..., 1]], -1))], 50.0
    )
    roof_params = np.stack([-roof[..., 0], roof[..., 1]], -1)
    cabin, roof_skin = smoothed([grid_skin(walls, wall_params), grid_skin(roof, roof_params)], 50.0)
    return CarSkin(lower_skin, lid_skin, cabin, roof_skin, side, corners, length, table)


def _lower(form: CarForm, detail: Detail) -> tuple[FloatArray, FloatArray, float, float]:
    """Rings of the lower body R x C x 3, their parameters, and `side` and `length`."""
    # The wheel arches lie between: there, the way is that along the car.
    reach = form.wheel + form.arch + 0.03
    switch = (
        min(form.nose + 0.15, form.axles[0] - reach),
        max(form.length - form.tail - 0.1, form.axles[-1] + reach),
    )
    count = (detail.front, detail.side, detail.rear)
    widest = Outline(0.0, form.length, form.width / 2, form.nose, form.tail, form.square)
    middle = half_outline(widest, switch, count)
    way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(middle, axis=0).T))])
    first, last = detail.front - 1, detail.front - 1 + detail.side
    rings, params = [], []
    for share in detail.flank:
        outline = replace(
            widest,
            front=float(curve(form.bow, share)),
            rear=form.length - float(curve(form.stern, share)),
            half=form.width / 2 - float(curve(form.flank, share)),
        )
        ring = half_outline(outline, switch, count)
        along, y = ring.T
        edge = curve(form.shoulder, along) - _EDGE
        z = form.sill + share * (edge - form.sill)
        own = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(ring, axis=0).T))])
        # Ways are equal along the side; each end counts from there.
        own += np.where(np.arange(len(own)) < last, way[first] - own[first], way[last] - own[last])
        own[first:last] = way[first:last]
        y = y + _flare(form, along, z) * np.clip(y / (form.width / 2) * 4 - 3, 0.0, 1.0)
        rings.append(np.stack([form.x(along), y, z], axis=1))
        params.append(np.stack([own, z], axis=1))
    side = float(way[first] - middle[first, 0])
    return np.stack(rings), np.stack(params), side, float(way[-1])


def _flare(form: CarForm, along: FloatArray, z: FloatArray) -> FloatArray:
    bulge = np.zeros_like(along)
    for axle in form.axles:
        away = np.hypot(along - axle, z - form.wheel) - form.wheel - form.arch
        bulge = np.maximum(bulge, form.flare * np.exp(-((away / 0.09) ** 2)))
    return bulge


def _lid(form: CarForm, top: FloatArray, detail: Detail) -> FloatArray:
    """Rows of bonnet and deck from the edge to the middle line."""

    def height(place: FloatArray, share: FloatArray) -> FloatArray:
        along = form.length / 2 - place[..., 0]
        rounding = _EDGE * np.sqrt(1 - np.clip(1 - share / 0.05, 0.0, 1.0) ** 2)
        crown = curve(form.bonnet, along) * (1 - (1 - share) ** 2)
        raised: FloatArray = curve(form.shoulder, along) - _EDGE + rounding + crown
        return raised

    return _lid_rows(top, height, detail.lid)


def _roof_height(form: CarForm) -> Height:
    """Height of the roof by place and share of the way from its edge."""

    def height(place: FloatArray, share: FloatArray) -> FloatArray:
        along = form.length / 2 - place[..., 0]
        raised: FloatArray = curve(form.cabin.roof, along) + form.cabin.crown * (
            1 - (1 - share) ** 2.2
        )
        return raised

    return height


def _lid_rows(edge: FloatArray, height: Height, shares: tuple[float, ...]) -> FloatArray:
    """Rows from an edge (C x 3) to the middle line; columns at the ends fan out."""
    low, high = edge[-1, 0], edge[0, 0]
    reach = 0.22 * (high - low)
    spine = np.stack(
        [np.clip(edge[:, 0], low + reach * 0.7, high - reach * 0.7), np.zeros(len(edge))], axis=1
    )
    rows = [edge]
    for share in shares[1:]:
        plan = edge[:, :2] + share * (spine - edge[:, :2])
        z = height(plan, np.full(len(edge), share))
        rows.append(np.column_stack([plan, z]))
    return np.stack(rows)


def _walls(
    form: CarForm, detail: Detail
) -> tuple[FloatArray, FloatArray, tuple[float, float, float], FloatArray]:
    """Rings of the cabin R x C x 3, their parameters, ways of its corners, and `walls`."""
    cabin = form.cabin
    count = (max(detail.front - 1, 3), detail.cabin_side, max(detail.rear - 1, 3))
    base, top = (
        half_outline(each, (each.front + each.nose, each.rear - each.tail), count)
        for each in (cabin.base, cabin.top)
    )
    middle = (base + top) / 2
    way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(middle, axis=0).T))])
    edge = curve(cabin.roof, top[:, 0])
    rings, params = [], []
    outward = np.gradient(middle, axis=0)
    outward = np.stack([-outward[:, 1], outward[:, 0]], axis=1)
    outward = outward / np.linalg.norm(outward, axis=1, keepdims=True)
    outward[[0, -1], 1] = 0.0
    for share in detail.cabin:
        plan = base + share * (top - base) + outward * cabin.bulge * 4 * share * (1 - share)
        z = cabin.foot + share * (edge - cabin.foot)
        rings.append(np.column_stack([form.x(plan[:, 0]), plan[:, 1], z]))
        params.append(np.stack([way, z], axis=1))
    corners = (
        float(way[count[0] - 1]),
        float(way[count[0] + count[1] - 1]),
        float(way[-1]),
    )
    table = np.stack([way, middle[:, 0], edge], axis=1)
    return np.stack(rings), np.stack(params), corners, table
