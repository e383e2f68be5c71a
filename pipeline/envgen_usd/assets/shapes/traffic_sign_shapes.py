"""Traffic signs with a plain face; they face +x."""

from dataclasses import dataclass

import numpy as np

from envgen_usd.assets.asset_design import Model, Part
from envgen_usd.assets.polygon_mesh import Mesh
from envgen_usd.assets.shapes.simple_solids import flat, moved, post
from envgen_usd.models.array_types import FloatArray

_SIGN = "traffic_sign"
"""Class of the sign faces; their posts are poles."""
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
