"""Streets as a minimal OpenDRIVE file: a two-lane road with sidewalks for each piece of street.

Pieces end where streets meet, and overlap there; without junctions no lane leads across. That is
enough for landuse and buildings, whose blocks are the faces between the roads' outlines.
"""

from xml.sax.saxutils import quoteattr

import numpy as np
import shapely

from envgen_usd.geometry.hermite_curves import Cubic, smooth_curve
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.place import Streets
from envgen_usd.places.building_figures import street_edges
from envgen_usd.places.osm_tags import SIDEWALK

LEAST_LENGTH = 8.0
"""Shortest piece that becomes a road, metres."""
_SIMPLE = 0.4
"""Largest move of a street's middle by which it is simplified, metres."""
_SHORTEST = 4.0
"""Least distance between two points of a road, metres; nearer ones would bend too tightly."""


def road_text(streets: Streets, crs: str = "") -> str:
    """OpenDRIVE 1.7 of streets, in their metres.

    Args:
        streets: Streets of a place.
        crs: Their coordinate reference system, for the header.
    """
    edges, widths = street_edges(streets)
    reference = f"<geoReference><![CDATA[{crs}]]></geoReference>" if crs else ""
    roads = "".join(
        _road(number, line, width)
        for number, (line, width) in enumerate(zip(edges, widths, strict=True))
        if shapely.length(line) >= LEAST_LENGTH
    )
    header = f'<header revMajor="1" revMinor="7" name="streets">{reference}</header>'
    return f'<?xml version="1.0"?>\n<OpenDRIVE>{header}{roads}</OpenDRIVE>\n'


def _road(number: int, line: shapely.LineString, width: float) -> str:
    points = _thinned(shapely.get_coordinates(shapely.simplify(line, _SIMPLE)))
    length, pieces = 0.0, ""
    for piece in smooth_curve(points):
        pieces += _geometry(piece, length)
        length += piece.length
    lane = '<lane id="{}" type="{}"><width sOffset="0" a="{:.2f}" b="0" c="0" d="0"/></lane>'
    sides = {
        side: lane.format(sign, "driving", width / 2) + lane.format(2 * sign, "sidewalk", SIDEWALK)
        for side, sign in (("left", 1), ("right", -1))
    }
    left = "".join(f"<lane{part}" for part in reversed(sides["left"].split("<lane")[1:]))
    return (
        f'<road id={quoteattr(str(number))} length="{length:.6f}" junction="-1">'
        f'<type s="0" type="town"/><planView>{pieces}</planView><lanes><laneSection s="0">'
        f'<left>{left}</left><center><lane id="0" type="none"/></center>'
        f"<right>{sides['right']}</right></laneSection></lanes></road>\n"
    )


def _thinned(points: FloatArray) -> FloatArray:
    """Points without those that are nearer to their predecessor than `_SHORTEST`; ends stay."""
    kept = [points[0]]
    for point in points[1:-1]:
        if np.hypot(*(point - kept[-1])) >= _SHORTEST:
            kept.append(point)
    if len(kept) > 1 and np.hypot(*(points[-1] - kept[-1])) < _SHORTEST:
        kept.pop()
    return np.array([*kept, points[-1]])


def _geometry(piece: Cubic, s: float) -> str:
    x, y, heading, length = (
        f"{value:.9f}" for value in (*piece.start, piece.heading, piece.length)
    )
    u, v = (
        " ".join(f'{letter}{axis}="{value:.12g}"' for letter, value in zip("bcd", row, strict=True))
        for axis, row in (("U", piece.along), ("V", piece.across))
    )
    return (
        f'<geometry s="{s:.6f}" x="{x}" y="{y}" hdg="{heading}" length="{length}">'
        f'<paramPoly3 pRange="normalized" aU="0" {u} aV="0" {v}/></geometry>'
    )
