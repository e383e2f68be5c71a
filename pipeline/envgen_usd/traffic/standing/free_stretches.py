"""Stretches of a kerb or parking lane where vehicles may stand.

A row is packed into them, so that vehicles close up to a crossing or a post as they do in streets.
Each chunk packs what lies in it: what stands beyond its border belongs to another chunk.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from envgen_usd.chunks import Chunk, tiles_of
from envgen_usd.geometry.flat_arrays import true_runs
from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.models.frozen_model import Model
from envgen_usd.traffic.standing.kerb_lines import KerbLine, ends_at_junctions
from envgen_usd.traffic.standing.street_facts import StreetFacts

_JUNCTION = 5.0
"""Metres before and behind a junction that stay free (StVO, section 12)."""
_STEP = 0.25
"""Metres between the places along a line whose chunk is looked up."""
_AROUND = 0.15
"""Metres before and behind an object that stay free."""


@dataclass(frozen=True, repr=False, eq=False)
class KeptClear(Model):
    """Places beside which kerbs stay free.

    Attributes:
        points: N x 2, metres.
        reach: Distance from a kerb within which a place matters, metres.
        before: Metres in front of it, in the direction of travel.
        after: Metres behind it.
    """

    points: FloatArray
    reach: float
    before: float
    after: float


@dataclass(frozen=True)
class Roadside:
    """What decides where vehicles may stand beside the roads of a chunk.

    Attributes:
        chunk: The tile.
        facts: The map.
        places: Places that stay free.
        obstacles: What stands in the chunk, in plan.
    """

    chunk: Chunk
    facts: StreetFacts
    places: Sequence[KeptClear]
    obstacles: Sequence[shapely.Geometry]

    def free(self, line: KerbLine, middle: float, outer: float) -> FloatArray:
        """Returns the free stretches of a line, K x 2, ascending arc lengths, metres.

        Args:
            line: The line.
            middle: Metres from the line outwards to the middle of vehicles.
            outer: Metres from the line outwards to their flank; objects up to there are in the way.
        """
        taken = [
            _elsewhere(line, middle, self.chunk),
            _ends(line, self.facts),
            *(_beside(line, place) for place in self.places),
            *(self._occupied(line, outer) if outer > 0.0 else ()),
        ]
        return _complement(np.concatenate(taken), float(line.s[-1]))

    def _occupied(self, line: KerbLine, outer: float) -> list[FloatArray]:
        """Stretches with objects between a line and the outer flank of vehicles."""
        shape = shapely.LineString(line.points[:, :2])
        band = shapely.buffer(shape, line.outward * outer, single_sided=True)
        rows = shapely.STRtree(self.obstacles).query(band, predicate="intersects")
        found = []
        for row in np.sort(rows).tolist():
            part = shapely.intersection(self.obstacles[row], band)
            at = shapely.line_locate_point(shape, shapely.points(shapely.get_coordinates(part)))
            if len(at):
                found.append(np.array([[at.min() - _AROUND, at.max() + _AROUND]]))
        return found


def _beside(line: KerbLine, place: KeptClear) -> FloatArray:
    shape = shapely.LineString(line.points[:, :2])
    points = shapely.points(place.points)
    at = shapely.line_locate_point(shape, points[shapely.dwithin(points, shape, place.reach)])
    return np.column_stack([at - place.before, at + place.after])


def _ends(line: KerbLine, facts: StreetFacts) -> FloatArray:
    first, last = ends_at_junctions(line.lane, facts)
    length = float(line.s[-1])
    before, after = _JUNCTION if first else 0.0, _JUNCTION if last else 0.0
    return np.array([[-np.inf, before], [length - after, np.inf]])


def _elsewhere(line: KerbLine, middle: float, chunk: Chunk) -> FloatArray:
    """Stretches where the middle of vehicles lies in other chunks."""
    s = np.arange(0.0, line.s[-1] + _STEP, _STEP)
    points, along = line.at(s)
    normal = line.outward * np.column_stack([-np.sin(along), np.cos(along)])
    outside = (tiles_of(points[:, :2] + middle * normal) != (chunk.x, chunk.y)).any(axis=1)
    first, after = true_runs(outside)
    return np.column_stack([s[first] - _STEP / 2, s[after - 1] + _STEP / 2])


def _complement(taken: FloatArray, length: float) -> FloatArray:
    """Gaps between stretches (K x 2, in any order, overlapping) within 0 and a length."""
    taken = taken[np.argsort(taken[:, 0], kind="stable")]
    reached = np.maximum.accumulate(np.concatenate([[0.0], taken[:, 1]]))
    starts, ends = reached, np.append(taken[:, 0], length)
    gaps = np.column_stack([starts, np.minimum(ends, length)])
    free: FloatArray = gaps[gaps[:, 1] > gaps[:, 0]]
    return free


def packed(lengths: FloatArray, gaps: FloatArray, free: FloatArray) -> tuple[IntArray, FloatArray]:
    """Packs places into free stretches, one after the other.

    Args:
        lengths: N, length of each place, metres.
        gaps: N, metres behind each place.
        free: K x 2, stretches.

    Returns:
        The places that fit (M, ascending), and where they start (M, metres).
    """
    rows, starts, first = [np.empty(0, dtype=np.int64)], [np.empty(0)], 0
    for low, high in free.tolist():
        ends = np.cumsum(lengths[first:] + gaps[first:]) - gaps[first:]
        count = int(np.searchsorted(ends, high - low + 1e-9, side="right"))
        rows.append(np.arange(first, first + count))
        starts.append(low + ends[:count] - lengths[first : first + count])
        first += count
    return np.concatenate(rows), np.concatenate(starts)
