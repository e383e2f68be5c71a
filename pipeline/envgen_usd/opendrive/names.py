"""Ids of patches and lane lines: NCNames made from the file's own ids."""

import re

_NOT_NCNAME = re.compile(r"[^A-Za-z0-9_.\-]")


def nc_name(text: str) -> str:
    """Text as a part of an NCName; other characters become their code, so ids stay distinct."""
    return _NOT_NCNAME.sub(lambda found: f"_x{ord(found.group()):x}_", text)


def lane_patch_id(road: str, section: int, lane: int) -> str:
    """Id of a lane's patch, traffic space and lane line, e.g. ``road_7_s0_lane_-1``."""
    return f"road_{nc_name(road)}_s{section}_lane_{lane}"
