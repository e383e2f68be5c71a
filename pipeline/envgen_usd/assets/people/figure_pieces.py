"""Pieces of people and vehicles, and the models that they make together."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from envgen_usd.assets.asset_design import Model, Part, Subset
from envgen_usd.assets.people.lofted_forms import joined, sharpened
from envgen_usd.assets.polygon_mesh import Mesh, merge, set_apart

FAR = "Far"
"""Name of the mesh for the distance."""


@dataclass(frozen=True)
class Piece:
    """What becomes a part of the asset and a subset of its far mesh.

    Attributes:
        name: Name of the part.
        near: Meshes for the vicinity.
        far: Meshes for the distance; none for what it does not show.
        material: Material of the library.
        label: Token in the `part` taxonomy.
        of_class: Token in the `class` taxonomy if it differs from the asset's.
    """

    name: str
    near: Sequence[Mesh]
    far: Sequence[Mesh]
    material: str
    label: str
    of_class: str = ""


def composed(pieces: Sequence[Piece]) -> Model:
    """A part for each piece, and one far mesh of all: all parts change level together."""
    parts = [
        Part(piece.name, _one(piece.near), piece.material, piece.label, of_class=piece.of_class)
        for piece in pieces
    ]
    shown = [piece for piece in pieces if piece.far]
    counts = [sum(len(mesh.face_sizes) for mesh in piece.far) for piece in shown]
    ends = np.cumsum(counts)
    subsets = tuple(
        Subset(piece.name, np.arange(end - count, end), piece.material, piece.label, piece.of_class)
        for piece, count, end in zip(shown, counts, ends, strict=True)
    )
    first, *others = (piece.name for piece in pieces)
    proxy = Part(
        FAR, set_apart(_one([mesh for piece in shown for mesh in piece.far])),
        pieces[0].material, pieces[0].label, double_sided=True, proxy_of=first,
        stands_for=tuple(others), subsets=subsets,
    )  # fmt: skip
    return Model((*parts, proxy))


def _one(meshes: Sequence[Mesh]) -> Mesh:
    """A mesh of several: with values per corner if any has them.

    Their materials are uniform, so that texture coordinates would only cost bytes.
    """
    if any(mesh.corner_normals for mesh in meshes):
        whole = merge([sharpened(mesh) for mesh in meshes])
    else:
        whole = joined(meshes)
    return replace(whole, uv=np.zeros_like(whole.uv))


def grounded(model: Model) -> Model:
    """The model with its lowest near point at a height of 0."""
    low = float(model.extent()[0, 2])
    parts = tuple(
        replace(part, mesh=replace(part.mesh, points=part.mesh.points - [0.0, 0.0, low]))
        for part in model.parts
    )
    return replace(model, parts=parts)
