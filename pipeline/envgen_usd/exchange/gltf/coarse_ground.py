"""Ground with fewer triangles, for a distance.

Vertices within a cell of a grid join (J. Rossignac and P. Borrel, "Multi-resolution 3D
approximations for rendering complex scenes", 1993). Those on a border stay where they are, so that
neighbouring chunks, roads and kinds of ground keep touching.
"""

from dataclasses import replace

import numpy as np

from envgen_usd.models.array_types import BoolArray, IntArray
from envgen_usd.render.render_scene import Geometry

_CELL = 8.0
"""Side of the cells, metres; a larger value leaves fewer triangles."""


def coarse_ground(ground: Geometry) -> Geometry:
    """The ground with one vertex for each cell away from its borders; its faces look upwards."""
    triangles = ground.triangles.astype(np.int64)
    moved = _representatives(ground, _on_border(triangles, len(ground.points)))
    joined = moved[triangles]
    first, second, third = joined.T
    kept = joined[(first != second) & (second != third) & (third != first)]
    corners = ground.points[kept][..., :2]
    along, aside = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = along[:, 0] * aside[:, 1] - along[:, 1] * aside[:, 0]
    kept = np.where(area[:, None] < 0.0, kept[:, ::-1], kept)
    used, numbers = np.unique(kept, return_inverse=True)
    return replace(
        ground,
        points=ground.points[used],
        normals=ground.normals[used],
        uvs=ground.uvs[used],
        colours=ground.colours[used],
        triangles=numbers.reshape(-1, 3).astype(np.uint32),
    )


def _on_border(triangles: IntArray, count: int) -> BoolArray:
    """Vertices at an edge of a single triangle."""
    edges = np.sort(
        np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    )
    keys, times = np.unique(edges[:, 0] * count + edges[:, 1], return_counts=True)
    single = keys[times == 1]
    border = np.zeros(count, bool)
    border[single // count] = True
    border[single % count] = True
    return border


def _representatives(ground: Geometry, border: BoolArray) -> IntArray:
    """The vertex that stands for each vertex: itself on a border, else the middle of its cell."""
    cells = np.floor(ground.points[:, :2] / _CELL)
    from_middle = np.linalg.norm(ground.points[:, :2] / _CELL - cells - 0.5, axis=1)
    inner = np.flatnonzero(~border)
    order = inner[np.lexsort((from_middle[inner], cells[inner, 1], cells[inner, 0]))]
    changes = np.any(np.diff(cells[order], axis=0, prepend=np.nan) != 0, axis=1)
    chosen: IntArray = np.arange(len(ground.points))
    starts = np.flatnonzero(changes)
    chosen[order] = np.repeat(order[starts], np.diff(starts, append=len(order)))
    return chosen
