"""Traffic signs and traffic lights; they face +x."""

from dataclasses import dataclass

import numpy as np

from envgen_usd.assets.asset_design import Model, Part
from envgen_usd.assets.polygon_mesh import Mesh, merge
from envgen_usd.assets.shapes.simple_solids import box, flat, moved, post, tube
from envgen_usd.models.array_types import FloatArray

_SIGN = "traffic_sign"
_LIGHT = "traffic_light"
"""Class of the sign faces and lamps; their posts are poles."""
LOWER_EDGE = 2.0
"""Height of a plate's lower edge, metres; a larger value raises signs."""


@dataclass(frozen=True)
class Plate:
    """Shape of a sign: a regular polygon, scaled to its size.

    Attributes:
        corners: Number of corners.
        start: Angle of the first corner, radians from the horizontal.
        size: Width and height in metres.
        inner: Share of the size inside the border.
    """

    corners: int
    start: float
    size: tuple[float, float]
    inner: float


PLATES = {
    "round": Plate(24, 0.0, (0.6, 0.6), 0.74),
    "triangle": Plate(3, np.pi / 2, (0.9, 0.79), 0.70),
    "inverted_triangle": Plate(3, -np.pi / 2, (0.9, 0.79), 0.70),
    "octagon": Plate(8, np.pi / 8, (0.9, 0.9), 0.92),
    "diamond": Plate(4, 0.0, (0.84, 0.84), 0.80),
    "square": Plate(4, np.pi / 4, (0.6, 0.6), 0.92),
    "rectangle": Plate(4, np.pi / 4, (0.6, 0.9), 0.92),
}
"""Shapes and sizes for moderate speed (German VwV-StVO, size 2), metres."""


def _outline(plate: Plate) -> FloatArray:
    """Corners (y, z), N x 2, counter-clockwise, about the centre of their box."""
    angle = plate.start + np.arange(plate.corners) * 2 * np.pi / plate.corners
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    low, high = ring.min(axis=0), ring.max(axis=0)
    outline: FloatArray = (ring - (low + high) / 2) / (high - low) * np.array(plate.size)
    return outline


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
        shape: Key of `PLATES`.
        border: Material of the plate's edge.
        face: Material of its centre.
    """
    plate_form = PLATES[shape]
    outline = _outline(plate_form)
    inner = outline - _centroid(outline)
    inner = inner * plate_form.inner + _centroid(outline)
    lift = (0.0, 0.0, LOWER_EDGE + plate_form.size[1] / 2)
    top = LOWER_EDGE + plate_form.size[1]
    plate = moved(_disc(outline, 0.036, 0.040), lift)
    back = moved(_disc(outline, 0.030, 0.036), lift)
    parts = (
        Part("Post", post(top - 0.02, 0.030, 10), "metal_galvanised", "post"),
        Part("Back", back, "metal_galvanised", "sign_back", of_class=_SIGN),
        Part("Border", plate, border, "sign_face", of_class=_SIGN),
        Part("Face", moved(_disc(inner, 0.040, 0.042), lift), face, "sign_face", of_class=_SIGN),
    )
    return Model(parts)


def _centroid(outline: FloatArray) -> FloatArray:
    middle: FloatArray = outline.mean(axis=0)
    return middle


def traffic_light() -> Model:
    """A post with a head of three lenses under hoods."""
    parts_metal = [post(3.55, 0.055, 12), box((-0.16, -0.16, 0.0), (0.16, 0.16, 0.02))]
    head = [box((0.06, -0.15, 2.55), (0.26, 0.15, 3.45))]
    heights = {"Red": 3.30, "Amber": 3.00, "Green": 2.70}
    head += [_hood(z) for z in heights.values()]
    lenses = [
        Part(
            name,
            moved(_disc(_outline(Plate(24, 0.0, (0.2, 0.2), 1.0)), 0.255, 0.268), (0.0, 0.0, z)),
            f"lens_{name.lower()}",
            "lens",
            of_class=_LIGHT,
        )
        for name, z in heights.items()
    ]
    brackets = [
        tube(np.array([[0.0, 0.0, z], [0.08, 0.0, z]]), np.full(2, 0.025), 8) for z in (2.65, 3.35)
    ]
    parts = (
        Part("Post", merge([*parts_metal, *brackets]), "metal_galvanised", "post"),
        Part("Head", merge(head), "paint_black", "signal_head", of_class=_LIGHT),
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
