"""Road marks (ASAM OpenDRIVE, 11.9)."""

from dataclasses import dataclass

from envgen_usd.models.cubics import NO_CUBICS, Cubics


@dataclass(frozen=True)
class RoadMarkLine:
    """One line of a mark's explicit type (11.9): dashes of `length` with gaps of `space`."""

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
        s_offset: From the start of the lane section.
        type: ``solid``, ``broken``, ``solid solid``, ...
        weight: ``standard`` or ``bold``.
        colour: As in the file.
        width: Metres; -1 where the file gives none.
        height: Metres above the road.
        lane_change: ``increase``, ``decrease``, ``both``, ``none`` or empty.
        material: As in the file.
        lines: Lines of the `<type>` element, repeated along the mark.
        explicit: Lines of the `<explicit>` element, not repeated.
        sway: t offset along s, relative to the section.
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
