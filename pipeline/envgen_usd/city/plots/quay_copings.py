"""Copings: bands of stone along the upper edges of quay walls."""

import numpy as np
import shapely

from envgen_usd.chunks import CHUNK_SIZE, GRID
from envgen_usd.city.plots.enclosures import spaced_line
from envgen_usd.city.plots.strip_bodies import as_polygons, mitres, strip_body
from envgen_usd.models.array_types import BoolArray, FloatArray
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
"""Least length of a coping that does not go on in the next chunk, metres."""
_LEAST_END = 3.0
"""Least distance of a bend from the border of its chunk, metres.

Borders of water bend by up to 0.4 m there; a larger value follows them less and evens them out."""
_LEAST_ANGLE = np.radians(25.0)
"""Least angle of a coping with the border of its chunk along which its end is cut."""
_MATERIAL = "curb_stone"
# SIG3D code list CityFurniture_function: other.
_OTHER = "1540"


def place_copings(ground: GroundMesh) -> tuple[CityObject, ...]:
    """Returns the copings of a chunk's quay walls as ``CityFurniture``, one for each line.

    Those of neighbouring chunks meet along the border, where their ends are cut.

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
        ends = shapely.get_coordinates(line)[[0, -1]]
        if line.length < _LEAST_LENGTH and not _at_border(ground, ends).any():
            continue
        places = shapely.get_coordinates(shapely.simplify(line, _STRAIGHT), include_z=True)
        if line.is_closed:
            places = _opened(places)
        places = _with_long_ends(ground, spaced_line(places))
        if not np.diff(places[:, :2], axis=0).any(axis=1).all():
            # A pool that is smaller than the stones around it.
            continue
        # Water lies to the left of the line.
        plan, height = places[:, :2], places[:, 2]
        across = _cut_at_border(ground, plan)
        middle = plan - (WIDTH / 2.0 - OVERHANG) * across
        faces = strip_body(middle, WIDTH, height + HEIGHTS[0], height + HEIGHTS[1], across)
        facts = {"function": _OTHER, "template": "wall", "material": _MATERIAL}
        name = f"coping_{ground.chunk.prim_name}_{number}"
        found.append(
            CityObject(
                name, "CityFurniture", facts, geometry={"lod2MultiSurface": as_polygons(faces)}
            )
        )
    return tuple(found)


def _at_border(ground: GroundMesh, places: FloatArray) -> BoolArray:
    """Which places (... x 2) lie on a border of the chunk across x, and across y."""
    low = np.array(ground.chunk.origin)
    on: BoolArray = (np.abs(places - low) < GRID) | (np.abs(places - low - CHUNK_SIZE) < GRID)
    return on


def _with_long_ends(ground: GroundMesh, places: FloatArray) -> FloatArray:
    """A line (N x 3) without bends so near to the chunk's border that its end could not be cut."""
    kept = np.ones(len(places), dtype=bool)
    for end in (0, -1):
        if _at_border(ground, places[end, :2]).any():
            away = np.linalg.norm(places[:, :2] - places[end, :2], axis=1)
            kept &= away >= _LEAST_END
    kept[[0, -1]] = True
    line: FloatArray = places[kept]
    return line


def _cut_at_border(ground: GroundMesh, plan: FloatArray) -> FloatArray:
    """Vectors from a line (N x 2) to 1 m left of it, along the border of the chunk at its ends.

    Where the line meets the border at a small angle, and in corners of chunks, ends are square.
    """
    across = mitres(plan)
    for end, inner in ((0, 1), (-1, -2)):
        on = _at_border(ground, plan[end])
        if on.sum() != 1:
            continue
        along = plan[inner] - plan[end]
        length = float(np.hypot(*along))
        border = on[::-1].astype(float)
        left = across[end]
        slope = float(left @ border)
        # The slanted end must not reach beyond the next bend.
        ahead = WIDTH * np.sqrt(max(1.0 - slope**2, 0.0)) / max(abs(slope), 1e-9)
        if abs(slope) > np.sin(_LEAST_ANGLE) and ahead < length:
            across[end] = border / slope
    return across


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
