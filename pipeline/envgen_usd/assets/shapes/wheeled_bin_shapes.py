"""A wheeled bin of 240 litres (EN 840-1: 1.07 m high, 0.58 m wide, 0.73 m deep)."""

import numpy as np

from envgen_usd.assets.asset_design import Model, Part
from envgen_usd.assets.polygon_mesh import Mesh, merge
from envgen_usd.assets.shapes.simple_solids import box, flat, lathe, moved, tube, turned
from envgen_usd.models.array_types import FloatArray

_FACES = np.array(
    [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]
)
_ABOUT_X = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
_WHEEL = 0.1
"""Radius of a wheel, metres."""


def wheelie_bin() -> Model:
    """A body that widens upwards, a sloping lid with a grip, and two wheels at the back (-x)."""
    body = _frustum((-0.19, 0.27, -0.22, 0.22), (-0.29, 0.33, -0.275, 0.275), 0.06, 0.98)
    rim = _frustum((-0.31, 0.345, -0.29, 0.29), (-0.31, 0.345, -0.29, 0.29), 0.94, 0.985)
    feet = [box((0.16, y - 0.03, 0.0), (0.24, y + 0.03, 0.07)) for y in (-0.15, 0.15)]
    lid = _wedge((-0.33, 0.36, -0.29, 0.29), 0.985, (1.065, 1.015))
    grip = box((0.352, -0.12, 0.975), (0.385, 0.12, 1.0))
    handle = tube(np.array([[-0.36, -0.24, 1.0], [-0.36, 0.24, 1.0]]), np.full(2, 0.016), 8)
    arms = [box((-0.365, y - 0.02, 0.955), (-0.3, y + 0.02, 1.005)) for y in (-0.2, 0.2)]
    profile = np.array([[0.0, -0.03], [_WHEEL, -0.03], [_WHEEL, 0.03], [0.0, 0.03]])
    wheels, far_wheels = (
        [
            moved(turned(lathe(profile, sides), _ABOUT_X), (-0.25, y, _WHEEL))
            for y in (-0.255, 0.255)
        ]
        for sides in (14, 6)
    )
    axle = tube(np.array([[-0.25, -0.25, 0.1], [-0.25, 0.25, 0.1]]), np.full(2, 0.014), 8)
    far_body = _frustum((-0.25, 0.27, -0.23, 0.23), (-0.3, 0.34, -0.28, 0.28), 0.0, 0.985)
    parts = (
        Part("Body", merge([body, rim, *feet, handle, *arms]), "paint_black", "body"),
        Part("Lid", merge([lid, grip]), "paint_black", "lid"),
        Part("Wheels", merge([*wheels, axle]), "metal_dark", "wheel"),
        Part("WheelsProxy", merge(far_wheels), "metal_dark", "wheel", proxy_of="Wheels"),
        Part("BodyProxy", far_body, "paint_black", "body", proxy_of="Body"),
        Part(
            "LidProxy",
            _wedge((-0.33, 0.36, -0.29, 0.29), 0.985, (1.065, 1.015)),
            "paint_black",
            "lid",
            proxy_of="Lid",
        ),
    )
    return Model(parts)


def _frustum(foot: tuple[float, ...], top: tuple[float, ...], low: float, high: float) -> Mesh:
    """A solid between two level rectangles: x from, to, y from, to."""
    return _solid(_rectangle(foot, (low, low)), _rectangle(top, (high, high)))


def _wedge(sides: tuple[float, ...], low: float, high: tuple[float, float]) -> Mesh:
    """A solid over a rectangle whose upper face slopes from -x to +x."""
    return _solid(_rectangle(sides, (low, low)), _rectangle(sides, high))


def _rectangle(sides: tuple[float, ...], heights: tuple[float, float]) -> FloatArray:
    x0, x1, y0, y1 = sides
    back, front = heights
    return np.array([[x0, y0, back], [x1, y0, front], [x1, y1, front], [x0, y1, back]])


def _solid(lower: FloatArray, upper: FloatArray) -> Mesh:
    return flat(np.concatenate([lower, upper]), np.full(6, 4), _FACES.reshape(-1))
