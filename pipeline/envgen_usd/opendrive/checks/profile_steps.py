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
        for road in roads:
            for s, step in _steps(getattr(road, name), road.length):
                elements = index.roads[road.id].iterfind(path)
                element = next(each for each in elements if float(each.get("s", "0")) == s)
                findings.noted(f"{name}.step", element, f"a step of {step:.3f} m at s={s:g}")


def _steps(cubics: Cubics, length: float) -> Iterator[tuple[float, float]]:
    """Yields position and height of each step within the road, metres."""
    if len(cubics.start) < 2:
        return
    ds = np.diff(cubics.start)
    a, b, c, d = cubics.coefficients[:-1].T
    step = cubics.coefficients[1:, 0] - (a + ds * (b + ds * (c + ds * d)))
    inside = (ds > 0) & (cubics.start[1:] < length)
    for place in np.flatnonzero(inside & (np.abs(step) > STEP)):
        yield float(cubics.start[place + 1]), float(step[place])
