"""Cards that show twigs, with or without leaves, and the few large ones of a distant crown."""

from dataclasses import dataclass

import numpy as np
from scipy.cluster.vq import kmeans2

from envgen_usd.assets.polygon_mesh import Mesh, normalised
from envgen_usd.models.array_types import FloatArray, IntArray

_MARGIN = 0.006
"""Strip along the border of a tile that cards leave out, as a share of the tile's side."""


@dataclass(frozen=True)
class Tiles:
    """A row of an atlas.

    Attributes:
        row: Its number from below.
        across: Tiles along each side of the atlas; the last of a row is a piece of a crown.
    """

    row: int
    across: int

    def uv(self, columns: IntArray) -> FloatArray:
        """Texture coordinates of the corners of tiles: N x 4 x 2, from below left."""
        corners = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
        inner = _MARGIN + (1 - 2 * _MARGIN) * corners
        place = np.stack([columns, np.full_like(columns, self.row)], axis=1)
        uv: FloatArray = (place[:, None] + inner) / self.across
        return uv


@dataclass(frozen=True)
class Shoots:
    """N twigs that become cards.

    Attributes:
        feet: N x 3, metres.
        headings: N x 3, unit vectors along the twigs.
        lengths: N, metres.
    """

    feet: FloatArray
    headings: FloatArray
    lengths: FloatArray

    def middles(self) -> FloatArray:
        """N x 3, metres."""
        return self.feet + 0.5 * self.lengths[:, None] * self.headings


def cards(
    shoots: Shoots, tiles: Tiles, breadth: float, middle: FloatArray, rng: np.random.Generator
) -> Mesh:
    """A card for each shoot, turned at random around it.

    Args:
        shoots: Twigs.
        tiles: Row of the atlas.
        breadth: Width of a card as a share of its length.
        middle: 3, point that the normals lead away from, so that the crown is shaded as a body.
        rng: Random generator.
    """
    count = len(shoots.feet)
    side = normalised(np.cross(shoots.headings, rng.normal(size=(count, 3))))
    half = 0.5 * breadth * shoots.lengths[:, None] * side
    top = shoots.feet + shoots.lengths[:, None] * shoots.headings
    corners = np.stack([shoots.feet - half, shoots.feet + half, top + half, top - half], axis=1)
    columns = rng.integers(0, tiles.across - 1, count)
    return _quads(corners, tiles.uv(columns), middle)


def distant_cards(
    shoots: Shoots, tiles: Tiles, count: int, middle: FloatArray, rng: np.random.Generator
) -> Mesh:
    """Upright cards that show pieces of the crown, each in place of many shoots.

    Args:
        shoots: Twigs of the whole crown.
        tiles: Row of the atlas.
        count: Number of cards.
        middle: As of `cards`.
        rng: Random generator.
    """
    places = shoots.middles()
    centres, group = kmeans2(places, count, minit="++", rng=rng)
    spread = np.array([_spread(places[group == number]) for number in range(count)])
    half = spread + 0.45 * shoots.lengths.mean()
    bearing = 2.399963 * np.arange(count) + rng.normal(0, 0.3, count)
    side = np.stack([np.cos(bearing), np.sin(bearing), rng.normal(0, 0.15, count)], axis=1)
    up = np.stack([rng.normal(0, 0.25, count), rng.normal(0, 0.25, count), np.ones(count)], axis=1)
    side = normalised(side) * half[:, :1]
    up = normalised(up) * half[:, 1:]
    corners = np.stack(
        [centres - side - up, centres + side - up, centres + side + up, centres - side + up], axis=1
    )
    return _quads(corners, tiles.uv(np.full(count, tiles.across - 1)), middle)


def _spread(places: FloatArray) -> FloatArray:
    """Half of the extent of places (N x 3), across and upright (2)."""
    if len(places) < 2:
        return np.full(2, 0.2)
    deviation = places.std(axis=0)
    return 1.45 * np.array([np.hypot(deviation[0], deviation[1]), deviation[2]])


def _quads(corners: FloatArray, uv: FloatArray, middle: FloatArray) -> Mesh:
    """Cards from corners and texture coordinates, N x 4 x 3 and N x 4 x 2."""
    count = len(corners)
    centres = corners.mean(axis=1)
    corners = np.maximum(corners, [-np.inf, -np.inf, 0.0])  # nothing reaches below the ground
    outward = normalised(centres - middle) + np.array([0.0, 0.0, 0.2])
    # The side on which the front is seen is the one that the normals light.
    front = np.cross(corners[:, 1] - corners[:, 0], corners[:, 3] - corners[:, 0])
    inward = (front * outward).sum(axis=1) < 0.0
    corners = np.where(inward[:, None, None], corners[:, [1, 0, 3, 2]], corners)
    bend = normalised(corners - centres[:, None]) * 0.35
    normals = normalised(outward[:, None] + bend)
    return Mesh(
        corners.reshape(-1, 3),
        np.full(count, 4),
        np.arange(4 * count),
        normals.reshape(-1, 3),
        uv.reshape(-1, 2),
    )
