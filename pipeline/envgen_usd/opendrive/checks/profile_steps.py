"""Checks elevation and lane offset for steps (10.4, 11.4)."""

from collections.abc import Iterator, Sequence

import numpy as np

from envgen_usd.models.cubics import Cubics
from envgen_usd.models.road import Road
from envgen_usd.opendrive.checks.element_index import Index
from envgen_usd.opendrive.document.findings import Findings

STEP = 0.01
"""Least step in metres that is reported; a larger value reports less."""
_PLACES = (
    ("elevation", "elevationProfile/elevation"),
    ("lane_offset", "lanes/laneOffset"),
)


def check_profiles(roads: Sequence[Road], index: Index, findings: Findings) -> None:
    """Reports steps in the elevation and in the lane offset."""
    for name, path in _PLACES:
        owned = [(road, getattr(road, name)) for road in roads]
        pieced = [(road, cubics) for road, cubics in owned if len(cubics.start) > 1]
        if pieced:
            for place, s, step in _steps([(cubics, road.length) for road, cubics in pieced]):
                road = pieced[place][0]
                elements = index.roads[road.id].iterfind(path)
                element = next(each for each in elements if float(each.get("s", "0")) == s)
                findings.noted(f"{name}.step", element, f"a step of {step:.3f} m at s={s:g}")


def _steps(profiles: Sequence[tuple[Cubics, float]]) -> Iterator[tuple[int, float, float]]:
    """Yields index of the profile, position and height of each step within the road, metres.

    Args:
        profiles: At least one cubic with its road's length in metres.
    """
    counts = [len(cubics.start) for cubics, _ in profiles]
    owner = np.repeat(np.arange(len(profiles)), counts)
    length = np.repeat([length for _, length in profiles], counts)
    start = np.concatenate([cubics.start for cubics, _ in profiles])
    table = np.concatenate([cubics.coefficients for cubics, _ in profiles])
    ds = np.diff(start)
    a, b, c, d = table[:-1].T
    step = table[1:, 0] - (a + ds * (b + ds * (c + ds * d)))
    inside = (owner[1:] == owner[:-1]) & (ds > 0) & (start[1:] < length[1:])
    for place in (np.flatnonzero(inside & (np.abs(step) > STEP)) + 1).tolist():
        yield int(owner[place]), float(start[place]), float(step[place - 1])
