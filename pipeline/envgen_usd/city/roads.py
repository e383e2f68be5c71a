"""The road surface as CityGML: roads, sections, intersections, traffic spaces and markings."""

from dataclasses import dataclass, field, replace

import numpy as np

from envgen_usd.chunks import Chunk
from envgen_usd.city.chunk_pieces import ChunkPieces, piece_name
from envgen_usd.city.lane_codes import LaneCodes, lane_codes, mark_colour, mark_material
from envgen_usd.city.names import ncname
from envgen_usd.city.patch_polygons import patch_polygons
from envgen_usd.models.arrays import FloatArray
from envgen_usd.models.city import Attribute, CityObject, ThematicSurface
from envgen_usd.models.polygons import Polygons
from envgen_usd.models.profile import Profile
from envgen_usd.models.surface import LaneLine, Patch, RoadSurface

_Key = tuple[str, str, int]
_LOD = 2
_BOTH_WAYS = frozenset(("bidirectional", "sidewalk", "walking", "shared"))


@dataclass
class _Part:
    """What was gathered of a section or an intersection."""

    spaces: list[CityObject] = field(default_factory=list)
    marks: list[ThematicSurface] = field(default_factory=list)


def make_roads(chunk: Chunk, surface: RoadSurface, profile: Profile) -> tuple[CityObject, ...]:
    """Returns the roads of a chunk.

    Each OpenDRIVE road is a ``Road`` with a ``Section`` for each lane section; each junction is a
    ``Road`` with one ``Intersection`` that holds the lanes of all its connecting roads. Every
    patch is a ``TrafficSpace`` or an ``AuxiliaryTrafficSpace`` with its area, marks are
    ``Marking`` surfaces of the section. A feature that lies in several chunks is cut: triangles
    go to the chunk of their centroid, centre lines are cut at the border, and the ids of the
    pieces end in the chunk's name.

    Args:
        chunk: The tile.
        surface: All roads.
        profile: Colours and materials.
    """
    pieces = ChunkPieces(surface)
    inside = np.flatnonzero(pieces.triangles_in(chunk))
    order = np.argsort(surface.triangle_patch[inside], kind="stable")
    inside = inside[order]
    numbers, starts = np.unique(surface.triangle_patch[inside], return_index=True)
    triangles = dict(zip(numbers.tolist(), np.split(inside, starts)[1:], strict=True))
    lanes = {lane.id: lane for lane in surface.lanes}
    parts: dict[_Key, _Part] = {}
    for index, patch in enumerate(surface.patches):
        lane = lanes.get(patch.id)
        runs = [run for tile, run in pieces.runs(lane) if tile == chunk] if lane else []
        if index not in triangles and not runs:
            continue
        polygons = patch_polygons(
            surface.vertices, surface.triangles[triangles.get(index, np.empty(0, np.int64))]
        )
        part = parts.setdefault(_key(patch), _Part())
        name = piece_name(patch.id, pieces.chunks_of([index]), chunk)
        if patch.kind == "mark":
            part.marks.append(_mark(name, patch, polygons, profile))
        else:
            space = _space(name, patch, polygons, profile)
            part.spaces.append(
                _with_lane(space, lane, runs, pieces, chunk) if lane is not None else space
            )
    return _roads(parts, surface, pieces, chunk)


def _key(patch: Patch) -> _Key:
    """Junction, road and section that a patch belongs to; in a junction no road owns it alone."""
    return (patch.junction, "", 0) if patch.junction else ("", patch.road, patch.section)


def _space(name: str, patch: Patch, polygons: Polygons, profile: Profile) -> CityObject:
    codes = lane_codes(patch, profile)
    surfaces = (_area(name, patch, polygons, codes),) if len(polygons) else ()
    usage: dict[str, Attribute] = {"usage": codes.usage} if codes.usage else {}
    return CityObject(
        id=name,
        kind=codes.space,
        attributes={
            "function": codes.function,
            **usage,
            "granularity": "lane",
            "spaceType": "open",
            **_origin(patch),
        },
        surfaces=surfaces,
    )


def _area(name: str, patch: Patch, polygons: Polygons, codes: LaneCodes) -> ThematicSurface:
    attributes: dict[str, Attribute] = {"function": codes.function}
    if codes.usage:
        attributes["usage"] = codes.usage
    if codes.surface_material:
        attributes["surfaceMaterial"] = codes.surface_material
    attributes |= {"opendrive_kind": patch.kind, "opendrive_lane_type": patch.lane_type}
    return ThematicSurface(f"{name}_area", codes.area, polygons, _LOD, codes.material, attributes)


def _mark(name: str, patch: Patch, polygons: Polygons, profile: Profile) -> ThematicSurface:
    colour = mark_colour(patch, profile)
    attributes: dict[str, Attribute] = {
        "class": patch.mark_type,
        "colour": colour,
        "opendrive_kind": patch.kind,
        **_origin(patch),
    }
    return ThematicSurface(name, "Marking", polygons, _LOD, mark_material(colour), attributes)


def _origin(patch: Patch) -> dict[str, Attribute]:
    """Where a patch comes from in the OpenDRIVE file."""
    facts: dict[str, Attribute] = {"opendrive_lane_type": patch.lane_type}
    if patch.road:
        facts["opendrive_road"] = patch.road
    if patch.section >= 0:
        facts |= {"opendrive_section": patch.section, "opendrive_lane": patch.lane}
    if patch.junction:
        facts["opendrive_junction"] = patch.junction
    return facts


def _with_lane(
    space: CityObject, lane: LaneLine, runs: list[FloatArray], pieces: ChunkPieces, chunk: Chunk
) -> CityObject:
    """Adds a lane's centre line, direction, speed and neighbours."""
    attributes = dict(space.attributes)
    if space.kind == "TrafficSpace":
        attributes["trafficDirection"] = "both" if lane.lane_type in _BOTH_WAYS else "forwards"
    if lane.speed > 0.0:
        attributes["speed"] = lane.speed
    return replace(
        space,
        attributes=attributes,
        curves={"lod2MultiCurve": tuple(runs)} if runs else {},
        relations=pieces.neighbours(lane, chunk),
    )


def _roads(
    parts: dict[_Key, _Part], surface: RoadSurface, pieces: ChunkPieces, chunk: Chunk
) -> tuple[CityObject, ...]:
    keys = [_key(patch) for patch in surface.patches]

    def piece(name: str, *start: str | int) -> str:
        """Name of the piece in this chunk of all patches whose key begins like that."""
        indices = [i for i, key in enumerate(keys) if key[: len(start)] == start]
        return piece_name(name, pieces.chunks_of(indices), chunk)

    tops: dict[tuple[str, str], list[CityObject]] = {}
    for key, part in parts.items():
        junction, road, section = key
        name = f"Intersection_{ncname(junction)}" if junction else _section_name(road, section)
        kind = "Intersection" if junction else "Section"
        child = CityObject(
            piece(name, *key), kind, surfaces=tuple(part.marks), children=_sorted(part.spaces)
        )
        tops.setdefault((junction, road), []).append(child)
    roads = []
    for (junction, road), children in tops.items():
        name = f"Junction_{ncname(junction)}" if junction else f"Road_{ncname(road)}"
        facts = {"opendrive_junction": junction} if junction else {"opendrive_road": road}
        top = CityObject(piece(name, junction, road), "Road", facts, children=tuple(children))
        roads.append(top)
    return tuple(roads)


def _section_name(road: str, section: int) -> str:
    return f"Section_{ncname(road)}_{section}" if section >= 0 else f"Section_{ncname(road)}_all"


def _sorted(spaces: list[CityObject]) -> tuple[CityObject, ...]:
    """Traffic spaces first, as the CityGML file has them."""
    return tuple(sorted(spaces, key=lambda space: space.kind != "TrafficSpace"))
