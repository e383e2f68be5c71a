"""A stage that shows variants of assets, or materials, one beside the other."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pxr import Sdf

from envgen_usd.assets.asset_catalogue import Asset, Catalogue, LibraryMaterial
from envgen_usd.assets.far_mesh import HANGING
from envgen_usd.assets.polygon_mesh import Mesh, flat_normals
from envgen_usd.assets.prim_authoring import (
    add_mesh,
    add_prim,
    bind_material,
    set_attribute,
    set_class,
    set_pose,
)
from envgen_usd.assets.usd_files import new_layer, write_layer
from envgen_usd.errors import EnvgenError
from envgen_usd.models.array_types import FloatArray

_OPENING = np.array([1.2, 1.0, 1.6])
"""Size in metres to which windows and doors are scaled."""
_APART = 5.0
"""Distance of neighbours as a multiple of the larger one's extent; larger values part them more."""
_CUBE = 1.6
"""Edge of the cube of a material, metres."""
_MARGIN = 200.0
"""Ground around what is shown, metres."""
_LIFT = 0.02
"""Height of the cubes and openings above the ground, metres."""


@dataclass(frozen=True)
class Exhibit:
    """What a cell of a contact sheet shows.

    Attributes:
        name: Text of the cell.
        box: 2 x 3, bounding box on the stage, metres.
        front: Direction (3) that its front faces.
    """

    name: str
    box: FloatArray
    front: tuple[float, float, float]


def asset_variants(asset: Asset) -> Iterator[tuple[str, dict[str, str]]]:
    """Name and selections of each variant of each set, with the other sets at their default."""
    if not asset.variants:
        yield asset.name, {}
    for name, variants in asset.variants.items():
        for variant in variants:
            yield f"{asset.name} {name}={variant}", {**asset.defaults, name: variant}


def write_asset_stage(
    catalogue: Catalogue, names: Sequence[str], path: Path
) -> tuple[Exhibit, ...]:
    """Writes a stage with all variants of assets, in a row along y.

    Args:
        catalogue: Asset library.
        names: Assets or kinds, e.g. ``window`` for all windows; none for all. An asset wins
            over a kind of its name.
        path: .usda file.

    Raises:
        EnvgenError: A name is neither an asset nor a kind.
    """
    chosen = [asset for name in names for asset in _named(catalogue, name)]
    layer, world = _new_stage()
    exhibits: list[Exhibit] = []
    row = _Row()
    for asset in chosen or catalogue.assets.values():
        for text, selections in asset_variants(asset):
            scale = _OPENING if asset.kind in HANGING else np.ones(3)
            box = asset.extent(selections) * scale
            place = row.place(box)
            prim = add_prim(world, f"exhibit_{len(exhibits)}", "Xform", kind="component")
            target = (catalogue.folder / asset.path).as_posix()
            prim.referenceList.prependedItems = [Sdf.Reference(target)]
            for name, variant in selections.items():
                prim.variantSelections[name] = variant
            set_pose(prim, place, scale=scale)
            front = (0.0, 1.0, 0.0) if asset.kind in HANGING else (1.0, 0.0, 0.0)
            exhibits.append(Exhibit(text, box + place, front))
    _finish(layer, world, row, path)
    return tuple(exhibits)


def _named(catalogue: Catalogue, name: str) -> tuple[Asset, ...]:
    """The asset of a name, or else all assets of that kind."""
    if name in catalogue.assets:
        return (catalogue.assets[name],)
    alike = tuple(catalogue.of_kind(name))
    if not alike:
        known = ", ".join(sorted({*catalogue.assets, *(a.kind for a in catalogue.assets.values())}))
        raise EnvgenError(f"unknown asset '{name}'; known assets and kinds: {known}")
    return alike


def write_material_stage(
    catalogue: Catalogue, names: Sequence[str], path: Path
) -> tuple[Exhibit, ...]:
    """Writes a stage with a cube of each material, in a row along y.

    Args:
        catalogue: Asset library.
        names: Materials; none for all.
        path: .usda file.

    Raises:
        EnvgenError: A material is unknown.
    """
    layer, world = _new_stage()
    exhibits: list[Exhibit] = []
    row = _Row()
    for name in names or list(catalogue.materials):
        material = catalogue.material(name, "library preview")
        mesh = _cube(material)
        place = row.place(mesh.extent())
        holder = add_prim(world, f"exhibit_{len(exhibits)}", "Xform", kind="component")
        set_pose(holder, place)
        look = add_prim(holder, name, "Material")
        reference = Sdf.Reference((catalogue.folder / material.path).as_posix())
        look.referenceList.prependedItems = [reference]
        prim = add_mesh(holder, "Cube", mesh, double_sided=True)
        bind_material(prim, look.path)
        set_class(holder, "static")
        exhibits.append(Exhibit(name, mesh.extent() + place, (1.0, 0.0, 0.0)))
    _finish(layer, world, row, path)
    return tuple(exhibits)


class _Row:
    """Places along y, far enough from one another."""

    def __init__(self) -> None:
        self.end = 0.0
        self._last = 0.0

    def place(self, box: FloatArray) -> FloatArray:
        """Origin (3) of the next exhibit."""
        extent = float(np.ptp(box, axis=0).max())
        self.end += _APART * max(extent, self._last) if self._last else 0.0
        self._last = extent
        return np.round([0.0, self.end, max(0.0, _LIFT - float(box[0, 2]))], 2)


def _new_stage() -> tuple[Sdf.Layer, Sdf.PrimSpec]:
    layer = new_layer("World")
    return layer, add_prim(layer, "World", "Xform", kind="assembly")


def _finish(layer: Sdf.Layer, world: Sdf.PrimSpec, row: _Row, path: Path) -> None:
    """Adds ground and light, and writes the stage."""
    types = Sdf.ValueTypeNames
    low, high = np.array([-_MARGIN, -_MARGIN]), np.array([_MARGIN, row.end + _MARGIN])
    corners = [(low[0], low[1]), (high[0], low[1]), (high[0], high[1]), (low[0], high[1])]
    points = np.array([(x, y, 0.0) for x, y in corners])
    sizes, index = np.array([4]), np.arange(4)
    uv = points[:, :2].copy()
    ground = Mesh(points, sizes, index, flat_normals(points, sizes, index), uv)
    set_class(add_mesh(world, "Ground", ground), "terrain")
    environment = add_prim(world, "Environment", "Scope")
    sun = add_prim(environment, "Sun", "DistantLight")
    set_attribute(sun, "inputs:intensity", types.Float, 3.0)
    set_attribute(sun, "inputs:normalize", types.Bool, True)
    # From the left behind the camera, 42 degrees high.
    set_pose(sun, rotate=np.array([48.0, 0.0, 60.0]))
    set_attribute(add_prim(environment, "Sky", "DomeLight"), "inputs:intensity", types.Float, 0.6)
    write_layer(layer, path)


def _cube(material: LibraryMaterial) -> Mesh:
    """A cube with the size of the texture on each face."""
    half = _CUBE / 2
    faces = []
    for axis in range(3):
        for side in (-1.0, 1.0):
            u, v = np.eye(3)[(axis + 1) % 3], np.eye(3)[(axis + 2) % 3]
            if axis == 1:
                u, v = v, u
            normal = np.eye(3)[axis] * side
            if np.dot(np.cross(u, v), normal) < 0:
                u = -u
            square = [normal - u - v, normal + u - v, normal + u + v, normal - u + v]
            faces.append(np.array(square) * half + [0.0, 0.0, half])
    points = np.concatenate(faces)
    sizes, index = np.full(6, 4), np.arange(24)
    square_uv = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
    uv = np.tile(square_uv * _CUBE / material.size, (6, 1))
    return Mesh(points, sizes, index, flat_normals(points, sizes, index), uv)
