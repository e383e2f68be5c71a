"""Road marks (ASAM OpenDRIVE, 11.9), and what holds where a file leaves them open."""

from dataclasses import dataclass

from envgen_usd.models.cubics import NO_CUBICS, Cubics

BOLD = 2.0
"""Width of a ``bold`` line as a multiple of a ``standard`` line's, the least that both VwV-StVO
(to § 41, III 4) and MUTCD 2009 (3A.06) allow."""


@dataclass(frozen=True)
class MarkRules:
    """Sizes of marks where the road file gives none; lengths in metres.

    The defaults are those of the German RMS-1 (1993): Schmalstrich, and Leitlinie in towns and on
    motorways. An environment replaces them all.

    Attributes:
        width: Of a line of weight ``standard``.
        dash_length: Of a dash of a broken line.
        dash_gap: Between two dashes.
        motorway_dash_length: Of a dash on a road of type ``motorway``.
        motorway_dash_gap: Between two dashes there.
    """

    width: float = 0.12
    dash_length: float = 3.0
    dash_gap: float = 6.0
    motorway_dash_length: float = 6.0
    motorway_dash_gap: float = 12.0

    def line_width(self, weight: str) -> float:
        """Width of a line of a weight, ``standard`` or ``bold``."""
        return self.width * BOLD if weight == "bold" else self.width

    def dashes(self, road_type: str) -> tuple[float, float]:
        """Dash and gap of a broken line on a road of a type (e_roadType)."""
        if road_type == "motorway":
            return self.motorway_dash_length, self.motorway_dash_gap
        return self.dash_length, self.dash_gap


RMS_MARKS = MarkRules()
"""What holds without an environment."""


@dataclass(frozen=True)
class RoadMarkLine:
    """A line of a mark (11.9): dashes of `length` with gaps of `space`, in metres."""

    length: float
    space: float
    t_offset: float
    s_offset: float
    width: float
    rule: str = ""
    colour: str = ""


@dataclass(frozen=True)
class RoadMark:
    """A mark along a lane's outer border (11.9).

    Attributes:
        s_offset: Metres from the start of the lane section.
        type: ``solid``, ``broken``, ``solid solid``, ...
        weight: ``standard`` or ``bold``.
        colour: As in the file.
        width: Metres; -1 where the file gives no width.
        height: Metres above the road.
        lane_change: ``increase``, ``decrease``, ``both``, ``none`` or empty.
        material: As in the file.
        lines: Lines of the `<type>` element; they repeat along the mark.
        explicit: Lines of the `<explicit>` element; they do not repeat.
        sway: t offset by s, relative to the lane section.
    """

    s_offset: float
    type: str
    weight: str = "standard"
    colour: str = "standard"
    width: float = -1.0
    height: float = 0.0
    lane_change: str = ""
    material: str = ""
    lines: tuple[RoadMarkLine, ...] = ()
    explicit: tuple[RoadMarkLine, ...] = ()
    sway: Cubics = NO_CUBICS
