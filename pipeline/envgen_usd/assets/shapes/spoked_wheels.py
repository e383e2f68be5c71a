"""Wheels with tyre, rim, hub and spokes; their axle runs along y."""

import numpy as np

from envgen_usd.assets.polygon_mesh import Mesh, merge, vertex_normals
from envgen_usd.assets.shapes.simple_solids import tube
from envgen_usd.models.array_types import FloatArray


def hoop(
    middle: FloatArray,
    radius: float,
    profile: FloatArray,
    segments: int,
    left: FloatArray | None = None,
) -> Mesh:
    """A closed ring of revolution about an axis.

    Args:
        middle: 3, metres.
        radius: Of the circle to which the profile refers, metres.
        profile: P x 2, outward and sideward distance of the corners of its section from that
            circle, counter-clockwise with outwards to the right, metres.
        segments: Number of sections.
        left: Unit vector of the axis; y by default.
    """
    axis = np.array([0.0, 1.0, 0.0]) if left is None else left
    first = np.cross(axis, [0.0, 0.0, 1.0])
    first = first / np.linalg.norm(first)
    second = np.cross(first, axis)
    angle = np.linspace(0.0, 2.0 * np.pi, segments, endpoint=False)
    spokes = np.cos(angle)[:, None] * first + np.sin(angle)[:, None] * second
    rings = (
        middle
        + (radius + profile[:, 0])[None, :, None] * spokes[:, None]
        + profile[:, 1][None, :, None] * axis
    )
    count = len(profile)
    ring, side = np.meshgrid(np.arange(segments), np.arange(count), indexing="ij")
    beyond, beside = (ring + 1) % segments, (side + 1) % count
    quads = np.stack(
        [
            ring * count + side,
            ring * count + beside,
            beyond * count + beside,
            beyond * count + side,
        ],
        axis=2,
    ).reshape(-1)
    points, sizes = rings.reshape(-1, 3), np.full(segments * count, 4)
    normals = vertex_normals(points, sizes, quads)
    if (normals[0] @ (points[0] - middle - radius * spokes[0])) < 0.0:
        quads = quads.reshape(-1, 4)[:, ::-1].reshape(-1)
        normals = -normals
    return Mesh(points, sizes, quads, normals[quads], np.zeros((len(quads), 2)))


def round_profile(radius: float, corners: int) -> FloatArray:
    """P x 2, the section of a round tyre."""
    angle = np.linspace(0.0, 2.0 * np.pi, corners, endpoint=False)
    return radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def spokes(  # noqa: PLR0913 - what a spoke is determined by
    middle: FloatArray, hub: float, rim: float, count: int, *, wide: float, thick: float = 0.0016,
) -> Mesh:  # fmt: skip
    """Spokes from a hub to a rim, by turns from both ends of the hub, as thin bars.

    Args:
        middle: 3, metres.
        hub: Radius of the hub, metres.
        rim: Radius of the rim, metres.
        count: Number of spokes.
        wide: Half the length of the hub, metres.
        thick: Radius of a spoke, metres.
    """
    bars = []
    for k in range(count):
        angle = 2.0 * np.pi * k / count
        out = np.array([np.cos(angle), 0.0, np.sin(angle)])
        # Spokes leave the hub beside the radius and cross their neighbours.
        aside = np.array([-out[2], 0.0, out[0]]) * (0.9 if k % 4 < 2 else -0.9)
        foot = middle + hub * aside + np.array([0.0, wide if k % 2 else -wide, 0.0])
        bars.append(tube(np.stack([foot, middle + rim * out]), np.full(2, thick), 3))
    return merge(bars)
