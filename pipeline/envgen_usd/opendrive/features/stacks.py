"""Signals on one post: faces that would lie in one another go above each other."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from envgen_usd.models.city import CityObject

SAME_POST = 0.3
"""Metres in plan within which signals share a post."""
_GAP = 0.05


def stack(signs: Sequence[CityObject]) -> list[CityObject]:
    """Raises signals whose faces overlap that of a lower one on the same post.

    Args:
        signs: Features of signals, with their placements and the attributes of their faces.
    """
    stacked: dict[str, CityObject] = {}
    for sign in sorted(signs, key=lambda each: float(each.attributes["face_lower_edge"])):
        below = [each for each in stacked.values() if _share(sign, each)]
        lower, height = _face(sign)
        # From the lowest upwards, so that each one that is in the way lifts it once.
        for other in sorted(below, key=lambda each: _face(each)[0]):
            other_lower, other_height = _face(other)
            if lower < other_lower + other_height and other_lower < lower + height:
                lower = other_lower + other_height + _GAP
        stacked[sign.id] = _raised(sign, lower)
    return [stacked[sign.id] for sign in signs]


def _face(sign: CityObject) -> tuple[float, float]:
    """Lower edge and height of a signal's face, metres."""
    return float(sign.attributes["face_lower_edge"]), float(sign.attributes["face_height"])


def _share(a: CityObject, b: CityObject) -> bool:
    if a.placement is None or b.placement is None:
        return False
    looks = np.cos(a.placement.heading - b.placement.heading) > 0
    distance = np.hypot(*(a.placement.position - b.placement.position)[:2])
    return bool(looks and distance < SAME_POST)


def _raised(sign: CityObject, lower: float) -> CityObject:
    before, height = _face(sign)
    if lower == before or sign.placement is None:
        return sign
    size = np.array([*sign.placement.size[:2], lower + height])
    attributes = {**sign.attributes, "face_lower_edge": round(lower, 3)}
    return replace(sign, attributes=attributes, placement=replace(sign.placement, size=size))
