"""Tags that tell something of each lane (wiki.openstreetmap.org/wiki/Lanes)."""

import re
from collections.abc import Mapping

from envgen_usd.models.street_plan import StreetLane, StreetProfile

Tags = Mapping[str, str]
LANE_WIDTHS = (2.0, 5.5)
"""Least and largest plausible width of a lane, metres."""
_WIDTH = re.compile(r"\s*([0-9]{1,2}(?:[.,][0-9]{1,3})?)\s*m?\s*$")
_TURNS: Mapping[str, str] = {
    "left": "left",
    "slight_left": "left",
    "sharp_left": "left",
    "right": "right",
    "slight_right": "right",
    "sharp_right": "right",
    "through": "through",
}
_CHANGES: Mapping[str, frozenset[str]] = {
    "yes": frozenset(),
    "no": frozenset({"left", "right"}),
    "not_left": frozenset({"left"}),
    "only_right": frozenset({"left"}),
    "not_right": frozenset({"right"}),
    "only_left": frozenset({"right"}),
}
"""Sides to which traffic may not change, by the value of ``change:lanes``."""
_PLACEMENT = re.compile(r"(left|right|middle)_of:(-?[0-9]{1,2})$")
_BEFORE: Mapping[str, float] = {"left": 1.0, "middle": 0.5, "right": 0.0}
"""Lanes by which a place lies further left than the right border of its lane."""


def driving_lanes(  # noqa: PLR0913, PLR0917 - what lanes follow from
    tags: Tags, direction: str, count: int, width: float, plain: bool, faults: list[str]
) -> list[StreetLane]:
    """Driving lanes of a direction, from the middle outwards.

    Tags list lanes from left to right as seen by the traffic, so lists of both directions begin in
    the middle.

    Args:
        tags: Tags of the way.
        direction: ``forward`` or ``backward``.
        count: Number of lanes.
        width: Width of lanes without one of their own, metres.
        plain: True where keys without a direction mean this one.
        faults: Gets the keys whose values do not fit.
    """
    turns = [
        frozenset(_TURNS[word] for word in value.split(";") if word in _TURNS)
        for value in _listed(tags, "turn:lanes", direction, count, plain, [])
    ]
    usual = tags.get("change", "yes")
    changes = _listed(tags, "change:lanes", direction, count, plain, faults)
    kept = [_CHANGES.get(value or usual, frozenset()) for value in changes]
    widths = _listed(tags, "width:lanes", direction, count, plain, faults)
    own = [_width(value, width, faults) for value in widths]
    return [
        StreetLane("driving", size, turn, stays=stay)
        for size, turn, stay in zip(own, turns, kept, strict=True)
    ]


def _listed(  # noqa: PLR0913, PLR0917 - where a list may stand
    tags: Tags, key: str, direction: str, count: int, plain: bool, faults: list[str]
) -> list[str]:
    """The value of each lane; empty texts where the list is missing or has another length."""
    name = f"{key}:{direction}"
    if name not in tags and plain:
        name = key
    values = [value.strip() for value in tags.get(name, "").split("|")]
    if len(values) == count:
        return values
    if tags.get(name):
        faults.append(name)
    return [""] * count


def _width(value: str, usual: float, faults: list[str]) -> float:
    found = _WIDTH.match(value)
    size = float(found[1].replace(",", ".")) if found else 0.0
    if LANE_WIDTHS[0] <= size <= LANE_WIDTHS[1]:
        return size
    if value:
        faults.append("width:lanes")
    return usual


def has_markings(tags: Tags) -> bool | None:
    """Whether lines part the lanes; `None` where the tags do not say so."""
    return {"no": False, "yes": True}.get(tags.get("lane_markings", ""))


def placed_line(
    tags: Tags, way: int, counts: tuple[int, int], faults: list[str]
) -> tuple[str, float] | None:
    """Where the way's line lies by ``placement``, see `StreetProfile.line`.

    Args:
        tags: Tags of the way.
        way: As `street_tags.is_one_way`.
        counts: Lanes along the way and against it.
        faults: Gets keys with values that name no lane.
    """
    directions = (("forward", "right", counts[0]), ("backward", "left", counts[1]))
    for direction, side, count in directions:
        plain = way == (1 if direction == "forward" else -1)
        keys = (f"placement:{direction}", *(("placement",) if plain else ()))
        key = next((each for each in keys if each in tags), "")
        if not key or not count:
            continue
        if tags[key] == "transition":
            return StreetProfile.TRANSITION
        found = _PLACEMENT.match(tags[key])
        number = int(found[2]) if found else 0
        # The image of a map with traffic on the left counts from the other side.
        number = count + 1 + number if number < 0 else number
        if found and 1 <= number <= count:
            return side, number - _BEFORE[found[1]]
        faults.append(key)
    return None
