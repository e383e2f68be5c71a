"""The road surface as CityGML: roads, sections, intersections, traffic spaces and markings."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache

from envgen_usd.chunks import Chunk
from envgen_usd.city.feature_ids import ncname
from envgen_usd.city.roads.area_solids import connected_parts
from envgen_usd.city.roads.chunk_pieces import piece_name
from envgen_usd.city.roads.intersections import junction_facts, junction_lines
from envgen_usd.city.roads.logical_spaces import make_lines
from envgen_usd.city.roads.patch_polygons import patch_polygons
from envgen_usd.city.roads.road_constructions import BODY, make_body
from envgen_usd.city.roads.road_index import RoadIndex, RoadKey, road_key
from envgen_usd.city.roads.space_solids import with_solids
from envgen_usd.city.roads.traffic_spaces import RoadDetail, RoadPart, make_mark, make_space
from envgen_usd.models.city_model import CityObject, ThematicSurface
from envgen_usd.models.environment_profile import Profile
from envgen_usd.models.polygon_arrays import Polygons
from envgen_usd.models.road_surface import KERBS, JunctionSite, LaneLine, Patch

_DEFAULT = RoadDetail()


@dataclass
class _Section:
    """Content of a section or an intersection."""

    spaces: list[CityObject] = field(default_factory=list)
    marks: list[ThematicSurface] = field(default_factory=list)


def make_roads(
    chunk: Chunk,
    roads: RoadIndex,
    profile: Profile,
    detail: RoadDetail = _DEFAULT,
    seed: int = 0,
) -> tuple[CityObject, ...]:
    """Returns the roads of a chunk.

    Each OpenDRIVE road is a ``Road`` with a ``Section`` for each lane section. Each junction is a
    ``Road`` with an ``Intersection`` that holds the lanes of all its connecting roads; the incoming
    roads refer to it. A junction without connecting roads holds the reference lines instead. Every
    patch is a ``TrafficSpace`` or an ``AuxiliaryTrafficSpace`` with its area, and marks are
    ``Marking`` surfaces of the section. Bodies of bridges and tubes of tunnels are separate
    ``Bridge`` and ``Tunnel`` features. A feature across several chunks is cut: triangles go to the
    chunk of their centroid, and centre lines are cut at the border. The ids of the pieces end in
    the chunk's name.

    Args:
        chunk: The tile; `UNCUT` for the whole map, where the index cuts nothing.
        roads: All roads.
        profile: Colours and materials.
        detail: Content besides surfaces and centre lines.
        seed: The user's seed.
    """
    part, pieces, surface = (
        RoadPart(chunk, roads, profile, detail, seed),
        roads.pieces,
        roads.surface,
    )
    sections: dict[RoadKey, _Section] = {}
    bodies = []
    for index, triangles in pieces.patches_in(chunk):
        patch = surface.patches[index]
        polygons = patch_polygons(surface.vertices, surface.triangles[triangles])
        name = piece_name(patch.id, pieces.chunks_of(index), chunk)
        if patch.kind == BODY:
            bodies.append(make_body(name, patch, polygons))
            continue
        section = sections.setdefault(road_key(patch), _Section())
        if patch.kind == "mark":
            section.marks.append(make_mark(name, patch, polygons, part))
        else:
            lane = pieces.lanes.get(patch.id)
            for number, area in enumerate(_parts(patch, polygons, lane, detail), start=1):
                part_name = name if number == 1 else f"{name}_part_{number}"
                section.spaces.append(make_space(part_name, patch, area, lane, part))
    for lane in _lanes_without_area(part):
        patch, name = _patch_of(lane), pieces.lane_name(lane, chunk)
        section = sections.setdefault(road_key(patch), _Section())
        section.spaces.append(make_space(name, patch, Polygons.of_rings([]), lane, part))
    if detail.solids:
        for section in sections.values():
            section.spaces = with_solids(section.spaces)
    features = (*_roads(sections, part), *bodies)
    return (*features, *make_lines(part)) if detail.lines else features


def _parts(
    patch: Patch, polygons: Polygons, lane: LaneLine | None, detail: RoadDetail
) -> list[Polygons]:
    """Areas of a patch that get a space each: a solid is connected."""
    whole = lane is not None or patch.kind in {"crosswalk", *KERBS}
    return [polygons] if whole or not detail.solids else connected_parts(polygons)


def _lanes_without_area(part: RoadPart) -> list[LaneLine]:
    """Lanes in the chunk that own no area, as others of the junction lie over them."""
    lanes = part.pieces.lanes_in(part.chunk)
    return [lane for lane in lanes if not part.pieces.has_area(lane.id)]


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


def _roads(sections: dict[RoadKey, _Section], part: RoadPart) -> tuple[CityObject, ...]:
    """Roads with their sections, and junctions with their intersections."""
    naming = _naming(part)
    bare = part.roads.junctions_without_area(part.chunk)
    tops: dict[tuple[str, str], list[CityObject]] = {}
    for key, section in (sections | {(name, "", 0): _Section() for name in bare}).items():
        site = part.roads.sites.get(key[0])
        lines = junction_lines(site, part.roads.lines) if site and key[0] in bare else ()
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
    roads = []
    for (junction, road), children in tops.items():
        facts = {"opendrive_junction": junction} if junction else {"opendrive_road": road}
        ends = sorted(part.roads.reached.get(road, set()) & there) if road else []
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


def _met(
    site: JunctionSite, roads: set[str], naming: Callable[..., str]
) -> dict[str, tuple[str, ...]]:
    """Incoming roads of a junction in the chunk, by role."""
    names = {road: naming("", road) for road in site.roads if road in roads}
    main = names.pop(site.main_road, "")
    roads_by_role = {"mainRoad": (main,) if main else (), "connectedRoad": tuple(names.values())}
    return {role: ids for role, ids in roads_by_role.items() if ids}


def _naming(part: RoadPart) -> Callable[..., str]:
    """Function that names the piece in the chunk of what a key, or its beginning, stands for."""

    def name(junction: str, road: str, section: int | None = None) -> str:
        whole = ncname(junction or road)
        if section is None:
            plain = f"Junction_{whole}" if junction else f"Road_{whole}"
        elif junction:
            plain = f"Intersection_{whole}"
        else:
            plain = f"Section_{whole}_{section if section >= 0 else 'all'}"
        return piece_name(plain, part.roads.chunks_of(junction, road, section), part.chunk)

    return cache(name)


def _sorted(spaces: list[CityObject]) -> tuple[CityObject, ...]:
    """Sorts traffic spaces first, as in the CityGML file."""
    return tuple(sorted(spaces, key=lambda space: space.kind != "TrafficSpace"))
