"""Texture coordinates of the walls between land and water."""

import numpy as np
import shapely

from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.ground import GroundMesh

_AHEAD = 0.01
"""Metres ahead of the middle of a wall where its line is asked for its direction."""


def wall_uv(ground: GroundMesh) -> FloatArray:
    """Texture coordinates of the corners of all walls of a mesh, C x 2, metres.

    u runs along each wall around its bends, v is the height.
    """
    sizes = ground.face_sizes[ground.is_wall]
    corners = ground.vertices[ground.face_vertices[-int(sizes.sum()) :]]
    first = np.cumsum(sizes) - sizes
    ends = np.stack([corners[first, :2], corners[first + 1, :2]], axis=1)
    lines = shapely.get_parts(
        shapely.line_merge(shapely.multilinestrings(shapely.linestrings(ends)))
    )
    middles, along = ends.mean(axis=1), ends[:, 1] - ends[:, 0]
    length = np.hypot(*along.T)
    line = lines[
        shapely.STRtree(lines).query_nearest(shapely.points(middles), all_matches=False)[1]
    ]
    at = shapely.line_locate_point(line, shapely.points(middles))
    step = _AHEAD * along / length[:, None]
    ahead = shapely.line_locate_point(line, shapely.points(middles + step))
    forward = np.where(ahead > at, 1.0, -1.0)
    wall = np.repeat(np.arange(len(sizes)), sizes)
    from_middle = ((corners[:, :2] - middles[wall]) * (along / length[:, None])[wall]).sum(axis=1)
    return np.column_stack([at[wall] + forward[wall] * from_middle, corners[:, 2]])
