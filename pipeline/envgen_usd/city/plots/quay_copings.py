"""Copings: bands of stone along the upper edges of quay walls."""

import numpy as np
import shapely

from envgen_usd.city.plots.enclosures import spaced_line
from envgen_usd.city.plots.strip_bodies import as_polygons, mitres, strip_body
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.city_model import CityObject
from envgen_usd.models.ground import GroundMesh

LEAST_WALL = 1.0
"""Height from which a wall has a coping, metres; lower ones are kerbs of ponds and streams."""
WIDTH = 0.6
"""Width of a coping, metres."""
OVERHANG = 0.08
"""Metres by which it reaches over the water."""
HEIGHTS = (-0.35, 0.12)
"""Heights of its underside and its top above the quay, metres."""
_STRAIGHT = 0.05
"""Largest distance of a wall's edge from the line of its coping, metres."""
_LEAST_LENGTH = 0.8
"""Least length of a coping, metres."""
_MATERIAL = "curb_stone"
# SIG3D code list CityFurniture_function: other.
_OTHER = "1540"


def place_copings(ground: GroundMesh) -> tuple[CityObject, ...]:
    """Returns the copings of a chunk's quay walls as ``CityFurniture``, one for each line.

    Args:
        ground: Ground of the chunk with its walls.
    """
    edges = _upper_edges(ground)
    if not len(edges):
        return ()
    lines = shapely.get_parts(
        shapely.line_merge(shapely.multilinestrings(shapely.linestrings(edges)), directed=True)
    )
    found = []
    for number, line in enumerate(lines):
        if line.length < _LEAST_LENGTH:
            continue
        places = shapely.get_coordinates(shapely.simplify(line, _STRAIGHT), include_z=True)
        if line.is_closed:
            places = _opened(places)
        places = spaced_line(places)
        if not np.diff(places[:, :2], axis=0).any(axis=1).all():
            # A pool that is smaller than the stones around it.
            continue
        # Water lies to the left of the line.
        plan, height = places[:, :2], places[:, 2]
        middle = plan - (WIDTH / 2.0 - OVERHANG) * mitres(plan)
        faces = strip_body(middle, WIDTH, height + HEIGHTS[0], height + HEIGHTS[1])
        facts = {"function": _OTHER, "template": "wall", "material": _MATERIAL}
        name = f"coping_{ground.chunk.prim_name}_{number}"
        found.append(
            CityObject(
                name, "CityFurniture", facts, geometry={"lod2MultiSurface": as_polygons(faces)}
            )
        )
    return tuple(found)


def _upper_edges(ground: GroundMesh) -> FloatArray:
    """Upper edges of the tall walls, E x 2 x 3; water lies to their left."""
    sizes = ground.face_sizes[ground.is_wall]
    corners = ground.vertices[ground.face_vertices[len(ground.face_vertices) - int(sizes.sum()) :]]
    first = (np.cumsum(sizes) - sizes)[sizes == 4]
    # Corners are the end and the start below, then the start and the end above.
    walls = corners[first[:, None] + np.arange(4)]
    tall = (walls[:, [3, 2], 2] - walls[:, [0, 1], 2]).min(axis=1) >= LEAST_WALL
    edges: FloatArray = walls[tall][:, [2, 3]]
    return edges


def _opened(ring: FloatArray) -> FloatArray:
    """A closed line that begins and ends in the middle of its longest side."""
    sides = np.linalg.norm(np.diff(ring[:, :2], axis=0), axis=1)
    longest = int(np.argmax(sides))
    middle = (ring[longest] + ring[longest + 1]) / 2.0
    others = np.roll(ring[:-1], -longest - 1, axis=0)
    return np.vstack([middle, others, middle])
