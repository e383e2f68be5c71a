"""Builds the watertight road surface of a road network."""

import itertools
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from envgen_usd.cycle_collection import paused_collection
from envgen_usd.errors import EnvgenError, Issue
from envgen_usd.models.road import RoadNetwork
from envgen_usd.models.road_marks import RMS_MARKS, MarkRules
from envgen_usd.models.road_surface import LaneLine, RoadLine, RoadSurface
from envgen_usd.opendrive.geometry.built_lanes import (
    closed_carriageways,
    land_in_lanes,
    paved_borders,
)
from envgen_usd.opendrive.geometry.elevation_grid import grid_lines
from envgen_usd.opendrive.geometry.section_grids import (
    SectionGrid,
    part_of_grid,
    section_grids,
    used_borders,
)
from envgen_usd.opendrive.lanes.junction_sites import junction_sites
from envgen_usd.opendrive.lanes.lane_lines import lane_lines
from envgen_usd.opendrive.lanes.road_cross_sections import road_lines
from envgen_usd.opendrive.mesh.arrangement import arrange
from envgen_usd.opendrive.mesh.bridge_bodies import bridge_body
from envgen_usd.opendrive.mesh.filled_areas import filled_areas
from envgen_usd.opendrive.mesh.grade_separation import (
    Stretch,
    find_stretches,
    level_cuts,
    unnamed_bridges,
)
from envgen_usd.opendrive.mesh.lift import (
    Mesh,
    corner_heights,
    join_levels,
    lift,
    smoothed_junctions,
)
from envgen_usd.opendrive.mesh.overlap_removal import cover_faces
from envgen_usd.opendrive.mesh.painted_faces import hidden_marks, paint_faces
from envgen_usd.opendrive.mesh.small_holes import fill_holes
from envgen_usd.opendrive.mesh.tunnel_tubes import tunnel_tubes
from envgen_usd.opendrive.strips.cross_path_strips import cross_path_issues, cross_path_strips
from envgen_usd.opendrive.strips.junction_boundary import boundary_strips
from envgen_usd.opendrive.strips.junction_corners import corner_issues, corner_strips
from envgen_usd.opendrive.strips.junction_paving import pave_junctions
from envgen_usd.opendrive.strips.kerb_stones import kerb_stone_strips
from envgen_usd.opendrive.strips.lane_layer_marks import layer_mark_strips
from envgen_usd.opendrive.strips.lane_strips import Strip, lane_strips
from envgen_usd.opendrive.strips.lane_transitions import transitions
from envgen_usd.opendrive.strips.road_mark_strips import mark_strips, unsized_marks
from envgen_usd.opendrive.strips.road_overlays import overlay_strips
from envgen_usd.opendrive.strips.strip_index import Cells

_SOLID = frozenset(("parking", "island"))
"""Kinds of overlays that are surface where no lane is."""
_BARE = frozenset(("parking", "road_surface"))
"""Kinds of overlays that lie below all paint."""


@paused_collection()
def build_surface(
    network: RoadNetwork, tolerance: float = 0.02, marks: MarkRules = RMS_MARKS
) -> RoadSurface:
    """Builds a single surface from all roads.

    1. Each lane and mark becomes a strip; its rows follow the curvature.
    2. On each level (ground, bridge decks) a planar arrangement of the strips' borders gives
       disjoint faces. Each face belongs to the lane of highest priority.
    3. Small holes are filled, faces receive heights, and kerb faces close the height steps.

    Args:
        network: The roads.
        tolerance: Largest chord error in metres; a larger value gives fewer vertices.
        marks: Sizes of marks that the file leaves open, of an environment.

    Raises:
        EnvgenError: No road has an area.
    """
    grids = section_grids(network.roads.values(), tolerance)
    meshes, issues = _meshes(network, grids, tolerance, marks)
    if not meshes:
        raise EnvgenError(f"{network.name}: no road has a lane with a width; nothing to build.")
    mesh, triangle_level = join_levels([*meshes.items(), *_bodies(meshes, grids)])
    return RoadSurface(
        vertices=mesh.vertices,
        triangles=mesh.triangles,
        triangle_patch=mesh.triangle_patch,
        triangle_level=triangle_level,
        patches=mesh.patches,
        outline=mesh.outline,
        lanes=lane_lines(network, grids),
        roads=road_lines(grids),
        crs=network.geo_reference,
        offset=network.offset[:3],
        junctions=junction_sites(network),
        issues=tuple(issues),
    )


def street_lines(
    network: RoadNetwork, tolerance: float = 0.02
) -> tuple[tuple[LaneLine, ...], tuple[RoadLine, ...]]:
    """Returns the lanes and the reference lines of the surface without building it.

    Args:
        network: The roads.
        tolerance: As of `build_surface`.
    """
    grids = section_grids(network.roads.values(), tolerance)
    return lane_lines(network, grids), road_lines(grids)


def _meshes(
    network: RoadNetwork, grids: Sequence[SectionGrid], tolerance: float, rules: MarkRules
) -> tuple[dict[int, Mesh], list[Issue]]:
    """Builds the surface of each level; returns it with its issues."""
    stretches = find_stretches(network, grids)
    overlays = _overlays_by_level(network, stretches, tolerance, rules)
    crossings = list(cross_path_strips(network))
    overlays.setdefault(0, []).extend(crossings)
    meshes: dict[int, Mesh] = {}
    issues = [
        *closed_carriageways(network),
        *paved_borders(network),
        *land_in_lanes(network),
        *unsized_marks(network),
        *unnamed_bridges(network, stretches),
        *cross_path_issues(crossings),
    ]
    hidden: Counter[str] = Counter()
    for level, parts in sorted(_grids_by_level(grids, stretches).items()):
        lanes, unpaved = pave_junctions(parts, list(_lanes_at(level, parts)))
        if lanes:
            closing, gaps = transitions(network, parts)
            issues += [*gaps, *unpaved]
            around = boundary_strips(network, tolerance) if level == 0 else ()
            corners, stones = corner_strips(network, parts)
            strips = [*lanes, *corners, *closing, *around]
            stones += [strip for grid in parts for strip in kerb_stone_strips(grid)]
            marks = [strip for grid in parts for strip in mark_strips(grid, rules)]
            meshes[level], left_out = _mesh(
                network, strips, [*stones, *marks], overlays.get(level, [])
            )
            issues += corner_issues(corners)
            hidden += left_out
    issues += [
        *hidden_marks(hidden),
        *filled_areas(meshes.values()),
        *smoothed_junctions(meshes.values()),
    ]
    return meshes, issues


def _lanes_at(level: int, grids: Sequence[SectionGrid]) -> Iterator[Strip]:
    """Yields strips of lanes; a bridge deck excludes the land beside its road."""
    for grid in grids:
        first, last = used_borders(grid) if level > 0 else (0, len(grid.borders.lanes))
        carried = {lane.id for lane in grid.borders.lanes[first:last]}
        yield from (strip for strip in lane_strips(grid) if strip.patch.lane in carried)


def _bodies(meshes: Mapping[int, Mesh], grids: Sequence[SectionGrid]) -> Iterator[tuple[int, Mesh]]:
    """Yields the bodies of bridges and the tubes of tunnels with their levels."""
    for level, mesh in meshes.items():
        if level > 0:
            yield level, bridge_body(mesh, [other for at, other in meshes.items() if at != level])
    for tube in tunnel_tubes(grids):
        yield 1, tube


def _grids_by_level(
    grids: Sequence[SectionGrid], stretches: Mapping[str, Sequence[Stretch]]
) -> dict[int, list[SectionGrid]]:
    """Splits lane sections where their road changes its level."""
    by_level: dict[int, list[SectionGrid]] = {}
    for grid in grids:
        for start, end, level in level_cuts(stretches, grid):
            by_level.setdefault(level, []).append(part_of_grid(grid, start, end))
    return by_level


def _overlays_by_level(
    network: RoadNetwork,
    stretches: Mapping[str, Sequence[Stretch]],
    tolerance: float,
    rules: MarkRules,
) -> dict[int, list[Strip]]:
    """Returns strips of objects, signals, islands and temporary marks over the permanent lanes."""
    by_level: dict[int, list[Strip]] = {}
    for road in network.roads.values():
        for s, strip in itertools.chain(
            layer_mark_strips(road, tolerance, rules),
            overlay_strips(road, rules),
        ):
            levels = [level for a, b, level in stretches.get(road.id, ()) if a <= s <= b]
            by_level.setdefault(levels[0] if levels else 0, []).append(strip)
    return by_level


def _mesh(
    network: RoadNetwork, lanes: Sequence[Strip], marks: Sequence[Strip], overlays: Sequence[Strip]
) -> tuple[Mesh, Counter[str]]:
    """Builds a level, and counts by junction the marks that are left out.

    Islands and bays are surface, all overlays but islands cover lanes.
    """
    strips = [*lanes, *(strip for strip in overlays if strip.patch.kind in _SOLID)]
    paint = [strip for strip in overlays if strip.patch.kind != "island"]
    # Later paint covers earlier paint, so marks come after bays and crosswalks without colour.
    bare = [strip for strip in paint if _is_bare(strip)]
    marks = [*bare, *marks, *(strip for strip in paint if not _is_bare(strip))]
    gridded = [each for each in network.junctions.values() if each.elevation_grid is not None]
    lines = np.concatenate([np.empty((0, 2, 2)), *(grid_lines(each) for each in gridded)])
    faces = arrange(strips, marks, lines)
    cells = Cells(strips)
    cover = fill_holes(faces, cover_faces(faces, strips, cells), strips)
    painted, hidden = paint_faces(faces, cover, strips, marks)
    heights = corner_heights(faces, painted, strips, cells, gridded)
    del cells  # as large as the mesh that is to come
    return lift(faces, painted, heights), hidden


def _is_bare(strip: Strip) -> bool:
    """Returns whether a strip has no paint of its own."""
    bare = strip.patch.kind == "crosswalk" and not strip.patch.colour
    return bare or strip.patch.kind in _BARE
