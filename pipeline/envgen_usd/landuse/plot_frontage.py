"""The street side of a plot, and its street."""

import numpy as np
from scipy.spatial import cKDTree

from envgen_usd.geometry.road_outline import Outline
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.road_surface import RoadSurface

SHORTEST = 2.0
"""Least length of a street side, metres; a larger value excludes more sides."""
CROSSED = 2
"""Border steps on a way by which it crosses a side: the narrowest way is as wide as two cells."""
APART = 2.0
"""Distance of border steps from which they belong to different ways, metres."""
SPACING = 2.0
REACH = 1.5
"""Largest distance of border steps from their side, metres; a larger value assigns more steps."""


def street_side(polygon: FloatArray, access: FloatArray, outline: Outline) -> FloatArray:
    """Returns the side of a plot that faces the street, 2 x 2.

    Args:
        polygon: N x 2, counter-clockwise, metres.
        access: M x 2, points at which paved ways cross the plot's border. Of the sides that a way
            crosses the one that is nearest to a road faces the street: ways of other plots may run
            along another side. Without ways, the nearest road decides.
        outline: Outline of the road.
    """
    sides = np.stack([polygon, np.roll(polygon, -1, axis=0)], axis=1)
    lengths = np.linalg.norm(sides[:, 1] - sides[:, 0], axis=1)
    sides = sides[lengths >= min(SHORTEST, lengths.max())]
    distance, _ = outline.nearest(sides.mean(axis=1))
    if len(access):
        votes = np.bincount(np.argmin(_distances(access, sides), axis=1), minlength=len(sides))
        distance = np.where(votes >= min(CROSSED, votes.max()), distance, np.inf)
    frontage: FloatArray = sides[np.argmin(distance)]
    return frontage


def crossing(access: FloatArray, frontage: FloatArray) -> FloatArray | None:
    """Returns the middle of the widest paved way across a plot's frontage, 2, or `None`.

    Args:
        access: M x 2, points at which paved ways cross the plot's border, metres.
        frontage: 2 x 2, the street side.
    """
    on_side = access[_distances(access, frontage[None])[:, 0] < REACH] if len(access) else access
    if not len(on_side):
        return None
    along = frontage[1] - frontage[0]
    shares = np.sort(np.clip((on_side - frontage[0]) @ along / (along @ along), 0.0, 1.0))
    apart = np.flatnonzero(np.diff(shares) * np.hypot(*along) > APART) + 1
    widest = max(np.split(shares, apart), key=np.ptp)
    middle: FloatArray = frontage[0] + widest.mean() * along
    return middle


def _distances(points: FloatArray, sides: FloatArray) -> FloatArray:
    """Distances of points (M x 2) from sides (N x 2 x 2), M x N."""
    along = sides[:, 1] - sides[:, 0]
    offset = points[:, None] - sides[:, 0]
    share = np.einsum("mnc,nc->mn", offset, along) / np.sum(along**2, axis=1)
    rest = offset - np.clip(share, 0.0, 1.0)[..., None] * along
    distances: FloatArray = np.linalg.norm(rest, axis=2)
    return distances


class RoadBorders:
    """Finds the side of the road at whose border a place lies."""

    def __init__(self, surface: RoadSurface) -> None:
        """Samples both borders of all roads outside junctions."""
        roads = [line for line in surface.roads if not line.junction] or list(surface.roads)
        parts = [
            ((line.road, side), _dense(border))
            for line in roads
            for side, border in (("left", line.left_border()), ("right", line.right_border()))
        ]
        self._sides = [side for side, part in parts for _ in part]
        self._tree = cKDTree(np.concatenate([part for _, part in parts])) if parts else None

    def side_at(self, place: FloatArray) -> tuple[str, str]:
        """The nearest side of a road outside junctions.

        Returns:
            OpenDRIVE id of the road, and ``left`` or ``right`` as s increases; both are empty
            without a road.
        """
        if self._tree is None:
            return "", ""
        return self._sides[int(self._tree.query(place)[1])]


def _dense(line: FloatArray) -> FloatArray:
    """Points along a polyline (N x 2), at most `SPACING` apart."""
    length = np.hypot(*np.diff(line, axis=0).T)
    along = np.concatenate([[0.0], np.cumsum(length)])
    stops = np.linspace(0.0, along[-1], int(along[-1] / SPACING) + 2)
    return np.stack([np.interp(stops, along, column) for column in line.T], axis=1)
