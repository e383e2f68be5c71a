"""Makes an asset of the library from a file of another program."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from envgen_usd.assets.asset_catalogue import Catalogue, read_catalogue, scan_library
from envgen_usd.assets.asset_design import AssetDesign, Model, Part
from envgen_usd.assets.asset_layers import write_asset
from envgen_usd.assets.far_mesh import HANGING, far_model
from envgen_usd.assets.imported_materials import write_materials
from envgen_usd.assets.imports import mesh_file_source, usd_file_source
from envgen_usd.assets.imports.source_model import SourceMesh, SourceModel, check_source
from envgen_usd.assets.library_check import check_used
from envgen_usd.assets.library_drafts import library_draft
from envgen_usd.assets.polygon_mesh import Mesh, flat_normals, weld
from envgen_usd.assets.prim_authoring import prim_names
from envgen_usd.errors import EnvgenError, Issue, Severity
from envgen_usd.input_paths import check_input_file
from envgen_usd.label_taxonomy import labels, parts
from envgen_usd.models.array_types import FloatArray

_WELD = 1e-6
"""Distance within which vertices become one, metres."""
_USUAL = (0.05, 40.0)
"""Largest extent of usual assets, metres; a wider range accepts more files without a warning."""
_MANY = 20_000
"""Triangles from which on a warning is given; a larger value accepts slower assets."""
_UPRIGHT = {
    # x, y, z of an asset in the axes of a file; glTF's front is +z, ours +x (glTF 2.0, 3.4).
    "y": np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
    "z": np.eye(3),
}
_IN_WALL = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
"""Turns the front from +x to +y, which leaves the wall."""


@dataclass(frozen=True)
class ImportOptions:
    """What the file does not say.

    Attributes:
        kind: Kind of object, e.g. ``bench``.
        name: Name of the asset; empty: the name of the file.
        label: Token in the `class` taxonomy; empty: that of the other assets of the kind, or
            ``static``.
        scale: Factor of all lengths, after the units of the file.
        height: Height in metres that the asset is scaled to; 0 keeps its size.
        up: Axis of the file that points up, ``y`` or ``z``; empty: what the file says.
        turn: Angle about the vertical, degrees; positive turns are counter-clockwise from above.
        keep_pivot: Keep the origin of the file instead of the middle of the foot.
        replace: Replace an asset of the same name.
    """

    kind: str
    name: str = ""
    label: str = ""
    scale: float = 1.0
    height: float = 0.0
    up: str = ""
    turn: float = 0.0
    keep_pivot: bool = False
    replace: bool = False


@dataclass(frozen=True)
class ImportedAsset:
    """The result of an import.

    Attributes:
        name: Name of the asset.
        path: Path of its interface, relative to the library.
        size: Extent along x, y, z, metres.
        triangles: Triangles near, and in the distance.
        materials: Names of its materials in the library.
        issues: Findings with their remedies.
    """

    name: str
    path: str
    size: tuple[float, float, float]
    triangles: tuple[int, int]
    materials: tuple[str, ...]
    issues: tuple[Issue, ...]


def import_asset(file: Path, library: Path, options: ImportOptions) -> ImportedAsset:
    """Writes ``assets/<kind>/<name>`` with its materials and textures, or nothing.

    1. The file is read: .glb, .gltf, .obj, .usd, .usda, .usdc, .usdz.
    2. Units become metres and the axes ours: z up, front +x, pivot in the middle of the foot.
    3. Materials become materials of the library, with their textures.
    4. Meshes of purpose ``proxy`` show the asset in the distance.
    5. The asset is checked as `library_check.check_used` does.

    Args:
        file: File of another program.
        library: Folder of the library.
        options: What the file does not say.

    Raises:
        EnvgenError: The file cannot become an asset; the library is unchanged then.
    """
    name = prim_names([options.name or file.stem])[options.name or file.stem]
    catalogue, _ = scan_library(library)
    _check_options(name, options, catalogue, file)
    label = options.label or _usual_label(options.kind, catalogue)
    folder = Path("assets") / options.kind / name
    with library_draft(library) as draft:
        model, materials, given = import_model(file, draft, name, options)
        if min(model.size()) <= 0.0:
            sides = " x ".join(f"{side:g}" for side in model.size())
            raise EnvgenError(f"{file}: is flat, {sides} m; give it a thickness, e.g. of 1 cm")
        issues = list(given)
        write_asset(AssetDesign(name, options.kind, label, {"": model}), draft)
        found = check_used(read_catalogue(draft), [name], materials)
        errors = [issue for issue in found if issue.severity == Severity.ERROR]
        if errors:
            raise EnvgenError(f"{file}: {errors[0].where}: {errors[0].message}")
        issues += found
    near = sum(_triangles(part.mesh) for part in model.parts if not part.proxy_of)
    far = sum(_triangles(part.mesh) for part in model.parts if part.proxy_of) or near
    issues += _heavy(near, name)
    if not catalogue.of_kind(options.kind):
        issues.append(_unknown_kind(options.kind, catalogue))
    path = (folder / "usd" / f"{name}.usda").as_posix()
    return ImportedAsset(name, path, model.size(), (near, far), materials, tuple(issues))


def import_model(
    file: Path, library: Path, name: str, options: ImportOptions
) -> tuple[Model, tuple[str, ...], tuple[Issue, ...]]:
    """Reads a file as the geometry of an asset, and writes its materials.

    Args:
        file: File of another program.
        library: Folder in which materials and textures are written.
        name: Begin of the names of the materials.
        options: What the file does not say.

    Returns:
        The geometry, the names of its materials, and findings.

    Raises:
        EnvgenError: The file cannot become an asset.
    """
    source = read_source(file)
    issues = list(source.issues)
    matrix = _to_asset(source, options, issues, file)
    materials = write_materials(source.materials, name, library)
    model = _model(source, matrix, materials, options)
    return model, tuple(sorted(materials.values())), tuple(issues)


def read_source(file: Path) -> SourceModel:
    """Reads a file of another program by its suffix.

    Raises:
        EnvgenError: The file is missing, of another kind, or damaged.
    """
    readers: dict[str, Callable[[Path], SourceModel]] = {
        **dict.fromkeys(mesh_file_source.SUFFIXES, mesh_file_source.read_mesh_file),
        **dict.fromkeys(usd_file_source.SUFFIXES, usd_file_source.read_usd_file),
    }
    check_input_file(file, f"name a file: {', '.join(readers)}")
    if file.suffix not in readers:
        raise EnvgenError(f"{file}: cannot be imported; known: {', '.join(readers)}")
    source = readers[file.suffix](file)
    check_source(source, file)
    return source


def _check_options(name: str, options: ImportOptions, catalogue: Catalogue, file: Path) -> None:
    known = [entry.name for entry in labels()]
    if options.label and options.label not in known:
        raise EnvgenError(f"unknown label '{options.label}'; known: {', '.join(known)}")
    if options.kind != prim_names([options.kind])[options.kind]:
        raise EnvgenError(f"kind '{options.kind}': use letters, digits and underscores")
    if options.name and options.name != name:
        raise EnvgenError(f"name '{options.name}': use letters, digits and underscores")
    if not (math.isfinite(options.scale) and options.scale > 0.0):
        raise EnvgenError(f"scale {options.scale}: expected a number above 0")
    if not (math.isfinite(options.height) and options.height >= 0.0):
        raise EnvgenError(f"height {options.height}: expected metres above 0")
    if options.up not in {"", *_UPRIGHT}:
        raise EnvgenError(f"up axis '{options.up}'; known: {', '.join(_UPRIGHT)}")
    known_asset = catalogue.assets.get(name)
    if known_asset and not (options.replace and known_asset.kind == options.kind):
        raise EnvgenError(
            f"{file}: the library has an asset '{name}' ({known_asset.path}); choose --name"
            f"{'' if options.replace else ', or replace it with --replace'}"
        )


def _usual_label(kind: str, catalogue: Catalogue) -> str:
    """Class of the other assets of a kind."""
    return next((asset.label for asset in catalogue.of_kind(kind)), "static")


def _to_asset(
    source: SourceModel, options: ImportOptions, issues: list[Issue], file: Path
) -> FloatArray:
    """4 x 4, from the frame of the file to that of the asset."""
    cos, sin = math.cos(math.radians(options.turn)), math.sin(math.radians(options.turn))
    turn = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    axes = turn @ _UPRIGHT[options.up or source.up]
    if options.kind in HANGING:
        axes = _IN_WALL @ axes
    metres = source.metres * options.scale
    low, high = _box(source.meshes, axes * metres)
    extent = high - low
    if (extent <= 0.0).sum() > 1:
        raise EnvgenError(f"{file}: has no extent in two directions; it is a line or a point")
    if options.height:
        if extent[2] <= 0.0:
            raise EnvgenError(f"{file}: has no height to scale; use --scale")
        metres *= options.height / extent[2]
        low, high, extent = (value * options.height / extent[2] for value in (low, high, extent))
    if options.kind not in HANGING and not _USUAL[0] <= extent.max() <= _USUAL[1]:
        action = f"give --height, or --scale {'0.01' if extent.max() > 1 else '100'}"
        text = f"is {extent.max():.3g} m large; are its units metres?"
        issues.append(Issue("library.import", Severity.WARNING, file.name, text, action))
    return _placed(axes * metres, low, high, options)


def _placed(
    linear: FloatArray, low: FloatArray, high: FloatArray, options: ImportOptions
) -> FloatArray:
    """Adds the move of the pivot, and for openings the scale to a width and height of 1."""
    matrix = np.eye(4)
    matrix[:3, :3] = linear
    if options.kind in HANGING:
        unit = np.array([1.0 / max(high[0] - low[0], 1e-9), 1.0, 1.0 / max(high[2] - low[2], 1e-9)])
        matrix[:3, :3] = unit[:, None] * linear
        matrix[:3, 3] = -low * unit
    elif not options.keep_pivot:
        matrix[:3, 3] = [-(low[0] + high[0]) / 2, -(low[1] + high[1]) / 2, -low[2]]
    return matrix


def _box(meshes: Sequence[SourceMesh], linear: FloatArray) -> tuple[FloatArray, FloatArray]:
    used = [mesh.points[np.unique(mesh.face_vertices)] @ linear.T for mesh in meshes]
    points = np.concatenate(used)
    return points.min(axis=0), points.max(axis=0)


def _model(
    source: SourceModel, matrix: FloatArray, materials: Mapping[str, str], options: ImportOptions
) -> Model:
    """The parts in the frame of the asset, each with its proxy."""
    near = []
    for mesh, name in zip(source.meshes, _part_names(source.meshes), strict=True):
        label = mesh.name.lower() if mesh.name.lower() in parts() else "body"
        moved = _moved(mesh, matrix)
        near.append(Part(name, moved, materials[mesh.material], label, mesh.double_sided))
    model = Model(tuple(near))
    return model if options.kind in HANGING else far_model(model)


def _part_names(meshes: Sequence[SourceMesh]) -> list[str]:
    """A valid and unique name for each mesh, in their order."""
    counts: dict[str, int] = {}
    names = []
    for mesh in meshes:
        base = prim_names([mesh.name])[mesh.name]
        counts[base] = counts.get(base, 0) + 1
        names.append(base if counts[base] == 1 else f"{base}_{counts[base]}")
    return names


def _moved(mesh: SourceMesh, matrix: FloatArray) -> Mesh:
    """A mesh in the frame of the asset, with normals and texture coordinates at its corners."""
    linear = matrix[:3, :3]
    points = mesh.points @ linear.T + matrix[:3, 3]
    points, corners = weld(points, mesh.face_vertices, _WELD)
    flat = flat_normals(points, mesh.face_sizes, corners)
    normals = flat
    if mesh.normals is not None:
        turned = mesh.normals @ np.linalg.inv(linear)
        length = np.linalg.norm(turned, axis=1, keepdims=True)
        normals = np.where(length > 1e-9, turned / np.maximum(length, 1e-9), flat)
    uv = np.zeros((len(corners), 2)) if mesh.uv is None else mesh.uv
    return Mesh(points, mesh.face_sizes, corners, normals, uv)


def _triangles(mesh: Mesh) -> int:
    return int((mesh.face_sizes - 2).sum())


def _heavy(triangles: int, name: str) -> list[Issue]:
    if triangles <= _MANY:
        return []
    text = f"{triangles} triangles; more than {_MANY} slow down images"
    action = "simplify the mesh in the program that made it, and import it with --replace"
    return [Issue("library.triangles", Severity.WARNING, name, text, action)]


def _unknown_kind(kind: str, catalogue: Catalogue) -> Issue:
    known = sorted({asset.kind for asset in catalogue.assets.values()})
    text = f"no other asset has the kind '{kind}'; known: {', '.join(known)}"
    action = "objects of a road file select a kind by its name; [furniture] places the known ones"
    return Issue("library.kind", Severity.INFO, kind, text, action)
