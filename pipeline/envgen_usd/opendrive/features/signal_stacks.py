"""Stacks signals on a shared post, so that their faces do not overlap."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from envgen_usd.models.road_feature import SignalFeature

SAME_POST = 0.3
"""Largest distance in plan in metres of signals on the same post."""
_GAP = 0.05
"""Metres between stacked faces; a larger value raises the upper face."""


def stack(signs: Sequence[SignalFeature]) -> list[SignalFeature]:
    """Raises signals that overlap the face of a lower signal on the same post."""
    stacked: dict[str, SignalFeature] = {}
    for sign in sorted(signs, key=_lower_edge):
        below = [each for each in stacked.values() if _share(sign, each)]
        lower, height = sign.face.lower_edge, sign.face.height
        # The order from below ensures that each overlapping signal raises this signal once.
        for other in sorted(below, key=_lower_edge):
            upper = other.face.lower_edge + other.face.height
            if lower < upper and other.face.lower_edge < lower + height:
                lower = upper + _GAP
        stacked[sign.id] = _raised(sign, lower)
    return [stacked[sign.id] for sign in signs]


def _lower_edge(sign: SignalFeature) -> float:
    return sign.face.lower_edge


def _share(a: SignalFeature, b: SignalFeature) -> bool:
    looks = np.cos(a.pose.heading - b.pose.heading) > 0
    distance = np.hypot(*(a.pose.position - b.pose.position)[:2])
    return bool(looks and distance < SAME_POST)


def _raised(sign: SignalFeature, lower: float) -> SignalFeature:
    if lower == sign.face.lower_edge:
        return sign
    size = (*sign.size[:2], lower + sign.face.height)
    return replace(sign, face=replace(sign.face, lower_edge=round(lower, 3)), size=size)
