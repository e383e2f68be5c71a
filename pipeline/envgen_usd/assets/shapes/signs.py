"""Traffic signs and traffic lights; their faces look to +x."""

import numpy as np

from envgen_usd.assets.design import Model, Part
from envgen_usd.assets.mesh import Mesh, merge
from envgen_usd.assets.shapes.solids import box, flat, moved, post, tube
from envgen_usd.models.arrays import FloatArray

PLATE_CENTRE = 2.45
"""Height of a sign's middle, metres."""
SIGN_HEIGHT = 2.8


def _outline(shape: str, size: float) -> FloatArray:
    """Corners (y, z) of a plate that is `size` metres wide, counter-clockwise, about its middle."""
    corners = {"round": 24, "octagon": 8, "square": 4, "triangle": 3}[shape]
    start = {"round": 0.0, "octagon": np.pi / 8, "square": np.pi / 4, "triangle": np.pi / 2}[shape]
    angle = start + np.arange(corners) * 2 * np.pi / corners
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return ring * (size / float(np.ptp(ring[:, 0])))


def _disc(outline: FloatArray, x0: float, x1: float) -> Mesh:
    """A plate between two distances from the post, with its rim."""
    count = len(outline)
    back = np.c_[np.full(count, x0), outline]
    front = np.c_[np.full(count, x1), outline]
    k = np.arange(count)
    beside = (k + 1) % count
    rim = np.stack([k, beside, beside + count, k + count], axis=1)
    corners = np.concatenate([k[::-1], k + count, rim.reshape(-1)])
    sizes = np.array([count, count, *([4] * count)])
    return flat(np.concatenate([back, front]), sizes, corners)


def traffic_sign(shape: str, border: str, face: str) -> Model:
    """A sign on a post: a plate with a coloured border.

    Args:
        shape: ``round``, ``triangle``, ``octagon`` or ``square``.
        border: Material of the plate's edge.
        face: Material of its middle.
    """
    size = {"round": 0.6, "triangle": 0.9, "octagon": 0.75, "square": 0.6}[shape]
    outline = _outline(shape, size)
    inner = outline * (0.74 if shape in {"round", "triangle"} else 0.90)
    lift = (0.0, 0.0, PLATE_CENTRE)
    plate = moved(_disc(outline, 0.036, 0.040), lift)
    back = moved(_disc(outline, 0.030, 0.036), lift)
    parts = (
        Part("Post", post(SIGN_HEIGHT, 0.030, 10), "metal_galvanised", "post"),
        Part("Back", back, "metal_galvanised", "sign_back"),
        Part("Border", plate, border, "sign_face"),
        Part("Face", moved(_disc(inner, 0.040, 0.042), lift), face, "sign_face"),
    )
    return Model(parts)


def traffic_light() -> Model:
    """A post with a head of three lenses under hoods."""
    parts_metal = [post(3.55, 0.055, 12), box((-0.16, -0.16, 0.0), (0.16, 0.16, 0.02))]
    head = [box((0.06, -0.15, 2.55), (0.26, 0.15, 3.45))]
    heights = {"Red": 3.30, "Amber": 3.00, "Green": 2.70}
    head += [_hood(z) for z in heights.values()]
    lenses = [
        Part(
            name,
            moved(_disc(_outline("round", 0.20), 0.255, 0.268), (0.0, 0.0, z)),
            f"lens_{name.lower()}",
            "lens",
        )
        for name, z in heights.items()
    ]
    brackets = [
        tube(np.array([[0.0, 0.0, z], [0.08, 0.0, z]]), np.full(2, 0.025), 8) for z in (2.65, 3.35)
    ]
    parts = (
        Part("Post", merge([*parts_metal, *brackets]), "metal_galvanised", "post"),
        Part("Head", merge(head), "paint_black", "signal_head"),
        *lenses,
    )
    return Model(parts)


def _hood(z: float) -> Mesh:
    """A half tube over a lens, 0.14 m deep: outer side, front edge, inner side."""
    angle = np.linspace(np.pi * 0.05, np.pi * 0.95, 9)
    arc = np.stack([np.zeros(9), np.cos(angle), np.sin(angle)], axis=1)
    lines = [(0.26, 0.120), (0.40, 0.120), (0.40, 0.112), (0.26, 0.112)]
    rings = np.stack([arc * radius + np.array([x, 0.0, z]) for x, radius in lines])
    ring, k = np.meshgrid(np.arange(3), np.arange(8), indexing="ij")
    quads = np.stack(
        [ring * 9 + k, ring * 9 + k + 1, (ring + 1) * 9 + k + 1, (ring + 1) * 9 + k], -1
    )
    return flat(rings.reshape(-1, 3), np.full(24, 4), quads.reshape(-1))
