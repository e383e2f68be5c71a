"""Writes the roads layer of a chunk: surfaces by meaning, and the centre lines of the lanes."""

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
from pxr import Sdf, Vt

from envgen_usd.assets.asset_catalogue import Catalogue
from envgen_usd.assets.polygon_mesh import Mesh, face_normals, flat_normals, vertex_normals, weld
from envgen_usd.assets.prim_authoring import (
    add_mesh,
    add_prim,
    apply_schemas,
    prim_names,
    set_attribute,
    set_class,
    set_collider,
    set_extents_hint,
    set_label,
    set_surface,
    union_extent,
)
from envgen_usd.assets.stage_schemas import ROAD
from envgen_usd.assets.usd_files import new_layer, write_layer
from envgen_usd.assets.usd_values import to_ints
from envgen_usd.chunks import GRID, Chunk
from envgen_usd.geometry.polygon_triangles import triangulate
from envgen_usd.layers.lane_curves import add_lanes
from envgen_usd.layers.payload_files import STEEP, find_materials, local, plan_uv, surface_uv
from envgen_usd.layers.road_meaning import RoadMeaning, road_meaning
from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.models.attribute_values import Attribute
from envgen_usd.models.city_model import City, CityObject, ThematicSurface
from envgen_usd.models.environment_profile import Profile
from envgen_usd.models.polygon_arrays import Polygons

ROAD_KINDS = ("Road", "Square", "Track", "Railway")


def write_roads(
    city: City, chunk: Chunk, profile: Profile, catalogue: Catalogue, path: Path
) -> None:
    """Writes ``/Roads``: a mesh for each meaning and material, and a curve for each lane.

    Args:
        city: City of the chunk.
        chunk: Tile.
        profile: Environment; gives materials that the city lacks.
        catalogue: Asset library.
        path: .usdc file, written atomically.

    Raises:
        EnvgenError: A material is missing from the library.
    """
    layer = new_layer("Roads")
    root = add_prim(layer, "Roads", "Xform", kind="group")
    groups = _group_surfaces(city, profile)
    where = f"roads of chunk {chunk.name} (environment {profile.country}/{profile.area})"
    materials = find_materials((meaning.material for meaning in groups), catalogue, where)
    extents = []
    names = prim_names(meaning.name for meaning in groups)
    for meaning in sorted(groups):
        surfaces = groups[meaning]
        points, triangles, source = _triangles([polygons for _, polygons in surfaces])
        size = materials[meaning.material].size
        mesh = _mesh(local(points, chunk), triangles, chunk, size)
        prim = add_mesh(root, names[meaning.name], mesh, kind="component")
        set_surface(prim, meaning.material)
        set_class(prim, meaning.label)
        set_label(prim, "part", meaning.part)
        set_collider(prim)
        apply_schemas(prim, ROAD)
        _set_roads(prim, [surfaces[index][0] for index in source])
        extents.append(mesh.extent())
    add_lanes(root, city, chunk)
    set_extents_hint(root, union_extent(extents))
    write_layer(layer, path)


def _set_roads(mesh: Sdf.PrimSpec, roads: Sequence[str]) -> None:
    """Authors the gml:id of each face's road as an indexed primvar, and the ids as a property.

    Blender imports no primvars of strings.
    """
    names, index = np.unique(np.array(roads, dtype=str), return_inverse=True)
    ids = Vt.StringArray(names.tolist())
    types = Sdf.ValueTypeNames
    of_faces = set_attribute(mesh, "primvars:gml_id", types.StringArray, ids)
    of_faces.SetInfo("interpolation", "uniform")
    set_attribute(mesh, "primvars:gml_id:indices", types.IntArray, to_ints(index))
    set_attribute(mesh, "userProperties:gml_id", types.StringArray, ids, custom=True)


def _group_surfaces(city: City, profile: Profile) -> dict[RoadMeaning, list[tuple[str, Polygons]]]:
    """Polygons by meaning, each with the gml:id of its road."""
    groups: dict[RoadMeaning, list[tuple[str, Polygons]]] = defaultdict(list)
    for top in city.objects:
        if top.kind in ROAD_KINDS:
            for surface, facts in _surfaces(top, {}):
                if len(surface.polygons):
                    meaning = road_meaning(surface, facts, profile)
                    groups[meaning].append((top.id, surface.polygons))
    return groups


def _surfaces(
    part: CityObject, outer: Mapping[str, Attribute]
) -> Iterator[tuple[ThematicSurface, Mapping[str, Attribute]]]:
    """All surfaces below an object, each with the attributes of the enclosing objects."""
    facts = {**outer, **part.attributes}
    for surface in part.surfaces:
        yield surface, facts
    for child in part.children:
        yield from _surfaces(child, facts)


def _mesh(points: FloatArray, triangles: IntArray, chunk: Chunk, size: float) -> Mesh:
    """A textured mesh of triangles in the chunk's frame; smooth unless a face is steep."""
    sizes, corners = np.full(len(triangles), 3), triangles.reshape(-1)
    normals = flat_normals(points, sizes, corners)
    steep = np.abs(normals[:, 2]) < STEEP
    place = points[corners]
    uv = plan_uv(place, chunk, size)
    uv[steep] = surface_uv(place[steep], normals[steep], np.zeros(3)) / size
    if steep.any():
        return Mesh(points, sizes, corners, normals, uv)
    smooth = vertex_normals(points, sizes, corners)
    level_uv = plan_uv(points, chunk, size)
    return Mesh(points, sizes, corners, smooth, level_uv, corner_normals=False, corner_uv=False)


def _triangles(groups: list[Polygons]) -> tuple[FloatArray, IntArray, IntArray]:
    """Welded points (N x 3) and triangles (T x 3) of polygons, without degenerate triangles.

    The third array (T) is the index of each triangle's polygons.
    """
    parts = [(polygons.points, triangulate(polygons)[0]) for polygons in groups]
    starts = np.cumsum([0, *(len(points) for points, _ in parts)])
    corners = np.concatenate(
        [triangles + start for (_, triangles), start in zip(parts, starts, strict=False)]
    )
    points, corners = weld(np.concatenate([points for points, _ in parts]), corners, GRID)
    area = np.linalg.norm(face_normals(points, np.full(len(corners), 3), corners.ravel()), axis=1)
    source = np.repeat(np.arange(len(parts)), [len(triangles) for _, triangles in parts])
    kept = area > GRID * GRID / 100
    return points, corners[kept], source[kept]
