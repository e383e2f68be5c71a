"""Wheels: a tyre with a dark well, and a rim of spokes; the axle is the y axis, outside is +y."""

from dataclasses import dataclass

import numpy as np

from envgen_usd.assets.polygon_mesh import Mesh, merge
from envgen_usd.assets.shapes.simple_solids import flat, turned
from envgen_usd.assets.vehicles.skin_shapes import revolved
from envgen_usd.models.array_types import FloatArray

_SIDES = 20
"""Corners of a tyre; more show it rounder and draw slower."""


@dataclass(frozen=True)
class Rim:
    """A design of rims.

    Attributes:
        spokes: Number of spokes, or of pairs.
        width: Width of a spoke at the hub and at the rim, metres.
        pair: Angle between the spokes of a pair, degrees; 0 for single spokes.
        share: Radius of the rim as a share of the wheel's.
    """

    spokes: int
    width: tuple[float, float]
    pair: float = 0.0
    share: float = 0.70


def tyre(radius: float, width: float, rim: Rim, sides: int = _SIDES) -> Mesh:
    """A tyre; its outer side is a dark well behind the rim."""
    half, inner = width / 2, radius * rim.share
    profile = np.array(
        [
            [0.0, half - 0.075], [inner - 0.004, half - 0.07], [inner, half - 0.012],
            [radius - 0.024, half - 0.004], [radius, half - 0.035], [radius, 0.035 - half],
            [radius - 0.03, -half], [0.0, 0.02 - half],
        ]
    )  # fmt: skip
    return revolved(profile, sides)


def rim_mesh(radius: float, width: float, rim: Rim) -> Mesh:
    """Rim, spokes and hub."""
    half, outer = width / 2, radius * rim.share
    face = half - 0.018
    lip = np.array(
        [[outer - 0.012, half - 0.07], [outer - 0.016, face - 0.002], [outer + 0.002, half - 0.012]]
    )
    hub = np.array([[0.0, face - 0.004], [0.052, face - 0.010], [0.060, face - 0.05]])
    first = [0.0] if rim.pair == 0 else [-rim.pair / 2, rim.pair / 2]
    spokes = [
        _spoke(outer - 0.010, face, rim, np.radians(360.0 * number / rim.spokes + turn))
        for number in range(rim.spokes)
        for turn in first
    ]
    return merge([revolved(lip, _SIDES), revolved(hub, 8), *spokes])


def _spoke(outer: float, face: float, rim: Rim, angle: float) -> Mesh:
    """A spoke along +x, turned about the axle."""
    a, b = rim.width[0] / 2, rim.width[1] / 2
    points = []
    for x, half, y in ((0.03, a, face - 0.010), (outer, b, face)):
        points += [(x, y - 0.03, -half), (x, y, -half * 0.75), (x, y, half * 0.75),
                   (x, y - 0.03, half)]  # fmt: skip
    across = np.arange(3)
    quads = np.stack([across, across + 1, across + 5, across + 4], axis=1)
    mesh = flat(np.array(points), np.full(3, 4), quads.reshape(-1))
    return turned(mesh, _about_axle(angle))


def _about_axle(angle: float) -> FloatArray:
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.array([[cosine, 0.0, sine], [0.0, 1.0, 0.0], [-sine, 0.0, cosine]])
