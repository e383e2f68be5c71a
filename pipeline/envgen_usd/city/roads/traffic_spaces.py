"""Patches of the road surface as traffic spaces with their areas, and as markings."""

from dataclasses import dataclass, replace

import numpy as np

from envgen_usd.chunks import Chunk
from envgen_usd.city.roads.area_solids import hull_solid, strip_solid
from envgen_usd.city.roads.chunk_pieces import ChunkPieces, piece_name
from envgen_usd.city.roads.lane_codes import LaneCodes, lane_codes, mark_colour, mark_material
from envgen_usd.city.roads.road_index import RoadIndex
from envgen_usd.city.roads.street_materials import street_materials
from envgen_usd.city.roads.traffic_solids import clearance, lane_solid, strip_borders
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.attribute_values import Attribute
from envgen_usd.models.city_model import CityObject, ThematicSurface
from envgen_usd.models.environment_profile import Profile
from envgen_usd.models.polygon_arrays import Polygons
from envgen_usd.models.road_surface import LaneLine, Patch

_LOD = 2
_BOTH_WAYS = frozenset(("bidirectional", "sidewalk", "walking", "shared"))


@dataclass(frozen=True)
class RoadDetail:
    """Content of roads besides surfaces and centre lines.

    Attributes:
        solids: Free space above each area as ``lod2Solid``; doubles the size of the file. Areas
            without a centre line become a space for each connected part.
        lines: Reference lines and lane borders as ``GenericLogicalSpace``.
    """

    solids: bool = False
    lines: bool = False


@dataclass(frozen=True)
class RoadPart:
    """Inputs of a chunk's traffic spaces.

    Attributes:
        chunk: The tile.
        roads: All roads, by place.
        profile: Colours and materials.
        detail: What is written.
        seed: The user's seed.
    """

    chunk: Chunk
    roads: RoadIndex
    profile: Profile
    detail: RoadDetail
    seed: int

    @property
    def pieces(self) -> ChunkPieces:
        """The roads, cut into chunks."""
        return self.roads.pieces


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
        patch: Any patch except a mark.
        polygons: Its piece of the surface; empty if only the centre line lies in the chunk.
        lane: Its centre line, if it is a lane.
        part: Inputs shared by the chunk.
    """
    street = street_materials(patch, part.profile.road, part.seed)
    codes = lane_codes(patch, part.profile, street)
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
    """Free space above a lane or a zebra; `None` for other areas, and for lanes of several runs."""
    height = clearance(patch.lane_type)
    runs = part.pieces.runs(lane) if lane is not None else []
    inside = [run for tile, run in runs if tile == part.chunk]
    if lane is not None and len(inside) == 1:
        line, width = inside[0], _widths(lane, inside[0])
        return lane_solid(line, width, height) or strip_solid(*strip_borders(line, width), height)
    # People cross between the stripes of a zebra too.
    striped = patch.kind == "crosswalk" and patch.colour and len(polygons)
    return hull_solid(polygons, height) if striped else None


def _widths(lane: LaneLine, run: FloatArray) -> FloatArray:
    """Width of a lane at each point of a piece of its centre line."""
    steps = np.linalg.norm(np.diff(lane.points, axis=0), axis=1)
    s = np.concatenate([[0.0], np.cumsum(steps)])
    start = s[np.argmin(((lane.points - run[0]) ** 2).sum(axis=1))]
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(run, axis=0), axis=1))])
    widths: FloatArray = np.interp(start + along, s, lane.width)
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
    """Source of a patch in the OpenDRIVE file."""
    facts: dict[str, Attribute] = {"opendrive_lane_type": patch.lane_type}
    if patch.road:
        facts["opendrive_road"] = patch.road
    if patch.section >= 0:
        facts |= {"opendrive_section": patch.section, "opendrive_lane": patch.lane}
    if patch.junction:
        facts["opendrive_junction"] = patch.junction
    if patch.origin is not None:
        facts["opendrive_id"] = patch.origin.id
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
    for role, names in part.roads.ways.get(lane.id, {}).items():
        lanes = tuple(filter(None, (part.pieces.reference(n, part.chunk) for n in names)))
        relations |= {role: lanes} if lanes else {}
    return replace(
        space,
        attributes=attributes,
        curves={"lod2MultiCurve": tuple(runs)} if runs else {},
        relations=relations,
    )


def _with_walks(space: CityObject, patch: Patch, part: RoadPart) -> CityObject:
    """Adds the paths over a crosswalk, which pedestrians use in both directions."""
    ids = tuple(
        piece_name(name, chunks, part.chunk)
        for name in part.roads.walks.get(patch.id, ())
        if part.chunk in (chunks := part.pieces.chunks_of_patch(name))
    )
    if not ids:
        return space
    relations = dict(space.relations)
    for role in ("predecessor", "successor"):
        relations[role] = (*relations.get(role, ()), *ids)
    return replace(space, relations=relations)
