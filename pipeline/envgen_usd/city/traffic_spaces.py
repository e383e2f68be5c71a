"""Patches of the road surface as traffic spaces with their areas, and as markings."""

from dataclasses import dataclass, replace

import numpy as np

from envgen_usd.chunks import Chunk
from envgen_usd.city.chunk_pieces import ChunkPieces, piece_name
from envgen_usd.city.lane_codes import LaneCodes, lane_codes, mark_colour, mark_material
from envgen_usd.city.traffic_solids import clearance, lane_solid, raise_solid
from envgen_usd.models.arrays import FloatArray
from envgen_usd.models.city import Attribute, CityObject, ThematicSurface
from envgen_usd.models.polygons import Polygons
from envgen_usd.models.profile import Profile
from envgen_usd.models.surface import LaneLine, Patch, RoadSurface

_LOD = 2
_BOTH_WAYS = frozenset(("bidirectional", "sidewalk", "walking", "shared"))


@dataclass(frozen=True)
class RoadDetail:
    """What is written of roads besides surfaces and centre lines.

    Attributes:
        solids: The room above each lane as ``lod2Solid``; doubles the size of the file.
        lines: Reference lines and borders of lanes as ``GenericLogicalSpace``.
    """

    solids: bool = False
    lines: bool = False


@dataclass(frozen=True)
class RoadPart:
    """What the traffic spaces of a chunk are made from.

    Attributes:
        chunk: The tile.
        surface: All roads.
        profile: Colours and materials.
        pieces: The surface, cut into chunks.
        detail: What is written.
        links: Patches that pedestrians can go to from each patch.
        ways: Lanes that traffic can go to from places along each lane, and those it can come from.
    """

    chunk: Chunk
    surface: RoadSurface
    profile: Profile
    pieces: ChunkPieces
    detail: RoadDetail
    links: dict[str, tuple[str, ...]]
    ways: dict[str, dict[str, tuple[str, ...]]]


def make_mark(name: str, patch: Patch, polygons: Polygons, part: RoadPart) -> ThematicSurface:
    """Returns a road mark as ``Marking``."""
    colour = mark_colour(patch, part.profile)
    attributes: dict[str, Attribute] = {
        "class": patch.mark_type,
        "colour": colour,
        "opendrive_kind": patch.kind,
        **_origin(patch),
    }
    return ThematicSurface(name, "Marking", polygons, _LOD, mark_material(colour), attributes)


def make_space(
    name: str, patch: Patch, polygons: Polygons, lane: LaneLine | None, part: RoadPart
) -> CityObject:
    """Returns a patch as ``TrafficSpace`` or ``AuxiliaryTrafficSpace``.

    Args:
        name: gml:id.
        patch: Any but a mark.
        polygons: Its piece of the surface; may be empty where only the centre line passes.
        lane: Its centre line, if it is a lane.
        part: The rest of the road.
    """
    codes = lane_codes(patch, part.profile)
    attributes: dict[str, Attribute] = {"function": codes.function}
    if codes.usage:
        attributes["usage"] = codes.usage
    attributes |= {"granularity": "lane", "spaceType": "open", **_origin(patch)}
    surfaces = (_area(name, patch, polygons, codes),) if len(polygons) else ()
    solid = _solid(patch, polygons, lane, part) if part.detail.solids else None
    geometry = {"lod2Solid": solid} if solid is not None else {}
    space = CityObject(name, codes.space, attributes, surfaces, geometry=geometry)
    if lane is not None:
        space = _with_lane(space, lane, part)
    return _with_walks(space, patch, part)


def _solid(
    patch: Patch, polygons: Polygons, lane: LaneLine | None, part: RoadPart
) -> Polygons | None:
    """Room above a lane or a crosswalk; none where it is not one solid."""
    height = clearance(patch.lane_type)
    if lane is not None:
        runs = [run for tile, run in part.pieces.runs(lane) if tile == part.chunk]
        return lane_solid(runs[0], _widths(lane, runs[0]), height) if len(runs) == 1 else None
    whole = len(polygons) == 1 and patch.kind == "crosswalk"
    return raise_solid(polygons, height) if whole else None


def _widths(lane: LaneLine, run: FloatArray) -> FloatArray:
    """Width of a lane at each point of a piece of its centre line."""
    steps = np.linalg.norm(np.diff(lane.points, axis=0), axis=1)
    s = np.concatenate([[0.0], np.cumsum(steps)])
    start = s[np.argmin(((lane.points - run[0]) ** 2).sum(axis=1))]
    own = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(run, axis=0), axis=1))])
    widths: FloatArray = np.interp(start + own, s, lane.width)
    return widths


def _area(name: str, patch: Patch, polygons: Polygons, codes: LaneCodes) -> ThematicSurface:
    attributes: dict[str, Attribute] = {"function": codes.function}
    if codes.usage:
        attributes["usage"] = codes.usage
    if codes.surface_material:
        attributes["surfaceMaterial"] = codes.surface_material
    attributes |= {"opendrive_kind": patch.kind, "opendrive_lane_type": patch.lane_type}
    return ThematicSurface(f"{name}_area", codes.area, polygons, _LOD, codes.material, attributes)


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


def _with_lane(space: CityObject, lane: LaneLine, part: RoadPart) -> CityObject:
    """Adds a lane's centre line, direction, speed and neighbours."""
    attributes = dict(space.attributes)
    if space.kind == "TrafficSpace":
        attributes["trafficDirection"] = "both" if lane.lane_type in _BOTH_WAYS else "forwards"
    if lane.speed > 0.0:
        attributes["speed"] = lane.speed
    runs: list[FloatArray] = [run for tile, run in part.pieces.runs(lane) if tile == part.chunk]
    relations = part.pieces.neighbours(lane, part.chunk)
    for role, names in part.ways.get(lane.id, {}).items():
        found = tuple(filter(None, (part.pieces.reference(n, part.chunk) for n in names)))
        relations |= {role: found} if found else {}
    return replace(
        space,
        attributes=attributes,
        curves={"lod2MultiCurve": tuple(runs)} if runs else {},
        relations=relations,
    )


def _with_walks(space: CityObject, patch: Patch, part: RoadPart) -> CityObject:
    """Adds the ways over a crosswalk, which pedestrians use in both directions."""
    ids = tuple(
        piece_name(name, chunks, part.chunk)
        for name in part.links.get(patch.id, ())
        if part.chunk in (chunks := part.pieces.chunks_of_patch(name))
    )
    if not ids:
        return space
    relations = dict(space.relations)
    for role in ("predecessor", "successor"):
        relations[role] = (*relations.get(role, ()), *ids)
    return replace(space, relations=relations)
