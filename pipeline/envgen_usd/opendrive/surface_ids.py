"""Ids of patches and lane lines: NCNames from the ids of the file."""

import re

from envgen_usd.models.road_objects import Origin

_NOT_NCNAME = re.compile(r"[^A-Za-z0-9_.\-]")


def nc_name(text: str) -> str:
    """Encodes a text for an NCName; other characters become their code, so ids stay distinct."""
    if text.isascii() and text.isalnum():
        return text
    return _NOT_NCNAME.sub(lambda match: f"_x{ord(match.group()):x}_", text)


def lane_patch_id(road: str, section: int, lane: int) -> str:
    """Returns the id of a lane's patch, traffic space and lane line: ``road_7_s0_lane_-1``."""
    return f"road_{nc_name(road)}_s{section}_lane_{lane}"


def origin_id(origin: Origin) -> str:
    """Returns the begin of the ids of all that shows an object or a signal: ``object_7_3``."""
    return f"{origin.tag}_{nc_name(origin.road)}_{origin.number}"
