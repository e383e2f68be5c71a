"""Normals of many meshes of a file as indices into one table of directions.

A crate file stores equal arrays once and packs integers, but floating-point vectors lie in it as
they are. Normals were half of the bytes of the poses of a person; as indices they are a tenth.
"""

from collections.abc import Sequence

import numpy as np
from pxr import Sdf
from scipy.spatial import cKDTree

from envgen_usd.assets.usd_values import to_ints, to_points
from envgen_usd.models.array_types import FloatArray

_DIRECTIONS = 5000
"""Directions on the sphere: each normal is within 2.1 degrees of one, on average 1.1 degrees.

More are more exact and take more space.
"""


def share_normals(meshes: Sequence[Sdf.PrimSpec]) -> None:
    """Replaces the normals at the vertices of meshes by indexed primvars with one table.

    Args:
        meshes: Meshes of a layer; those without an attribute `normals` stay as they are.
    """
    smooth = [mesh for mesh in meshes if "normals" in mesh.attributes]
    if not smooth:
        return
    own = [np.asarray(mesh.attributes["normals"].default, np.float64) for mesh in smooth]
    table = lattice(_DIRECTIONS)
    nearest = cKDTree(table).query(np.concatenate(own))[1]
    used, index = np.unique(nearest, return_inverse=True)
    directions = to_points(table[used])
    ends = np.cumsum([len(each) for each in own])
    for mesh, rows in zip(smooth, np.split(index, ends[:-1]), strict=True):
        mesh.RemoveProperty(mesh.attributes["normals"])
        types = Sdf.ValueTypeNames
        shared = Sdf.AttributeSpec(mesh, "primvars:normals", types.Normal3fArray)
        shared.default = directions
        shared.SetInfo("interpolation", "vertex")
        indices = Sdf.AttributeSpec(mesh, "primvars:normals:indices", types.IntArray)
        indices.default = to_ints(rows)


def lattice(count: int) -> FloatArray:
    """Directions all over the sphere, N x 3: spherical Fibonacci points (Swinbank, 2006)."""
    place = np.arange(count) + 0.5
    z = 1.0 - 2.0 * place / count
    turn = np.pi * (1.0 + np.sqrt(5.0)) * place
    out = np.sqrt(1.0 - z**2)
    return np.stack([out * np.cos(turn), out * np.sin(turn), z], axis=1)
