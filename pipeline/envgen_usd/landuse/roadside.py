"""The roadsides along which plots may lie."""

from dataclasses import dataclass

import numpy as np

from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.distribution import drawn
from envgen_usd.models.land_rules import PlotRules
from envgen_usd.models.road_surface import RoadLine, RoadSurface
from envgen_usd.seeds import generator

CLOSED_TYPES = frozenset({"pedestrian", "bicycle"})
"""Road types (OpenDRIVE e_roadType) without access to plots, besides motorways."""
STREET_LANES = frozenset({"driving", "bidirectional", "stop", "parking", "sidewalk", "walking"})
"""Lane types of a road with access to plots."""


@dataclass(frozen=True)
class Roadside:
    """A side of a road, as the line of the plots' fronts.

    The land lies to the left of the line.

    Attributes:
        road: OpenDRIVE road id.
        side: ``left`` or ``right`` in the direction of increasing s.
        open: True if plots may open onto the road.
        verge: Distance of the line from the road's border, metres.
        points: N x 2, metres, road frame.
        normals: N x 2, unit vectors from the road to the land.
        along: N, arc length along the line, metres, ascending.
    """

    road: str
    side: str
    open: bool
    verge: float
    points: FloatArray
    normals: FloatArray
    along: FloatArray

    @property
    def length(self) -> float:
        """Length of the line, metres."""
        return float(self.along[-1])

    def at(self, along: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Points and unit normals (each ... x 2) at arc lengths along the line, metres."""
        point, normal = (
            np.stack([np.interp(along, self.along, column) for column in values.T], axis=-1)
            for values in (self.points, self.normals)
        )
        return point, normal / np.linalg.norm(normal, axis=-1, keepdims=True)

    def verges(self) -> FloatArray:
        """The strip between the road's border and the line, N - 1 x 4 x 2."""
        border = self.points - self.verge * self.normals
        return np.stack([border[:-1], border[1:], self.points[1:], self.points[:-1]], axis=1)

    def fronts(self, start: FloatArray, end: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Straight fronts between positions along the line.

        No front is nearer to the road than the line.

        Args:
            start: F, arc length along the line, metres.
            end: F, arc length along the line, metres.

        Returns:
            F x 2 x 2, first and last point of each front; F x 2 x 2, the normals at both.
        """
        share = np.linspace(0.0, 1.0, 9)
        points, normals = self.at(start[:, None] + (end - start)[:, None] * share)
        chord = points[:, -1] - points[:, 0]
        outwards = np.stack([-chord[:, 1], chord[:, 0]], axis=1)
        outwards /= np.linalg.norm(outwards, axis=1, keepdims=True)
        bulge = np.einsum("fkc,fc->fk", points - points[:, :1], outwards).max(axis=1)
        ends = points[:, [0, -1]] + bulge[:, None, None] * outwards[:, None]
        return ends, normals[:, [0, -1]]


def find_roadsides(surface: RoadSurface, rules: PlotRules, seed: int) -> list[Roadside]:
    """Both sides of every road outside junctions, in the order of the file."""
    lanes: dict[str, set[str]] = {}
    for lane in surface.lanes:
        lanes.setdefault(lane.road, set()).add(lane.lane_type)
    sides = []
    for line in surface.roads:
        if line.junction or len(line.s) < 2:
            continue
        is_open = _is_open(line, lanes.get(line.road, set()))
        for side in ("left", "right"):
            draw = generator(seed, "landuse", "verge", line.road, side)
            roadside = _roadside(line, side, is_open, drawn(draw, rules.verge))
            if roadside.length > 0.0:
                sides.append(roadside)
    return sides


def _is_open(line: RoadLine, lane_types: set[str]) -> bool:
    if line.is_motorway or line.town in CLOSED_TYPES:
        return False
    return not lane_types or not STREET_LANES.isdisjoint(lane_types)


def _roadside(line: RoadLine, side: str, is_open: bool, verge: float) -> Roadside:
    normal = np.column_stack([-np.sin(line.heading), np.cos(line.heading)])
    if side == "left":
        border = line.left_border()
    else:
        border, normal = line.right_border()[::-1], -normal[::-1]
    points = border + verge * normal
    tangent = np.column_stack([normal[:, 1], -normal[:, 0]])
    # Inside a bend tighter than the verge the line would run backwards.
    forward = np.einsum("nc,nc->n", np.diff(points, axis=0), tangent[:-1] + tangent[1:]) / 2
    along = np.concatenate([[0.0], np.cumsum(np.maximum(forward, 0.0))])
    return Roadside(line.road, side, is_open, verge, points, normal, along)
