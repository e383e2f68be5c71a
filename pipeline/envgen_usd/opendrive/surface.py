"""Road network to one watertight road surface."""

import numpy as np

from envgen_usd.errors import EnvgenError
from envgen_usd.models.road import RoadNetwork
from envgen_usd.models.surface import RoadSurface
from envgen_usd.opendrive.arrangement import arrange
from envgen_usd.opendrive.cover import cover_faces
from envgen_usd.opendrive.holes import fill_holes
from envgen_usd.opendrive.lane_lines import lane_lines
from envgen_usd.opendrive.marks import mark_strips
from envgen_usd.opendrive.mesh import lift
from envgen_usd.opendrive.road_lines import road_lines
from envgen_usd.opendrive.strips import lane_strips, section_grids


def build_surface(network: RoadNetwork, tolerance: float = 0.02) -> RoadSurface:
    """Turns all roads into one surface.

    1. Every lane and every mark becomes a strip with rows where its curvature asks for them.
    2. The strips' borders cut each other in plan; each face goes to the lane that wins there.
    3. Small holes are filled; faces get heights, and kerb faces close the steps between them.

    Args:
        network: The roads.
        tolerance: Largest distance in metres between the surface's edges and the road's curves.

    Raises:
        EnvgenError: No road has any area.
    """
    grids = [grid for road in network.roads.values() for grid in section_grids(road, tolerance)]
    strips = [strip for grid in grids for strip in lane_strips(grid)]
    if not strips:
        raise EnvgenError(f"{network.name}: no road has a lane with a width; nothing to build.")
    strips += [strip for grid in grids for strip in mark_strips(grid)]
    faces = arrange(strips)
    cover = fill_holes(faces, cover_faces(faces, strips), strips)
    mesh = lift(faces, cover, strips)
    return RoadSurface(
        vertices=mesh.vertices,
        triangles=mesh.triangles,
        triangle_patch=mesh.triangle_patch,
        triangle_level=np.zeros(len(mesh.triangles), dtype=np.int64),
        patches=mesh.patches,
        outline=mesh.outline,
        lanes=lane_lines(network, grids),
        roads=road_lines(grids),
        crs=network.geo_reference,
        offset=network.offset[:3],
        issues=network.issues,
    )
