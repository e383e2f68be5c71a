"""Walls, fences and guard rails along bounds, as objects of the roads beside them."""

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np
import shapely
from lxml import etree

from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.lanelet_map import LaneletLine, LaneletMap
from envgen_usd.streets import road_elements as elements
from envgen_usd.streets.lanelets.lanelet_road_elements import LaneletRoad
from envgen_usd.streets.mapped_furniture import holder

BARRIERS: Mapping[str, tuple[str, float, float]] = {
    "guard_rail": ("guardRail", 0.75, 0.3),
    "wall": ("wall", 1.0, 0.24),
    "fence": ("fence", 1.2, 0.05),
}
"""Name, height and width in metres of each type of linestring that stands (guard rails: RPS)."""
_METRES = re.compile(r"([0-9]{1,3}(?:\.[0-9]+)?) ?m?")
_HEIGHTS = (0.2, 12.0)
"""Least and largest height that a tag may give, metres."""
_STRAIGHT = 0.02
"""Largest distance of a barrier's straight pieces from its border, metres."""
_STEP = 0.5
_LEAST = 0.2
"""Least length of a piece, metres."""


def add_barriers(roads: Sequence[LaneletRoad], source: LaneletMap) -> Counter[str]:
    """Adds what stands on the bounds of lanelets, each linestring once.

    Outside of the lanes it stands beside the border, between them on it. A road outside of
    junctions has what several roads share.

    Returns:
        The number of linestrings by type.
    """
    done: set[int] = set()
    counts: Counter[str] = Counter()
    for road in sorted(roads, key=lambda road: road.strip.junction >= 0):
        parts = pairwise((0.0, *road.ends))
        for group, part in zip(road.strip.groups, parts, strict=True):
            for number, side in enumerate(group.borders):
                line = source.lines[side.line]
                if line.type in BARRIERS and side.line not in done:
                    done.add(side.line)
                    outside = {0: 0.5, len(group.lanelets): -0.5}.get(number, 0.0)
                    _add(road, line, number, part, outside)
                    counts[f"{line.type.replace('_', ' ')}s"] += 1
    return counts


def _add(
    road: LaneletRoad, line: LaneletLine, number: int, part: tuple[float, float], outside: float
) -> None:
    """A barrier along a part of a border; `outside` of its width stand to the left of it."""
    name, height, width = BARRIERS[line.type]
    match = _METRES.fullmatch(line.tags.get("height", ""))
    tagged = float(match.group(1)) if match else 0.0
    height = tagged if _HEIGHTS[0] <= tagged <= _HEIGHTS[1] else height
    knots = _knots(road, number, part)
    knots[:, 1] += outside * width
    objects = holder(road.element, "objects")
    (s, t), length = knots[0].tolist(), float(knots[-1, 0] - knots[0, 0])
    item = etree.SubElement(
        objects, "object", id=f"barrier_{line.id}", type="barrier", subtype=name, name=name,
        s=elements.text(s), t=elements.text(t), zOffset="0", hdg="0", orientation="none",
        length=elements.text(length), width=elements.text(width), height=elements.text(height),
    )  # fmt: skip
    for (first, start), (last, end) in pairwise(knots.tolist()):
        etree.SubElement(
            item, "repeat", s=elements.text(first), length=elements.text(last - first),
            distance="0", tStart=elements.text(start), tEnd=elements.text(end),
            widthStart=elements.text(width), widthEnd=elements.text(width),
            heightStart=elements.text(height), heightEnd=elements.text(height),
            zOffsetStart="0", zOffsetEnd="0",
        )  # fmt: skip


def _knots(road: LaneletRoad, number: int, part: tuple[float, float]) -> FloatArray:
    """S and t between which a border is straight enough, N x 2."""
    count = max(int(np.ceil((part[1] - part[0]) / _STEP)), 1)
    s = np.linspace(*part, count + 1)
    line = shapely.LineString(np.column_stack([s, road.shape.at(s)[:, number]]))
    knots: FloatArray = shapely.get_coordinates(shapely.simplify(line, _STRAIGHT))
    kept = np.concatenate([[True], np.diff(knots[:, 0]) > _LEAST])
    kept[-1] = True
    return np.array(knots[kept])
