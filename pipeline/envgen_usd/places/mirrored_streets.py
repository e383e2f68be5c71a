"""Streets with traffic on the left as the mirror image of streets with traffic on the right.

Everything about streets is made for traffic on the right. East and west of a map with traffic on
the left are swapped before, and those of the finished road file after it.
"""

import re
from collections.abc import Mapping
from dataclasses import replace

from envgen_usd.geometry.mirrored_opendrive import mirrored_points
from envgen_usd.models.street_plan import StreetPlan
from envgen_usd.places.osm_streets import Places, StreetExtract

_SIDE = re.compile(r"(?<![a-z])(left|right)(?![a-z])")
_OTHER = {"left": "right", "right": "left"}
_SIDED = re.compile(r"(turn|sidewalk|cycleway|parking|placement|change|shoulder)(:|$)")
"""Keys whose values name sides."""
_PLACEMENT = re.compile(r"(left|right|middle)_of:(-?)(\d+)$")


def mirrored_extract(extract: StreetExtract) -> StreetExtract:
    """The extract with east and west swapped about the middle of its streets."""
    west, south, east, north = extract.bounds
    # The middle as `plan_crs` rounds it, so that both have the same reference system.
    middle = float(f"{(west + east) / 2.0:.6f}")
    half = (east - west) / 2.0

    def place(at: tuple[float, float]) -> tuple[float, float]:
        return 2.0 * middle - at[0], at[1]

    def places(line: Places) -> Places:
        return tuple(place(at) for at in line)

    return replace(
        extract,
        ways=[
            replace(way, places=places(way.places), tags=mirrored_tags(way.tags))
            for way in extract.ways
        ],
        points=[(node, kind, place(at), along) for node, kind, at, along in extract.points],
        beside=[(kind, place(at)) for kind, at in extract.beside],
        signs=[(node, code, place(at), along) for node, code, at, along in extract.signs],
        lines=[(tags, places(line)) for tags, line in extract.lines],
        buildings=[[place(at) for at in ring] for ring in extract.buildings],
        bounds=(middle - half, south, middle + half, north),
    )


def mirrored_tags(tags: Mapping[str, str]) -> dict[str, str]:
    """Tags of a way as its mirror image has them.

    Left and right change places, also in values of keys that name sides, and lists of lanes are
    reversed. A lane of ``placement`` is counted from the other side, by a negative number.
    """
    return {_swapped(key): _mirrored_value(key, value) for key, value in tags.items()}


def _swapped(text: str) -> str:
    return _SIDE.sub(lambda side: _OTHER[side[1]], text)


def _mirrored_value(key: str, value: str) -> str:
    if key.startswith("placement"):
        return _PLACEMENT.sub(_mirrored_placement, value)
    found = "|".join(value.split("|")[::-1]) if "lanes" in key.split(":") else value
    return _swapped(found) if _SIDED.match(key) else found


def _mirrored_placement(found: re.Match[str]) -> str:
    side, sign, number = found.groups()
    return f"{_OTHER.get(side, side)}_of:{'' if sign else '-'}{number}"


def mirrored_plan(plan: StreetPlan) -> StreetPlan:
    """The plan with east and west swapped; cross-sections stay those of traffic on the right."""
    return replace(
        plan,
        nodes=mirrored_points(plan.nodes),
        streets=tuple(replace(s, line=mirrored_points(s.line)) for s in plan.streets),
        points=tuple(replace(p, place=mirrored_points(p.place)) for p in plan.points),
        lines=tuple(replace(x, line=mirrored_points(x.line)) for x in plan.lines),
    )
