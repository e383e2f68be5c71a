"""Islands between the directions of streets as objects, with their signs and hatched areas."""

from collections.abc import Sequence

import numpy as np
from lxml import etree

from envgen_usd.models.array_types import FloatArray
from envgen_usd.streets import road_elements as elements
from envgen_usd.streets.island_stretches import ISLAND_WIDTH
from envgen_usd.streets.mapped_furniture import holder
from envgen_usd.streets.street_sections import MEDIAN, StreetSection

_REFUGE = 3.0
"""Length of the lowered middle of an island, metres; a crossing is as wide."""
_RAMP = 0.5
"""Length over which kerbs go down to the refuge, metres."""
_LOWERED = 0.03
"""Height of a lowered kerb, metres; DIN 18040-3 asks for 3 cm where the blind cross, too."""
_SIGN = 0.7
"""Distance of a sign from the end of its island, metres."""
_STEP = 2.0
"""Distance of the corners of a hatched area along the road, metres."""
_LEAST_WIDTH = 0.5
"""Width from which the lane between the directions is hatched, metres."""
_FROM_ISLAND = 0.5
"""Length between hatched areas and islands, metres."""
KEEP_RIGHT = "222"
"""German sign "pass on the right" (StVO, Anlage 2)."""
KEEP_LEFT = "222-10"
"""The same of traffic on the left."""
ISLAND_SIGN = "island_sign"
"""Begin of the ids of the signs on islands."""


def add_islands(
    road: etree._Element, sections: Sequence[StreetSection], places: Sequence[tuple[float, float]]
) -> int:
    """Adds islands to a road: raised areas, signs at both ends, and paint before and behind.

    Args:
        road: The road.
        sections: Its lane sections; those with islands have a lane `MEDIAN` left of the middle.
        places: s of the middle and length of each island, metres.

    Returns:
        Number of the islands; without one are those whose section became a part of another.
    """
    built: dict[int, list[tuple[float, float]]] = {}
    for s, length in places:
        number = max(n for n, x in enumerate(sections) if x.start <= s)
        if sections[number].left and sections[number].left[0].lane.kind == MEDIAN:
            built.setdefault(number, []).append((s, length))
    for number, own in built.items():
        section = sections[number]
        for s, length in own:
            _add_island(road, section, s, length)
        if section.profile.marked and section.profile.lined:
            _add_hatching(road, section, own)
    return sum(map(len, built.values()))


def _borders(section: StreetSection, s: FloatArray) -> tuple[FloatArray, FloatArray]:
    """T of the right and of the left border of the lane between the directions."""
    at = s - section.start
    right = elements.smooth_values(section.offset, at)
    return right, right + elements.smooth_values(section.left[0].width, at)


def _add_island(road: etree._Element, section: StreetSection, s: float, length: float) -> None:
    right, left = _borders(section, np.array([s]))
    t = float(right[0] + left[0]) / 2.0
    name = f"{road.get('id')}_{s:.1f}"
    island = etree.SubElement(
        holder(road, "objects"), "object", id=f"island_{name}", type="trafficIsland",
        name="traffic island", s=elements.text(s), t=elements.text(t), zOffset="0", hdg="0",
        orientation="none", length=elements.text(length), width=elements.text(ISLAND_WIDTH),
        height=elements.text(elements.KERB),
    )  # fmt: skip
    elements.add_road_outline(island, _ring(length) + np.array([s, t, 0.0]))
    signs = holder(road, "signals")
    for orientation, sign in (("+", -1.0), ("-", 1.0)):
        at = s + sign * (length / 2.0 - _SIGN)
        elements.add_signal(
            signs, f"{ISLAND_SIGN}_{name}_{orientation}", KEEP_RIGHT, at, t, orientation
        )


def _ring(length: float) -> FloatArray:
    """Corners of an island about its middle: s, t and height above the road; counter-clockwise."""
    half, low = ISLAND_WIDTH / 2.0, _REFUGE / 2.0
    turn = np.linspace(-np.pi / 2.0, np.pi / 2.0, 7)
    head = np.column_stack(
        [
            length / 2.0 - half + half * np.cos(turn),
            half * np.sin(turn),
            np.full(len(turn), elements.KERB),
        ]
    )
    side = np.array([(low + _RAMP, half, elements.KERB), (low, half, _LOWERED)])
    if length / 2.0 - half - low - _RAMP < 1e-6:
        side = side[1:]
    right = np.concatenate([side[::-1] * (1.0, -1.0, 1.0), head, side])
    return np.concatenate([right, right * (-1.0, -1.0, 1.0)])


def _add_hatching(
    road: etree._Element, section: StreetSection, places: Sequence[tuple[float, float]]
) -> None:
    """Paints the lane between the directions where no island lies (StVO, sign 298)."""
    reaches = sorted((s, length / 2.0 + _FROM_ISLAND) for s, length in places)
    ends = [section.start, *(s + reach for s, reach in reaches)]
    begins = [*(s - reach for s, reach in reaches), section.start + section.length]
    for number, (first, last) in enumerate(zip(ends, begins, strict=True)):
        if last - first < 2.0 * _STEP:
            continue
        s = np.linspace(first, last, int(np.ceil((last - first) / _STEP)) + 1)
        right, left = _borders(section, s)
        wide = left - right > _LEAST_WIDTH
        s, right, left = s[wide], right[wide], left[wide]
        if len(s) < 2:
            continue
        middle, t = float(s.mean()), float((right + left).mean()) / 2.0
        paint = etree.SubElement(
            holder(road, "objects"), "object", id=f"hatch_{road.get('id')}_{first:.1f}_{number}",
            name="cross hatch", type="roadMark", s=elements.text(middle), t=elements.text(t),
            zOffset="0", hdg="0", orientation="none",
        )  # fmt: skip
        ring = np.concatenate([np.column_stack([s, right]), np.column_stack([s, left])[::-1]])
        elements.add_road_outline(paint, np.column_stack([ring, np.zeros(len(ring))]))
