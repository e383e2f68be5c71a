"""Road network to one watertight road surface."""

import itertools
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from envgen_usd.errors import EnvgenError, Issue
from envgen_usd.models.road import RoadNetwork
from envgen_usd.models.surface import RoadSurface
from envgen_usd.opendrive.arrangement import arrange
from envgen_usd.opendrive.as_built import closed_carriageways
from envgen_usd.opendrive.bridges import bridge_body
from envgen_usd.opendrive.corners import corner_strips
from envgen_usd.opendrive.cover import cover_faces
from envgen_usd.opendrive.cover_marks import paint_faces
from envgen_usd.opendrive.cross_paths import cross_path_strips
from envgen_usd.opendrive.holes import fill_holes
from envgen_usd.opendrive.islands import island_strips
from envgen_usd.opendrive.junction_boundary import boundary_strips
from envgen_usd.opendrive.junction_heights import grid_lines
from envgen_usd.opendrive.junction_paving import pave_junctions
from envgen_usd.opendrive.junction_sites import junction_sites
from envgen_usd.opendrive.lane_lines import lane_lines
from envgen_usd.opendrive.layer_marks import layer_mark_strips
from envgen_usd.opendrive.levels import Stretch, find_stretches, level_cuts
from envgen_usd.opendrive.marks import mark_strips
from envgen_usd.opendrive.mesh import Mesh, join_levels, lift
from envgen_usd.opendrive.paint import paint_strips
from envgen_usd.opendrive.road_lines import road_lines
from envgen_usd.opendrive.strips import (
    SectionGrid,
    Strip,
    lane_strips,
    part_of_grid,
    section_grids,
    used_borders,
)
from envgen_usd.opendrive.transitions import transitions
from envgen_usd.opendrive.tunnels import tunnel_tubes

_SOLID = frozenset(("filler", "island"))


def build_surface(network: RoadNetwork, tolerance: float = 0.02) -> RoadSurface:
    """Turns all roads into one surface.

    1. Every lane and every mark becomes a strip with rows where its curvature asks for them.
    2. On each level (ground, decks, tunnels) the strips' borders cut each other in plan; each face
       goes to the lane that wins there.
    3. Small holes are filled; faces get heights, and kerb faces close the steps between them.

    Args:
        network: The roads.
        tolerance: Largest distance in metres between the surface's edges and the road's curves.

    Raises:
        EnvgenError: No road has any area.
    """
    grids = [grid for road in network.roads.values() for grid in section_grids(road, tolerance)]
    meshes, found = _meshes(network, grids, tolerance)
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
        issues=(*closed_carriageways(network), *found),
    )


def _meshes(
    network: RoadNetwork, grids: Sequence[SectionGrid], tolerance: float
) -> tuple[dict[int, Mesh], list[Issue]]:
    """The surface of each level, and what was odd in it."""
    stretches = find_stretches(network, grids)
    things = _things_by_level(network, stretches, tolerance)
    meshes: dict[int, Mesh] = {}
    issues: list[Issue] = []
    for level, parts in sorted(_grids_by_level(grids, stretches).items()):
        lanes, unpaved = pave_junctions(parts, list(_lanes_at(level, parts)))
        if lanes:
            closing, found = transitions(network, parts)
            issues += [*found, *unpaved]
            around = boundary_strips(network, tolerance) if level == 0 else ()
            strips = [*lanes, *corner_strips(network, parts), *closing, *around]
            marks = [strip for grid in parts for strip in mark_strips(grid)]
            meshes[level] = _mesh(network, strips, marks, things.get(level, []))
    return meshes, issues


def _lanes_at(level: int, grids: Sequence[SectionGrid]) -> Iterator[Strip]:
    """Strips of lanes; a deck carries no land beside its road."""
    for grid in grids:
        first, last = used_borders(grid) if level > 0 else (0, len(grid.borders.lanes))
        carried = {lane.id for lane in grid.borders.lanes[first:last]}
        yield from (strip for strip in lane_strips(grid) if strip.patch.lane in carried)


def _bodies(meshes: Mapping[int, Mesh], grids: Sequence[SectionGrid]) -> Iterator[tuple[int, Mesh]]:
    """What is under and over the road: bodies of bridges, tubes of tunnels."""
    for level, mesh in meshes.items():
        if level > 0:
            yield level, bridge_body(mesh, [other for at, other in meshes.items() if at != level])
    for tube in tunnel_tubes(grids):
        yield 1, tube


def _grids_by_level(
    grids: Sequence[SectionGrid], stretches: Mapping[str, Sequence[Stretch]]
) -> dict[int, list[SectionGrid]]:
    """Sections, cut where their road leaves the ground."""
    found: dict[int, list[SectionGrid]] = {}
    for grid in grids:
        for start, end, level in level_cuts(stretches, grid):
            found.setdefault(level, []).append(part_of_grid(grid, start, end))
    return found


def _things_by_level(
    network: RoadNetwork, stretches: Mapping[str, Sequence[Stretch]], tolerance: float
) -> dict[int, list[Strip]]:
    """What lies on the permanent lanes and their marks."""
    found: dict[int, list[Strip]] = {}
    for road in network.roads.values():
        for s, strip in itertools.chain(
            layer_mark_strips(road, tolerance), paint_strips(road), island_strips(road)
        ):
            levels = [level for a, b, level in stretches.get(road.id, ()) if a <= s <= b]
            found.setdefault(levels[0] if levels else 0, []).append(strip)
    found.setdefault(0, []).extend(cross_path_strips(network))
    return found


def _mesh(
    network: RoadNetwork, lanes: Sequence[Strip], marks: Sequence[Strip], things: Sequence[Strip]
) -> Mesh:
    """One level: what lies on it is surface itself, as bays and islands, or painted last."""
    strips = [*lanes, *(one for one in things if one.patch.kind in _SOLID)]
    paint = [one for one in things if one.patch.kind not in _SOLID]
    # Later ones lie over earlier ones: a crosswalk without colour takes no mark away.
    bare = [one for one in paint if _is_bare(one)]
    marks = [*bare, *marks, *(one for one in paint if not _is_bare(one))]
    gridded = [one for one in network.junctions.values() if one.elevation_grid is not None]
    lines = np.concatenate([np.empty((0, 2, 2)), *(grid_lines(one) for one in gridded)])
    faces = arrange(strips, marks, lines)
    cover = fill_holes(faces, cover_faces(faces, strips), strips)
    return lift(faces, paint_faces(faces, cover, strips, marks), strips, gridded)


def _is_bare(strip: Strip) -> bool:
    """Whether a strip is a crosswalk that is not painted itself."""
    return strip.patch.kind == "crosswalk" and not strip.patch.colour
