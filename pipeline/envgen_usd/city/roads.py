"""The road surface as CityGML: roads, sections, intersections, traffic spaces and markings."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cache

import numpy as np

from envgen_usd.chunks import Chunk
from envgen_usd.city.chunk_pieces import ChunkPieces, piece_name
from envgen_usd.city.junctions import (
    chunk_of_junction,
    junction_facts,
    junction_lines,
    without_area,
)
from envgen_usd.city.names import ncname
from envgen_usd.city.patch_polygons import patch_polygons
from envgen_usd.city.road_bodies import BODY, make_body
from envgen_usd.city.road_lines import make_lines
from envgen_usd.city.road_links import crosswalk_links, virtual_links
from envgen_usd.city.traffic_spaces import RoadDetail, RoadPart, make_mark, make_space
from envgen_usd.models.arrays import IntArray
from envgen_usd.models.city import CityObject, ThematicSurface
from envgen_usd.models.polygons import Polygons
from envgen_usd.models.profile import Profile
from envgen_usd.models.surface import JunctionSite, LaneLine, Patch, RoadSurface

_Key = tuple[str, str, int]
_WHOLE = Chunk(0, 0)
_DEFAULT = RoadDetail()


@dataclass
class _Section:
    """What was gathered of a section or an intersection."""

    spaces: list[CityObject] = field(default_factory=list)
    marks: list[ThematicSurface] = field(default_factory=list)


def make_roads(
    chunk: Chunk | None, surface: RoadSurface, profile: Profile, detail: RoadDetail = _DEFAULT
) -> tuple[CityObject, ...]:
    """Returns the roads of a chunk.

    Each OpenDRIVE road is a ``Road`` with a ``Section`` for each lane section; each junction is a
    ``Road`` with one ``Intersection`` that holds the lanes of all its connecting roads, and that
    the roads which lead there refer to; one without such roads has the lines in it instead. Every
    patch is a ``TrafficSpace`` or an ``AuxiliaryTrafficSpace`` with its area, marks are ``Marking``
    surfaces of the section, and bodies of bridges and tubes of tunnels are ``Bridge`` and
    ``Tunnel`` of their own. A feature that lies in several chunks is cut: triangles go to the
    chunk of their centroid, centre lines are cut at the border, and the ids of the pieces end in
    the chunk's name.

    Args:
        chunk: The tile; none for the whole map without any cut.
        surface: All roads.
        profile: Colours and materials.
        detail: What is written besides surfaces and centre lines.
    """
    tile = chunk or _WHOLE
    pieces = ChunkPieces(surface, whole=None if chunk else _WHOLE)
    links, ways = crosswalk_links(surface), virtual_links(surface)
    part = RoadPart(tile, surface, profile, pieces, detail, links, ways)
    sections: dict[_Key, _Section] = {}
    bodies = []
    for index, triangles in _patches(part):
        patch = surface.patches[index]
        polygons = patch_polygons(surface.vertices, surface.triangles[triangles])
        name = piece_name(patch.id, pieces.chunks_of([index]), tile)
        if patch.kind == BODY:
            bodies.append(make_body(name, patch, polygons))
            continue
        section = sections.setdefault(_key(patch), _Section())
        if patch.kind == "mark":
            section.marks.append(make_mark(name, patch, polygons, part))
        else:
            lane = pieces.lanes.get(patch.id)
            section.spaces.append(make_space(name, patch, polygons, lane, part))
    for lane in _lanes_without_area(part):
        patch, name = _patch_of(lane), pieces.lane_name(lane, tile)
        section = sections.setdefault(_key(patch), _Section())
        section.spaces.append(make_space(name, patch, Polygons.of_rings([]), lane, part))
    roads = (*_roads(sections, part), *bodies)
    return (*roads, *make_lines(part)) if detail.lines else roads


def _patches(part: RoadPart) -> Iterator[tuple[int, IntArray]]:
    """Index and triangles of each patch that has a part in the chunk."""
    owner = part.surface.triangle_patch
    inside = np.flatnonzero(part.pieces.triangles_in(part.chunk))
    inside = inside[np.argsort(owner[inside], kind="stable")]
    numbers, starts = np.unique(owner[inside], return_index=True)
    found = dict(zip(numbers.tolist(), np.split(inside, starts)[1:], strict=True))
    for index, patch in enumerate(part.surface.patches):
        lane = part.pieces.lanes.get(patch.id)
        passes = lane and any(tile == part.chunk for tile, _ in part.pieces.runs(lane))
        if index in found or passes:
            yield index, found.get(index, np.empty(0, dtype=np.int64))


def _lanes_without_area(part: RoadPart) -> list[LaneLine]:
    """Lanes in the chunk that own no area, as others of the junction lie over them."""
    known = {patch.id for patch in part.surface.patches}
    return [
        lane
        for lane in part.surface.lanes
        if lane.id not in known and any(tile == part.chunk for tile, _ in part.pieces.runs(lane))
    ]


def _patch_of(lane: LaneLine) -> Patch:
    return Patch(
        id=lane.id,
        kind="lane",
        lane_type=lane.lane_type,
        road=lane.road,
        section=lane.section,
        lane=lane.lane,
        junction=lane.junction,
    )


def _key(patch: Patch) -> _Key:
    """Junction, road and section that a patch belongs to; in a junction no road owns it alone."""
    return (patch.junction, "", 0) if patch.junction else ("", patch.road, patch.section)


def _roads(sections: dict[_Key, _Section], part: RoadPart) -> tuple[CityObject, ...]:
    """Roads with their sections, and junctions with their intersections."""
    naming = _naming(part)
    sites = {site.id: site for site in part.surface.junctions}
    bare = _junctions_without_area(part)
    tops: dict[tuple[str, str], list[CityObject]] = {}
    for key, section in (sections | {(name, "", 0): _Section() for name in bare}).items():
        site = sites.get(key[0])
        lines = junction_lines(site, part.surface.roads) if site and key[0] in bare else ()
        child = CityObject(
            naming(*key),
            "Intersection" if key[0] else "Section",
            junction_facts(site) if site else {},
            surfaces=tuple(section.marks),
            curves={"lod2MultiCurve": lines} if lines else {},
            relations=_met(site, {road for _, road, _ in sections}, naming) if site else {},
            children=_sorted(section.spaces),
        )
        tops.setdefault(key[:2], []).append(child)
    there = {name for name, _ in tops if name}
    reached = _junctions(part)
    roads = []
    for (junction, road), children in tops.items():
        facts = {"opendrive_junction": junction} if junction else {"opendrive_road": road}
        ends = sorted(reached.get(road, set()) & there) if road else []
        meets = {"intersection": tuple(naming(name, "", 0) for name in ends)} if ends else {}
        roads.append(
            CityObject(
                naming(junction, road),
                "Road",
                facts,
                relations=meets,
                children=tuple(children),
            )
        )
    return tuple(roads)


def _junctions_without_area(part: RoadPart) -> set[str]:
    """Ids of the junctions that lie in the chunk with nothing but the roads that meet there."""
    lines = {line.road: line for line in part.surface.roads}
    sites = without_area(part.surface)
    # Where nothing is cut, all of them are there.
    whole = part.pieces.is_whole
    return {site.id for site in sites if whole or chunk_of_junction(site, lines) == part.chunk}


def _met(
    site: JunctionSite, roads: set[str], naming: Callable[..., str]
) -> dict[str, tuple[str, ...]]:
    """Roads in the chunk that meet in a junction, by role."""
    names = {road: naming("", road) for road in site.roads if road in roads}
    main = names.pop(site.main_road, "")
    found = {"mainRoad": (main,) if main else (), "connectedRoad": tuple(names.values())}
    return {role: ids for role, ids in found.items() if ids}


def _naming(part: RoadPart) -> Callable[..., str]:
    """Function that names the piece in the chunk of what a key, or its beginning, stands for."""
    keys = [_key(patch) for patch in part.surface.patches]

    def name(junction: str, road: str, section: int | None = None) -> str:
        start = (junction, road) if section is None else (junction, road, section)
        members = [index for index, key in enumerate(keys) if key[: len(start)] == start]
        whole = ncname(junction or road)
        if section is None:
            plain = f"Junction_{whole}" if junction else f"Road_{whole}"
        elif junction:
            plain = f"Intersection_{whole}"
        else:
            plain = f"Section_{whole}_{section if section >= 0 else 'all'}"
        return piece_name(plain, part.pieces.chunks_of(members), part.chunk)

    return cache(name)


def _sorted(spaces: list[CityObject]) -> tuple[CityObject, ...]:
    """Traffic spaces first, as the CityGML file has them."""
    return tuple(sorted(spaces, key=lambda space: space.kind != "TrafficSpace"))


def _junctions(part: RoadPart) -> dict[str, set[str]]:
    """Junctions that each road leads to or comes from, or passes."""
    found: dict[str, set[str]] = {}
    for site in part.surface.junctions:
        for road in site.roads:
            found.setdefault(road, set()).add(site.id)
    lanes = part.pieces.lanes
    for lane in lanes.values():
        for other in (*lane.predecessors, *lane.successors):
            if not lane.junction and other in lanes and lanes[other].junction:
                found.setdefault(lane.road, set()).add(lanes[other].junction)
    return found
