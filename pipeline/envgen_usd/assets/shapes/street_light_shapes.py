"""Street lights: a lantern, a cobra head, a column with a bracket, twin heads; +x is the road."""

import numpy as np

from envgen_usd.assets.asset_design import Lamp, Model, Part
from envgen_usd.assets.polygon_mesh import Mesh, merge
from envgen_usd.assets.shapes.simple_solids import box, lathe, moved, post, tube, turned

_WARM = (1.35, 0.92, 0.50)
"""Linear RGB of a lamp of about 3000 K at luminance 1."""


def lantern_post() -> Model:
    """Decorative post of 5 m with an acorn lantern (the Virginia type)."""
    base = lathe(
        np.array(
            [[0.20, 0.0], [0.20, 0.12], [0.17, 0.16], [0.17, 0.55], [0.13, 0.62], [0.14, 0.68],
             [0.085, 0.78], [0.075, 0.95]]
        ), 12,
    )  # fmt: skip
    shaft = moved(post(3.10, 0.070, 12, 0.052), (0.0, 0.0, 0.93))
    capital = lathe(
        np.array(
            [[0.055, 4.0], [0.085, 4.04], [0.06, 4.10], [0.07, 4.20], [0.13, 4.27], [0.135, 4.31]]
        ), 12,
    )  # fmt: skip
    roof = lathe(
        np.array(
            [[0.20, 4.76], [0.21, 4.79], [0.12, 4.88], [0.03, 4.92], [0.028, 4.97], [0.0, 5.0]]
        ),
        12,
    )
    globe = lathe(np.array([[0.12, 4.31], [0.185, 4.42], [0.215, 4.58], [0.195, 4.76]]), 14)
    parts = (
        Part("Post", merge([base, shaft, capital, roof]), "paint_black", "post"),
        Part("Lamp", globe, "lamp", "lamp"),
    )
    # The light encloses the globe, so that no renderer shades it with the globe's glass.
    light = Lamp("Light", (0.0, 0.0, 4.55), 0.23, 4000.0, _WARM, faces_down=False)
    return Model(parts, lamps=(light,))


def cobra_head() -> Model:
    """Tapered pole of 8 m with a curved arm of 2.2 m and a cobra head (the New York type)."""
    flange = box((-0.20, -0.20, 0.0), (0.20, 0.20, 0.04))
    foot = moved(post(0.45, 0.14, 12, 0.12), (0.0, 0.0, 0.04))
    pole = moved(post(7.0, 0.105, 12, 0.060), (0.0, 0.0, 0.45))
    t = np.linspace(0.0, 1.0, 8)
    arm_path = np.c_[2.0 * t, np.zeros(8), 7.05 + 0.88 * np.sin(t * np.pi / 2) ** 0.9]
    arm = tube(arm_path, np.linspace(0.045, 0.032, 8), 8)
    brace_path = np.array([[0.0, 0.0, 7.44], [0.42, 0.0, 7.50]])
    brace = tube(brace_path, np.array([0.018, 0.018]), 6)
    head_path = np.array(
        [[1.92, 0, 7.92], [2.06, 0, 7.93], [2.30, 0, 7.93], [2.58, 0, 7.915], [2.72, 0, 7.90]]
    )
    head = tube(head_path, np.array([0.045, 0.075, 0.125, 0.115, 0.03]), 10)
    lens = moved(
        lathe(np.array([[0.0, -0.05], [0.085, -0.03], [0.11, 0.0]]), 12), (2.42, 0.0, 7.82)
    )
    parts = (
        Part("Post", merge([flange, foot, pole, arm, brace, head]), "metal_galvanised", "post"),
        Part("Lamp", lens, "lamp", "lamp"),
    )
    light = Lamp("Light", (2.42, 0.0, 7.76), 0.11, 8000.0, _WARM, faces_down=True)
    return Model(parts, lamps=(light,))


def bracket_column() -> Model:
    """Slim column of 8 m with a short bracket and a flat head."""
    base = post(1.3, 0.085, 12)
    shaft = moved(post(6.6, 0.055, 10, 0.04), (0.0, 0.0, 1.3))
    door = box((0.07, -0.05, 0.5), (0.09, 0.05, 1.0))
    bracket = tube(np.array([[0.0, 0.0, 7.85], [0.12, 0.0, 7.94], [0.9, 0.0, 7.98]]),
                   np.full(3, 0.028), 8)  # fmt: skip
    head = _flat_head(0.8)
    parts = (
        Part("Post", merge([base, shaft, door, bracket, head]), "metal_galvanised", "post"),
        Part("Lamp", _flat_lens(0.8), "lamp", "lamp"),
    )
    light = Lamp("Light", (1.07, 0.0, 7.9), 0.11, 7000.0, _WARM, faces_down=True)
    return Model(parts, lamps=(light,))


def twin_column() -> Model:
    """Column of 8 m with a flat head on each side."""
    base = post(1.3, 0.095, 12)
    shaft = moved(post(6.68, 0.06, 10, 0.045), (0.0, 0.0, 1.3))
    bracket = tube(np.array([[-0.9, 0.0, 7.98], [0.9, 0.0, 7.98]]), np.full(2, 0.03), 8)
    half_turn = np.diag([-1.0, -1.0, 1.0])
    heads = [_flat_head(0.8), turned(_flat_head(0.8), half_turn)]
    lenses = [_flat_lens(0.8), turned(_flat_lens(0.8), half_turn)]
    parts = (
        Part("Post", merge([base, shaft, bracket, *heads]), "metal_galvanised", "post"),
        Part("Lamp", merge(lenses), "lamp", "lamp"),
    )
    lights = tuple(
        Lamp(name, (x, 0.0, 7.9), 0.11, 7000.0, _WARM, faces_down=True)
        for name, x in (("Light", 1.07), ("LightBehind", -1.07))
    )
    return Model(parts, lamps=lights)


def _flat_head(x: float) -> Mesh:
    """The flat case of a lamp from x outwards, 8 m above the ground."""
    return merge(
        [
            box((x, -0.11, 7.95), (x + 0.52, 0.11, 8.0)),
            box((x + 0.05, -0.07, 8.0), (x + 0.40, 0.07, 8.04)),
        ]
    )


def _flat_lens(x: float) -> Mesh:
    return box((x + 0.12, -0.08, 7.935), (x + 0.44, 0.08, 7.95))
