"""Junctions as intersections: their attributes, and junctions without area."""

from collections.abc import Mapping

import numpy as np

from envgen_usd.chunks import Chunk, chunk_at, snap
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.attribute_values import Attribute
from envgen_usd.models.road_surface import JunctionSite, RoadLine, RoadSurface


def junction_facts(site: JunctionSite) -> dict[str, Attribute]:
    """Returns a junction's attributes from the file."""
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
    """Returns the junctions without surface and without lanes.

    Virtual, direct and crossing junctions lie on roads outside any junction.
    """
    filled = {patch.junction for patch in surface.patches}
    filled |= {lane.junction for lane in surface.lanes}
    return tuple(site for site in surface.junctions if site.id not in filled)


def junction_lines(site: JunctionSite, lines: Mapping[str, RoadLine]) -> tuple[FloatArray, ...]:
    """Returns the pieces of the reference lines that lie in a junction; each N_i x 3."""
    pieces = [
        _piece(lines[road], *sorted((start, end)))
        for road, start, end in site.stretches
        if road in lines and start != end
    ]
    return tuple(piece for piece in pieces if len(piece) > 1)


def chunk_of_junction(site: JunctionSite, roads: Mapping[str, RoadLine]) -> Chunk | None:
    """Returns the chunk at the middle of a junction's first stretch, or `None`."""
    for road, start, end in site.stretches:
        if road in roads:
            middle = _at(roads[road], np.array([(start + end) / 2]))[0]
            return chunk_at(middle)
    return None


def _piece(line: RoadLine, start: float, end: float) -> FloatArray:
    inside = line.s[(line.s > start) & (line.s < end)]
    points = snap(_at(line, np.unique([start, *inside.tolist(), end])))
    keep = np.append(True, (np.diff(points, axis=0) != 0).any(axis=1))
    kept: FloatArray = points[keep]
    return kept


def _at(line: RoadLine, s: FloatArray) -> FloatArray:
    """Points of a reference line at s, N x 3."""
    return np.column_stack([np.interp(s, line.s, line.points[:, axis]) for axis in range(3)])
