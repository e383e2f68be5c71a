"""Whether a network can be sampled at all: hostile figures ask for a billion samples."""

from collections.abc import Iterator, Sequence

import numpy as np

from envgen_usd.models.arrays import FloatArray
from envgen_usd.models.cubics import Cubics
from envgen_usd.models.road import Road
from envgen_usd.models.road_marks import RoadMark
from envgen_usd.opendrive.checks.index import Index
from envgen_usd.opendrive.checks.joined import Joined
from envgen_usd.opendrive.findings import Hostile
from envgen_usd.opendrive.plan_view import bend

MOST_SAMPLES = 100_000
"""Samples that one curve may take."""
MOST_DASHES = 1_000_000
"""Dashes that one mark may take."""
_TOLERANCE = 0.02


def refuse_endless(roads: Sequence[Road], joined: Joined, index: Index) -> None:
    """Refuses figures that no road has.

    Raises:
        Hostile: A curve would take more than `MOST_SAMPLES`, or a mark more than `MOST_DASHES`.
    """
    view = joined.plan_view
    places = view.s[:, None] + view.length[:, None] * (0.0, 0.5, 1.0)
    steepest = bend(view, places.ravel()).reshape(-1, 3).max(axis=1)
    samples = _samples(steepest, view.length)
    worst = int(samples.argmax())
    if samples[worst] > MOST_SAMPLES:
        element = index.geometry(roads[joined.road[worst]].id, int(joined.number[worst]))
        raise Hostile(element, f"a curve that takes {samples[worst]:.3g} samples")
    for road in roads:
        _refuse_profiles(road, index)


def _refuse_profiles(road: Road, index: Index) -> None:
    for what, cubics, length in _profiles(road):
        if _most(cubics, length) > MOST_SAMPLES:
            raise Hostile(index.roads[road.id], f"{what} that bends beyond any road's")
    for section in road.sections:
        length = section.end - section.s
        for lane in (*section.left, section.centre, *section.right):
            dashes = max((_dashes(mark, length) for mark in lane.marks), default=0.0)
            if dashes > MOST_DASHES:
                raise Hostile(index.roads[road.id], f"a road mark of {dashes:.3g} dashes")


def _profiles(road: Road) -> Iterator[tuple[str, Cubics, float]]:
    yield "elevation", road.elevation, road.length
    yield "superelevation", road.superelevation, road.length
    yield "a laneOffset", road.lane_offset, road.length
    for section in road.sections:
        length = section.end - section.s
        for lane in (*section.left, *section.right):
            yield f"lane {lane.id}", lane.width, length
            if len(lane.border.start):
                yield f"lane {lane.id}", lane.border, length


def _most(cubics: Cubics, length: float) -> float:
    """Samples that the most curved piece within 0 to the length takes."""
    if not cubics.coefficients[:, 2:].any():
        return 0.0
    extent = np.diff(np.append(cubics.start, length)).clip(0.0, length)
    c, d = cubics.coefficients[:, 2:].T
    steepest = 2 * np.maximum(np.abs(c), np.abs(c + 3 * d * extent))
    return float(_samples(steepest, extent).max())


def _samples(second_derivative: FloatArray, length: FloatArray) -> FloatArray:
    samples: FloatArray = length * np.sqrt(second_derivative / (8 * _TOLERANCE))
    return samples


def _dashes(mark: RoadMark, length: float) -> float:
    periods = [line.length + line.space for line in mark.lines if line.space > 0]
    return length / min(periods) if periods else 0.0
