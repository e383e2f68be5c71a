"""The ground as CityGML: landuse features and relief."""

import numpy as np

from envgen_usd.city.roads.patch_polygons import patch_polygons
from envgen_usd.geometry.polygon_triangles import triangulate
from envgen_usd.models.array_types import IntArray
from envgen_usd.models.attribute_values import Attribute
from envgen_usd.models.city_model import CityObject
from envgen_usd.models.environment_profile import Profile
from envgen_usd.models.ground import GroundMesh
from envgen_usd.models.landuse import QUAY_WALL, STAND_INS, WALL_MATERIAL, LanduseClass, LanduseMap
from envgen_usd.models.polygon_arrays import Polygons

_RELIEF_LOD = 3
_SURFACE = "lod3MultiSurface"


def make_land(ground: GroundMesh, landuse: LanduseMap, profile: Profile) -> tuple[CityObject, ...]:
    """Returns a ``LandUse`` for each class of a chunk, and its ground as ``TINRelief``.

    Walls at water are a class of their own, `QUAY_WALL`.

    Coplanar ground becomes a single polygon with all vertices of its border. The features thus stay
    watertight with each other and with the road; the relief has the same borders.

    Args:
        ground: Ground of the chunk, without the road.
        landuse: Classes of its cells.
        profile: Materials of the classes.
    """
    triangles, face = _triangles(ground)
    cells = landuse.classes.reshape(-1)[ground.face_cell[face]]
    is_wall = ground.is_wall[face]
    kinds = [LanduseClass(value) for value in np.unique(cells[~is_wall]).tolist()]
    parts = [
        (kind.name.lower(), _material(profile, kind), (cells == kind) & ~is_wall) for kind in kinds
    ]
    if ground.walls:
        material = profile.ground_materials.get(QUAY_WALL, WALL_MATERIAL)
        parts.append((QUAY_WALL, material, is_wall))
    features, shapes = [], []
    for name, material, chosen in parts:
        polygons = patch_polygons(ground.vertices, triangles[chosen])
        shapes.append(polygons)
        facts: dict[str, Attribute] = {"class": name, "material": material}
        features.append(
            CityObject(
                f"landuse_{landuse.chunk.prim_name}_{name}",
                "LandUse",
                facts,
                geometry={_SURFACE: polygons},
            )
        )
    return (*features, _relief(landuse.chunk.prim_name, shapes)) if features else ()


def _material(profile: Profile, kind: LanduseClass) -> str:
    like = STAND_INS.get(kind, kind).name.lower()
    return profile.ground_materials.get(kind.name.lower(), profile.ground_materials.get(like, ""))


def _triangles(ground: GroundMesh) -> tuple[IntArray, IntArray]:
    """Triangles, T x 3, of the faces with split quads, and the face of each."""
    starts = np.cumsum(ground.face_sizes) - ground.face_sizes
    three, four = (np.flatnonzero(ground.face_sizes == size) for size in (3, 4))
    corners = ground.face_vertices
    pieces = [
        corners[starts[faces, None] + np.array(places)]
        for faces, places in ((three, [0, 1, 2]), (four, [0, 1, 2]), (four, [0, 2, 3]))
    ]
    return np.concatenate(pieces), np.concatenate([three, four, four])


def _relief(chunk: str, shapes: list[Polygons]) -> CityObject:
    pieces = [shape.points[triangulate(shape)[0]].reshape(-1, 3) for shape in shapes]
    corners = np.concatenate(pieces)
    tin = Polygons.of_triangles(corners, np.arange(len(corners), dtype=np.int64).reshape(-1, 3))
    part = CityObject(
        f"relief_{chunk}_tin", "TINRelief", {"lod": _RELIEF_LOD}, geometry={"tin": tin}
    )
    return CityObject(f"relief_{chunk}", "ReliefFeature", {"lod": _RELIEF_LOD}, children=(part,))
