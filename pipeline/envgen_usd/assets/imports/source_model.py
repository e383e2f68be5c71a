"""Content of a file of another program: meshes and materials, in the frame of the file."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from envgen_usd.errors import EnvgenError, Issue, Severity
from envgen_usd.models.array_types import ByteArray, FloatArray, IntArray

LARGEST = 1e6
"""Largest coordinate in the units of the file; what is farther has a damaged or a map's frame."""


@dataclass(frozen=True)
class SourceMaterial:
    """A material; images are rows from the upper edge, 8 bits.

    Attributes:
        name: Name in the file.
        colour: Linear reflectance, 3; images of the colour are multiplied by it.
        roughness: 0 to 1; images of the roughness are multiplied by it.
        metallic: 0 to 1.
        emission: Linear RGB, 3.
        colour_image: H x W x 4, sRGB with opacity.
        normal_image: H x W x 3, tangent space.
        roughness_image: H x W.
        cut_out: Opacity below which nothing is drawn; 0 for an opaque material.
        double_sided: True for sheets that are seen from both sides.
    """

    name: str
    colour: tuple[float, float, float] = (0.5, 0.5, 0.5)
    roughness: float = 0.8
    metallic: float = 0.0
    emission: tuple[float, float, float] = (0.0, 0.0, 0.0)
    colour_image: ByteArray | None = None
    normal_image: ByteArray | None = None
    roughness_image: ByteArray | None = None
    cut_out: float = 0.0
    double_sided: bool = False


@dataclass(frozen=True)
class SourceMesh:
    """A mesh of one material.

    Attributes:
        name: Name in the file.
        points: N x 3 in the frame of the file.
        face_sizes: F, vertices of each face.
        face_vertices: C = sum(face_sizes), counter-clockwise seen from outside.
        normals: C x 3, unit length; `None` for flat faces.
        uv: C x 2, v upwards; `None` without texture coordinates.
        material: Name of its material.
        double_sided: True for sheets that are seen from both sides.
    """

    name: str
    points: FloatArray
    face_sizes: IntArray
    face_vertices: IntArray
    normals: FloatArray | None
    uv: FloatArray | None
    material: str
    double_sided: bool = False


@dataclass(frozen=True)
class SourceModel:
    """All that is taken from a file.

    Attributes:
        meshes: Meshes, in a stable order.
        materials: Materials by name.
        up: Axis that points up, ``y`` or ``z``.
        metres: Metres of a unit of the file.
        issues: What the file holds and the asset cannot.
    """

    meshes: tuple[SourceMesh, ...]
    materials: Mapping[str, SourceMaterial]
    up: str
    metres: float
    issues: tuple[Issue, ...] = ()


def lost(path: Path, element: str, message: str, action: str) -> Issue:
    """A warning about what the asset cannot take from a file."""
    return Issue("library.import", Severity.WARNING, f"{path.name} {element}", message, action)


def check_source(model: SourceModel, path: Path) -> None:
    """Refuses a model that cannot become an asset.

    Raises:
        EnvgenError: No mesh, a coordinate that is no number, or a face without its vertex.
    """
    if not model.meshes:
        raise EnvgenError(
            f"{path}: holds no mesh with faces; export the object with its mesh, "
            "not as curves, points or an empty node"
        )
    for mesh in model.meshes:
        where = f"{path}: mesh '{mesh.name}'"
        if len(mesh.face_vertices) and mesh.face_vertices.max(initial=0) >= len(mesh.points):
            raise EnvgenError(
                f"{where}: a face names vertex {mesh.face_vertices.max()}, but there are "
                f"{len(mesh.points)}; export the file anew"
            )
        if not np.isfinite(mesh.points).all() or np.abs(mesh.points).max(initial=0.0) > LARGEST:
            raise EnvgenError(
                f"{where}: a coordinate is no number below {LARGEST:g}; "
                "move the object to the origin, and export the file anew"
            )
