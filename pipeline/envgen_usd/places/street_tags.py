"""The cross-section of a street by its tags (wiki.openstreetmap.org/wiki/Key:lanes and others)."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace

from envgen_usd.models.street_plan import StreetLane, StreetProfile
from envgen_usd.places.lane_tags import LANE_WIDTHS, driving_lanes, has_markings, placed_line
from envgen_usd.places.street_classes import (
    CLASSES,
    CYCLE_LANE,
    ONE_LANE_BOTH_WAYS,
    ONE_LANE_ONE_WAY,
    PARKING,
    WIDER,
    StreetClass,
)

Tags = Mapping[str, str]
MOST_LANES = 12
"""Largest plausible number of lanes of a carriageway."""
_NUMBER = re.compile(r"\s*([0-9]{1,6}(?:[.,][0-9]{1,6})?)\s*(?:m|)\s*(?:;.*)?$")
_SPEED = re.compile(r"\s*([0-9]{1,3})\s*(mph|km/h|kmh|)\s*$")
_MPH = 1.609
_YES = frozenset({"yes", "true", "1", "-1", "reverse"})
_LEAST_SIDEWALK, _MOST_SIDEWALK = 0.8, 8.0
_TELLING = ("lanes", "width", "parking", "turn", "cycleway", "placement", "lane_markings")
"""Beginnings of keys that tell the cross-section, so that nothing is assumed about parking."""
_BESIDE_PARKED = 1.5
"""Least sidewalk on both sides of a street that is wide enough for parked vehicles, metres."""
_FROM_WALL = 0.3
"""Distance of a sidewalk from the walls beside it, metres."""


@dataclass(frozen=True)
class Surroundings:
    """What decides about a street besides its tags.

    Attributes:
        town: True where buildings stand beside the street.
        twin: True where the other carriageway lies to its left.
        country: Country of the environment.
        free_left: Distance of the nearest wall on its left, metres.
        free_right: The same on its right.
    """

    town: bool = True
    twin: bool = False
    country: str = ""
    free_left: float = float("inf")
    free_right: float = float("inf")


@dataclass(frozen=True)
class ReadProfile:
    """A cross-section, and tags that it does not follow.

    Attributes:
        profile: The cross-section along the way.
        faults: Keys with values that are no plausible figures.
    """

    profile: StreetProfile
    faults: tuple[str, ...] = ()


def is_one_way(tags: Tags) -> int:
    """1 for traffic along the way only, -1 against it only, 0 for both."""
    said = tags.get("oneway", "")
    if said in {"-1", "reverse"}:
        return -1
    if said in _YES:
        return 1
    if said in {"no", "reversible", "alternating"}:
        return 0
    ring = tags.get("junction") in {"roundabout", "circular"}
    return int(ring or CLASSES[tags["highway"]].implied_one_way)


def read_profile(tags: Tags, around: Surroundings = Surroundings()) -> ReadProfile:
    """Cross-section of a street for motor vehicles.

    1. Lanes follow ``lanes``, ``lanes:forward``, ``lanes:backward`` and ``turn:lanes``, or the
       class.
    2. The width is that of ``width:lanes``, or ``width`` without what parks and cycles on it,
       shared by the lanes, or the class's.
    3. Cycle lanes, parking lanes and sidewalks follow their tags; sidewalks without tags follow the
       class and the surroundings.
    4. Where no tag tells the cross-section of a residential street between houses, vehicles park on
       one side of the carriageway: 4.5 m for both directions and 2 m for them are within the 4.5 to
       6.5 m of RASt 06 (6.1.1.2).

    Args:
        tags: Tags of the way; its ``highway`` is one of `CLASSES`.
        around: What decides besides.
    """
    kind, way = CLASSES[tags["highway"]], is_one_way(tags)
    faults: list[str] = []
    forward, backward, shared = _lane_counts(tags, kind, way, faults)
    beside = {side: _beside(tags, side, kind, around, way, faults) for side in ("left", "right")}
    if parked := _parked_side(tags, kind, way, around):
        beside[parked].insert(0, StreetLane("parking", PARKING["parallel"]))
        kind = replace(kind, lane_width=kind.parked_lane)
    on_road = sum(
        lane.width
        for lanes in beside.values()
        for lane in lanes
        if lane.kind == "parking" or (lane.kind == "biking" and not lane.raised)
    )
    width = _lane_width(tags, kind, (forward + backward, shared, on_road), around, faults)
    right = driving_lanes(tags, "forward", forward, width, way > 0, faults)
    left = driving_lanes(tags, "backward", backward, width, way < 0, faults)
    half = sum(lane.width for lane in (*right, *left)) / 2.0
    for side, free in (("left", around.free_left), ("right", around.free_right)):
        beside[side] = _before_walls(beside[side], free - half)
    marked = has_markings(tags)
    structure = next((name for name in ("bridge", "tunnel") if tags.get(name, "no") != "no"), "")
    profile = StreetProfile(
        tuple(left + beside["left"]),
        tuple(right + beside["right"]),
        shared,
        tags["highway"],
        kind.rank,
        _speed(tags, kind, around),
        _level(tags, structure),
        structure,
        (kind.lined or forward + backward > 2) if marked is None else marked,
        marked is not False,
        None if shared else placed_line(tags, way, (forward, backward), faults),
    )
    # A value that is no plausible figure says nothing, as if it were not there.
    told = {k: v for k, v in tags.items() if k not in faults or k.split(":")[0] not in _TELLING}
    if len(told) < len(tags):
        profile = read_profile(told, around).profile
    return ReadProfile(profile, tuple(faults))


def _parked_side(tags: Tags, kind: StreetClass, way: int, around: Surroundings) -> str:
    """The side with more room, where vehicles park without a tag; empty where they do not."""
    says = any(key.split(":")[0] in _TELLING for key in tags)
    apart = any(tags.get(key, "no") != "no" for key in ("bridge", "tunnel", "junction"))
    if not kind.parked_lane or not around.town or around.twin or says or apart:
        return ""
    driven = 2.0 * kind.parked_lane if not way else ONE_LANE_ONE_WAY
    half = 0.5 * (driven + PARKING["parallel"])
    free = around.free_left, around.free_right
    if min(free) < half + _BESIDE_PARKED + _FROM_WALL:
        return ""
    if way:
        return "right" if way > 0 else "left"
    return "left" if free[0] > free[1] else "right"


def _lane_counts(
    tags: Tags, kind: StreetClass, way: int, faults: list[str]
) -> tuple[int, int, bool]:
    """Lanes along the way and against it, and whether the only lane serves both directions."""
    total = _count(tags, "lanes", faults)
    ahead, back = _count(tags, "lanes:forward", faults), _count(tags, "lanes:backward", faults)
    if way:
        number = total or ahead or back or _listed(tags, "turn:lanes") or kind.one_way
        return (number, 0, False) if way > 0 else (0, number, False)
    ahead = ahead or _listed(tags, "turn:lanes:forward")
    back = back or _listed(tags, "turn:lanes:backward")
    if total == 1 and not (ahead and back):
        return 1, 0, True
    total = total or (ahead + back if ahead and back else max(kind.lanes, ahead + 1, back + 1))
    middle = min(_count(tags, "lanes:both_ways", faults), 1)
    if ahead and back:
        return max(ahead, total - back) if middle else ahead, back, False
    if ahead:
        return ahead, max(total - ahead, 1), False
    if back:
        return max(total - back, 1), back, False
    return (total + 1) // 2, total // 2, False


def _listed(tags: Tags, key: str) -> int:
    """Number of lanes that a list of lanes has."""
    return min(tags[key].count("|") + 1, MOST_LANES) if tags.get(key) else 0


def _count(tags: Tags, key: str, faults: list[str]) -> int:
    """A number of lanes; 0 where it is missing or implausible."""
    said = tags.get(key, "").split(";")[0].strip()
    if not said:
        return 0
    value = _number(said)
    if value is None or not 1.0 <= value <= MOST_LANES:
        if said != "0":
            faults.append(key)
        return 0
    return int(value)


def _lane_width(
    tags: Tags,
    kind: StreetClass,
    lanes: tuple[int, bool, float],
    around: Surroundings,
    faults: list[str],
) -> float:
    """Width of a driving lane by the tagged width or the class, metres."""
    number, shared, on_road = lanes
    usual = kind.lane_width * WIDER.get(around.country, 1.0)
    if number == 1:
        usual = max(usual, ONE_LANE_BOTH_WAYS if shared else ONE_LANE_ONE_WAY)
    for key in ("width:carriageway", "width"):
        if key in tags:
            stated = _number(tags[key])
            for free in (on_road, 0.0):
                if stated and LANE_WIDTHS[0] <= (stated - free) / number <= LANE_WIDTHS[1]:
                    return round((stated - free) / number, 3)
            faults.append(key)
    return usual


def _beside(  # noqa: PLR0913, PLR0917 - what a side follows from
    tags: Tags,
    side: str,
    kind: StreetClass,
    around: Surroundings,
    way: int,
    faults: list[str],
) -> list[StreetLane]:
    """Lanes beside the driving lanes, outwards."""
    lanes: list[StreetLane] = []
    cycle = _sided(tags, "cycleway", side)
    width = _beside_width(tags, f"cycleway:{side}:width", CYCLE_LANE, faults)
    if cycle == "lane":
        lanes.append(StreetLane("biking", width))
    if parking := _parking(tags, side):
        lanes.append(StreetLane("parking", parking))
    walk = _sidewalk(tags, side, kind, around, way, faults)
    if cycle == "track":
        lanes.append(StreetLane("biking", width, raised=True))
    if walk:
        lanes.append(StreetLane("sidewalk", walk))
    elif not lanes and kind.shoulder and not around.town:
        inner = around.twin and side == ("left" if way >= 0 else "right")
        lanes.append(StreetLane("shoulder", min(kind.shoulder, 0.75) if inner else kind.shoulder))
    return lanes


def _before_walls(lanes: list[StreetLane], room: float) -> list[StreetLane]:
    """Lanes beside the carriageway with a sidewalk that ends before the walls of buildings."""
    rest = room - sum(lane.width for lane in lanes if lane.kind != "sidewalk") - _FROM_WALL
    if rest >= max((lane.width for lane in lanes if lane.kind == "sidewalk"), default=0.0):
        return lanes
    narrow = [replace(x, width=round(rest, 2)) if x.kind == "sidewalk" else x for x in lanes]
    return narrow if rest >= _LEAST_SIDEWALK else [x for x in lanes if x.kind != "sidewalk"]


def _sided(tags: Tags, key: str, side: str) -> str:
    """Value of a tag for a side: of the side itself, of both sides, or of the key."""
    for name in (f"{key}:{side}", f"{key}:both", key):
        if name in tags:
            return tags[name]
    return ""


def _parking(tags: Tags, side: str) -> float:
    """Width of the parking lane of a side, metres; 0 without one."""
    said = _sided(tags, "parking", side)
    if said in {"lane", "street_side", "half_on_kerb"}:
        way = tags.get(f"parking:{side}:orientation", tags.get("parking:both:orientation", ""))
        return PARKING.get(way, PARKING["parallel"])
    for name in (f"parking:lane:{side}", "parking:lane:both"):
        if name in tags:
            return PARKING.get(tags[name], 0.0)
    return 0.0


def _sidewalk(  # noqa: PLR0913, PLR0917 - what a sidewalk follows from
    tags: Tags, side: str, kind: StreetClass, around: Surroundings, way: int, faults: list[str]
) -> float:
    """Width of the sidewalk of a side, metres; 0 without one."""
    said = tags.get(f"sidewalk:{side}") or tags.get("sidewalk:both") or ""
    plain = tags.get("sidewalk", "")
    if not said and plain:
        has = plain in {"both", "yes", "separate", side}
        said = "yes" if has else "no"
    key = next((k for k in (f"sidewalk:{side}:width", "sidewalk:both:width") if k in tags), "")
    width = kind.sidewalk or 2.0
    if key:
        width = _beside_width(tags, key, width, faults)
        said = said or "yes"
    if said:
        return width if said in {"yes", "separate", "both", "right", "left"} else 0.0
    if not around.town or tags.get("tunnel", "no") != "no":
        return 0.0
    inner = around.twin and side == ("left" if way >= 0 else "right")
    return 0.0 if inner else kind.sidewalk


def _beside_width(tags: Tags, key: str, usual: float, faults: list[str]) -> float:
    if key not in tags:
        return usual
    value = _number(tags[key])
    if value is None or not _LEAST_SIDEWALK <= value <= _MOST_SIDEWALK:
        faults.append(key)
        return usual
    return value


def _speed(tags: Tags, kind: StreetClass, around: Surroundings) -> int:
    match = _SPEED.match(tags.get("maxspeed", ""))
    if match and 0 < int(match[1]) <= 300:
        return round(int(match[1]) * (_MPH if match[2] == "mph" else 1.0))
    return kind.speed if around.town or kind.speed > 50 else max(kind.speed, 70)


def _level(tags: Tags, structure: str) -> int:
    """Layer of a bridge or tunnel; other ways lie on the ground whatever their layer."""
    value = tags.get("layer", "").strip()
    if not structure:
        return 0
    usual = 1 if structure == "bridge" else -1
    level = int(value) if re.fullmatch(r"[+-]?[1-5]", value) else usual
    return level if level * usual > 0 else usual


def _number(text: str) -> float | None:
    match = _NUMBER.match(text)
    return float(match[1].replace(",", ".")) if match else None
