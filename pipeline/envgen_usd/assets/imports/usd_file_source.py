"""Reads meshes and materials of a USD file (.usd, .usda, .usdc, .usdz)."""

import io
from pathlib import Path

import numpy as np
from PIL import Image
from pxr import Ar, Sdf, Tf, Usd, UsdGeom, UsdShade

from envgen_usd.assets.imports.source_model import SourceMaterial, SourceMesh, SourceModel, lost
from envgen_usd.assets.usd_files import unreadable
from envgen_usd.assets.usd_values import from_vectors
from envgen_usd.errors import EnvgenError, Issue, one_line
from envgen_usd.image_pixels import UNREADABLE, to_rgba
from envgen_usd.models.array_types import ByteArray, FloatArray, IntArray

SUFFIXES = (".usd", ".usda", ".usdc", ".usdz")
_DRAWN = {"default", "render"}
_GREY = SourceMaterial("grey")
_OPAQUE = 0.99
"""Opacity from which on a material counts as opaque; a larger value names more materials."""


def read_usd_file(path: Path) -> SourceModel:
    """Reads the composed stage of a file with its selected variants.

    Meshes with a purpose other than ``default`` and ``render`` are left out.

    Raises:
        EnvgenError: The file cannot be opened, or a mesh is damaged.
    """
    try:
        stage = Usd.Stage.Open(str(path))
    except Tf.ErrorException as error:
        raise unreadable(path, "USD file", error, "export the file anew") from error
    issues: list[Issue] = []
    materials: dict[str, SourceMaterial] = {}
    meshes: list[SourceMesh] = []
    cache = UsdGeom.XformCache()
    for prim in stage.Traverse(Usd.TraverseInstanceProxies()):
        if not prim.IsA("Gprim") or not _is_drawn(UsdGeom.Imageable(prim)):
            continue
        if not prim.IsA("Mesh"):
            action = "it is left out: convert it into a mesh"
            issues.append(lost(path, str(prim.GetPath()), f"is a {prim.GetTypeName()}", action))
            continue
        matrix = from_vectors(cache.GetLocalToWorldTransform(prim))
        meshes += _meshes(UsdGeom.Mesh(prim), matrix, path, materials, issues)
    up = "y" if UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.y else "z"
    metres = UsdGeom.GetStageMetersPerUnit(stage)
    return SourceModel(tuple(meshes), materials, up, metres, tuple(dict.fromkeys(issues)))


def _is_drawn(prim: UsdGeom.Imageable) -> bool:
    return prim.ComputePurpose() in _DRAWN and prim.ComputeVisibility() != "invisible"


def _meshes(
    mesh: UsdGeom.Mesh,
    matrix: FloatArray,
    path: Path,
    materials: dict[str, SourceMaterial],
    issues: list[Issue],
) -> list[SourceMesh]:
    """A mesh, divided by its material subsets."""
    prim = mesh.GetPrim()
    sizes = np.asarray(mesh.GetFaceVertexCountsAttr().Get() or [], dtype=np.int64)
    corners = np.asarray(mesh.GetFaceVertexIndicesAttr().Get() or [], dtype=np.int64)
    points = from_vectors(mesh.GetPointsAttr().Get() or np.empty((0, 3))).reshape(-1, 3)
    if sizes.sum() != len(corners) or (corners < 0).any() or corners.max(initial=-1) >= len(points):
        raise EnvgenError(
            f"{path}: {prim.GetPath()}: faceVertexIndices do not fit the "
            f"{len(points)} points; export the file anew"
        )
    if not len(sizes):
        return []
    whole = SourceMesh(
        prim.GetName(),
        points @ matrix[:3, :3] + matrix[3, :3],
        sizes,
        corners,
        _normals(mesh, matrix, corners, sizes),
        _uv(prim, corners, sizes),
        "",
        bool(mesh.GetDoubleSidedAttr().Get()),
    )
    if np.linalg.det(matrix[:3, :3]) < 0 or mesh.GetOrientationAttr().Get() == "leftHanded":
        raise EnvgenError(
            f"{path}: {prim.GetPath()}: is mirrored or left-handed; apply its scale in the "
            "program that made it, and export the file anew"
        )
    parts = []
    for owner, faces in _owners(prim, len(sizes), path):
        material = _bound(owner, path, issues)
        materials[material.name] = material
        parts.append(_part(whole, faces, material.name))
    return parts


def _owners(prim: Usd.Prim, count: int, path: Path) -> list[tuple[Usd.Prim, IntArray]]:
    """The prims that material is bound to, with their faces of the `count` faces of a mesh."""
    owners: list[tuple[Usd.Prim, IntArray]] = []
    taken = np.zeros(count, dtype=bool)
    for subset in UsdShade.MaterialBindingAPI(prim).GetMaterialBindSubsets():
        faces = np.asarray(subset.GetIndicesAttr().Get() or [], dtype=np.int64)
        if (faces < 0).any() or faces.max(initial=-1) >= count:
            raise EnvgenError(
                f"{path}: {subset.GetPrim().GetPath()}: indices do not fit the {count} faces; "
                "export the file anew"
            )
        taken[faces] = True
        if len(faces):
            owners.append((subset.GetPrim(), faces))
    if not taken.all():
        owners.append((prim, np.flatnonzero(~taken)))
    return owners


def _part(mesh: SourceMesh, faces: IntArray, material: str) -> SourceMesh:
    """The faces of a mesh that have one material."""
    starts = np.concatenate([[0], np.cumsum(mesh.face_sizes)[:-1]])
    sizes = mesh.face_sizes[faces]
    first = np.concatenate([[0], np.cumsum(sizes)[:-1]])
    at = np.repeat(starts[faces] - first, sizes) + np.arange(sizes.sum())
    return SourceMesh(
        mesh.name,
        mesh.points,
        sizes,
        mesh.face_vertices[at],
        None if mesh.normals is None else mesh.normals[at],
        None if mesh.uv is None else mesh.uv[at],
        material,
        mesh.double_sided,
    )


def _at_corners(
    values: FloatArray, interpolation: str, corners: IntArray, sizes: IntArray
) -> FloatArray | None:
    """Values of a primvar at the corners; `None` if their number does not fit."""
    index = {
        "vertex": corners,
        "varying": corners,
        "faceVarying": np.arange(len(corners)),
        "uniform": np.repeat(np.arange(len(sizes)), sizes),
        "constant": np.zeros(len(corners), dtype=np.int64),
    }[interpolation]
    return values[index] if len(values) > index.max(initial=-1) else None


def _normals(
    mesh: UsdGeom.Mesh, matrix: FloatArray, corners: IntArray, sizes: IntArray
) -> FloatArray | None:
    primvar = UsdGeom.PrimvarsAPI(mesh).GetPrimvar("normals")
    if primvar.HasValue():
        stated, how = primvar.ComputeFlattened(), primvar.GetInterpolation()
    else:
        stated, how = mesh.GetNormalsAttr().Get(), mesh.GetNormalsInterpolation()
    if not stated:
        return None
    values = _at_corners(from_vectors(stated), how, corners, sizes)
    if values is None:
        return None
    turned = values @ np.linalg.inv(matrix[:3, :3]).T
    unit: FloatArray = turned / np.maximum(np.linalg.norm(turned, axis=1, keepdims=True), 1e-12)
    return unit


def _uv(prim: Usd.Prim, corners: IntArray, sizes: IntArray) -> FloatArray | None:
    """The first texture coordinates of a mesh."""
    for primvar in UsdGeom.PrimvarsAPI(prim).GetPrimvarsWithValues():
        kind = primvar.GetTypeName()
        if kind in {Sdf.ValueTypeNames.TexCoord2fArray, Sdf.ValueTypeNames.Float2Array}:
            stated, how = primvar.ComputeFlattened(), primvar.GetInterpolation()
            return _at_corners(from_vectors(stated), how, corners, sizes)
    return None


def _bound(prim: Usd.Prim, path: Path, issues: list[Issue]) -> SourceMaterial:
    """The UsdPreviewSurface of a prim or subset; grey without one."""
    material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()
    shader = material.ComputeSurfaceSource()[0] if material else None
    if not shader or shader.GetIdAttr().Get() != "UsdPreviewSurface":
        action = "it becomes grey: give it a UsdPreviewSurface, or a material with new-variant"
        issues.append(lost(path, str(prim.GetPath()), "has no UsdPreviewSurface", action))
        return _GREY
    name = material.GetPrim().GetName()
    image, rough, normal = (
        _image(shader, each, path, issues) for each in ("diffuseColor", "roughness", "normal")
    )
    colour = shader.GetInput("diffuseColor")
    stated = colour.Get() if colour and image is None else None
    fallback = (0.18, 0.18, 0.18) if image is None else (1.0, 1.0, 1.0)
    cut = _figure(shader, "opacityThreshold", 0.0)
    if cut <= 0.0 and _figure(shader, "opacity", 1.0) < _OPAQUE:
        action = "it becomes opaque: give the part the material 'glass' with new-variant"
        issues.append(lost(path, f"material '{name}'", "lets light through", action))
    glow = shader.GetInput("emissiveColor")
    return SourceMaterial(
        name,
        tuple(stated) if stated is not None else fallback,
        1.0 if rough is not None else _figure(shader, "roughness", 0.5),
        _figure(shader, "metallic", 0.0),
        tuple(glow.Get()) if glow and glow.Get() is not None else (0.0, 0.0, 0.0),
        image,
        None if normal is None else np.ascontiguousarray(normal[..., :3]),
        None if rough is None else np.ascontiguousarray(rough[..., 0]),
        cut if image is not None else 0.0,
    )


def _figure(shader: UsdShade.Shader, name: str, fallback: float) -> float:
    entry = shader.GetInput(name)
    value = entry.Get() if entry else None
    return fallback if value is None else float(value)


def _image(shader: UsdShade.Shader, name: str, path: Path, issues: list[Issue]) -> ByteArray | None:
    """The texture of an input, H x W x 4; `None` without one, or without one that can be read."""
    entry = shader.GetInput(name)
    sources = entry.GetConnectedSources()[0] if entry else []
    texture = UsdShade.Shader(sources[0].source.GetPrim()) if sources else None
    file = texture.GetInput("file").Get() if texture and texture.GetInput("file") else None
    if file is None or not file.path:
        return None
    # The path may lead into a package.
    place = Ar.ResolvedPath(file.resolvedPath)
    asset = Ar.GetResolver().OpenAsset(place) if file.resolvedPath else None  # type: ignore[attr-defined] # not in types-usd
    what, action = "does not exist", "put the image where the file says"
    if "<UDIM>" in file.path:
        what, action = "is an image of several tiles", "bake them into one"
    elif asset:
        try:
            with Image.open(io.BytesIO(asset.GetBuffer())) as image:
                return np.asarray(to_rgba(image), dtype=np.uint8)
        except UNREADABLE as error:
            what, action = f"cannot be read: {one_line(error)}", "save the image anew"
    text = f"{name} {file.path}"
    issues.append(lost(path, text, what, f"the plain value is used: {action}"))
    return None
