"""Writes the terrain layer of a chunk: the shape of the ground."""

from pathlib import Path

from envgen_usd.assets.polygon_mesh import Mesh, vertex_normals
from envgen_usd.assets.prim_authoring import (
    add_mesh,
    add_prim,
    set_class,
    set_collider,
    set_extents_hint,
)
from envgen_usd.assets.usd_files import new_layer, write_layer
from envgen_usd.layers.payload_files import local, plan_uv
from envgen_usd.models.ground import GroundMesh


def write_terrain(ground: GroundMesh, path: Path) -> None:
    """Writes ``/Terrain/Ground``, a single mesh; the landuse layer authors its look.

    Args:
        ground: Ground of the chunk.
        path: .usdc file, written atomically.
    """
    points = local(ground.vertices, ground.chunk)
    mesh = Mesh(
        points,
        ground.face_sizes,
        ground.face_vertices,
        vertex_normals(points, ground.face_sizes, ground.face_vertices),
        plan_uv(points, ground.chunk, 1.0),
        corner_normals=False,
        corner_uv=False,
    )
    layer = new_layer("Terrain")
    root = add_prim(layer, "Terrain", "Xform", kind="component")
    set_class(root, "terrain")
    set_extents_hint(root, mesh.extent())
    set_collider(add_mesh(root, "Ground", mesh))
    write_layer(layer, path)
