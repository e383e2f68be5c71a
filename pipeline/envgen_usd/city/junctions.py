"""Junctions as intersections: what the file says of them, and those that have no area."""

from collections.abc import Iterable, Mapping

import numpy as np

from envgen_usd.chunks import CHUNK_SIZE, Chunk, snap
from envgen_usd.models.arrays import FloatArray
from envgen_usd.models.city import Attribute
from envgen_usd.models.surface import JunctionSite, RoadLine, RoadSurface


def junction_facts(site: JunctionSite) -> dict[str, Attribute]:
    """Returns what the file says of a junction."""
    facts: dict[str, Attribute] = {
        "opendrive_junction": site.id,
        "opendrive_junction_type": site.type,
    }
    if site.name:
        facts["opendrive_name"] = site.name
    if site.main_road:
        facts |= {"opendrive_main_road": site.main_road, "opendrive_s_start": site.s_start}
        facts |= {"opendrive_s_end": site.s_end}
    if site.orientation:
        facts["opendrive_orientation"] = site.orientation
    return facts


def without_area(surface: RoadSurface) -> tuple[JunctionSite, ...]:
    """Returns the junctions that have neither a part of the surface nor a lane.

    Virtual, direct and crossing junctions lie on roads that belong to none.
    """
    filled = {patch.junction for patch in surface.patches}
    filled |= {lane.junction for lane in surface.lanes}
    return tuple(site for site in surface.junctions if site.id not in filled)


def junction_lines(site: JunctionSite, roads: Iterable[RoadLine]) -> tuple[FloatArray, ...]:
    """Returns the pieces of the reference lines that lie in a junction; each N_i x 3."""
    lines = {line.road: line for line in roads}
    pieces = [
        _piece(lines[road], *sorted((start, end)))
        for road, start, end in site.stretches
        if road in lines and start != end
    ]
    return tuple(piece for piece in pieces if len(piece) > 1)


def chunk_of_junction(site: JunctionSite, roads: Mapping[str, RoadLine]) -> Chunk | None:
    """Returns the chunk in which the middle of a junction's first stretch lies; none without."""
    for road, start, end in site.stretches:
        if road in roads:
            middle = _at(roads[road], np.array([(start + end) / 2]))[0]
            return Chunk(*np.floor(middle[:2] / CHUNK_SIZE).astype(int).tolist())
    return None


def _piece(line: RoadLine, start: float, end: float) -> FloatArray:
    inside = line.s[(line.s > start) & (line.s < end)]
    points = snap(_at(line, np.unique([start, *inside.tolist(), end])))
    keep = np.append(True, (np.diff(points, axis=0) != 0).any(axis=1))
    kept: FloatArray = points[keep]
    return kept


def _at(line: RoadLine, s: FloatArray) -> FloatArray:
    """Points of a reference line, N x 3."""
    return np.column_stack([np.interp(s, line.s, line.points[:, axis]) for axis in range(3)])
