"""Road marks and kerbs of OpenDRIVE from the types of linestrings."""

from collections.abc import Mapping
from dataclasses import dataclass

from envgen_usd.models.lanelet_map import LaneletLine

_THIN, _THICK = 0.12, 0.25
"""Widths of thin and thick lines, metres (RMS, urban roads)."""
_PAINTED: Mapping[str, str] = {
    "": "solid",
    "solid": "solid",
    "dashed": "broken",
    "solid_solid": "solid solid",
    "solid_dashed": "solid broken",
    "dashed_solid": "broken solid",
    "dashed_dashed": "broken broken",
}
_TURNED: Mapping[str, str] = {"solid broken": "broken solid", "broken solid": "solid broken"}
_COLOURS = frozenset(("white", "yellow", "red", "blue", "green", "orange"))
_KERBS: Mapping[str, float] = {"high": 0.12, "low": 0.03}
"""Heights of kerbs by subtype, metres."""


@dataclass(frozen=True)
class BorderMark:
    """A line on a border.

    Attributes:
        kind: Type of OpenDRIVE; for double lines from left to right.
        width: Metres.
        bold: True for thick lines.
        colour: Colour of OpenDRIVE.
        change: ``both``, ``none`` or empty where the map does not say.
    """

    kind: str
    width: float = _THIN
    bold: bool = False
    colour: str = "standard"
    change: str = ""

    def outwards(self, lane: int) -> "BorderMark":
        """The mark as a lane has it, whose double lines count from the inside to the outside."""
        kind = _TURNED.get(self.kind, self.kind) if lane > 0 else self.kind
        return BorderMark(kind, self.width, self.bold, self.colour, self.change)


def border_mark(line: LaneletLine, forward: bool) -> BorderMark:
    """The mark of a linestring, seen along the road.

    Args:
        line: The linestring.
        forward: Whether it runs along the road.
    """
    kind = _kind(line)
    bold = line.type == "line_thick"
    colour = line.tags.get("color", line.tags.get("colour", ""))
    if line.tags.get("temporary") in {"yes", "true"} and not colour:
        colour = "yellow"
    changes = {"yes": "both", "no": "none", "true": "both", "false": "none"}
    return BorderMark(
        kind if forward else _TURNED.get(kind, kind),
        _THICK if bold else _THIN,
        bold,
        colour if colour in _COLOURS else "standard",
        changes.get(line.tags.get("lane_change", ""), ""),
    )


def _kind(line: LaneletLine) -> str:
    if line.type == "curbstone":
        return "curb"
    if line.type in {"line_thin", "line_thick"}:
        return _PAINTED.get(line.subtype, "solid")
    return "none"


def kerb_height(line: LaneletLine) -> float:
    """Height of a kerb in metres; 0 where the linestring is none."""
    return _KERBS.get(line.subtype, _KERBS["high"]) if line.type == "curbstone" else 0.0
