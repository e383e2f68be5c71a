"""Reads glTF (.glb, .gltf) and Wavefront files (.obj)."""

import json
import struct
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
import trimesh
from PIL import Image
from trimesh.resolvers import FilePathResolver

from envgen_usd.assets.imports.source_model import SourceMaterial, SourceMesh, SourceModel, lost
from envgen_usd.errors import EnvgenError, Issue, one_line
from envgen_usd.image_pixels import UNREADABLE, to_rgba
from envgen_usd.models.array_types import ByteArray, FloatArray

SUFFIXES = (".glb", ".gltf", ".obj")
_GLB = b"glTF"
_DROPPED = {
    "animations": "the movement is left out: apply the wanted pose before the export",
    "skins": "the skin is left out: apply the wanted pose before the export",
    "cameras": "cameras are left out: a stage has the cameras of a rig",
}
_GREY = SourceMaterial("grey")


def read_mesh_file(path: Path) -> SourceModel:
    """Reads a file; its meshes are y-up, in metres (glTF 2.0, 3.4).

    Raises:
        EnvgenError: The file cannot be read.
    """
    header = _gltf_header(path) if path.suffix != ".obj" else {}
    issues = [*_dropped(path, header), *_lost_images(path, header)] if header else []
    issues += [] if header else _missing_parts(path)
    try:
        # Faces of a Wavefront file that share a material are joined; glTF has them joined.
        keywords: dict[str, Any] = {"group_material": True} if path.suffix == ".obj" else {}
        scene = trimesh.load_scene(path, resolver=_Beside(str(path)), process=False, **keywords)
    # Its readers raise whatever the damaged part of a file leads to.
    except Exception as error:
        raise EnvgenError(
            f"{path}: cannot be read as {path.suffix}: {error}; export the file anew, "
            "as glTF without compression"
        ) from error
    smooth = _has_normals(path, header)
    materials: dict[str, SourceMaterial] = {}
    meshes = []
    for node in sorted(scene.graph.nodes_geometry):
        matrix, name = scene.graph[node]
        mesh = scene.geometry[name]
        if isinstance(mesh, trimesh.Trimesh) and len(mesh.faces):
            material = _material(mesh, path, issues)
            materials[material.name] = material
            meshes.append(_mesh(str(node), mesh, matrix, material, smooth=smooth))
    return SourceModel(tuple(meshes), materials, "y", 1.0, tuple(dict.fromkeys(issues)))


class _Beside(FilePathResolver):
    """Finds the files that a file names, also by names of other programs and systems."""

    def get(self, name: str) -> bytes:
        """Content of a file, whose name may have escapes (``%20``) and backslashes.

        Raises:
            FileNotFoundError: There is none.
            ValueError: It lies outside of the folder.
        """
        try:
            return bytes(super().get(name))
        except FileNotFoundError:
            return bytes(super().get(unquote(name).replace("\\", "/")))


def _gltf_header(path: Path) -> dict[str, Any]:
    """The JSON part of a glTF file."""
    content = path.read_bytes()
    try:
        if content[:4] == _GLB:
            (length,) = struct.unpack_from("<I", content, 12)
            content = content[20 : 20 + length]
        header = json.loads(content)
    except (ValueError, struct.error) as error:
        raise EnvgenError(f"{path}: is no glTF 2.0 file: {error}; export the file anew") from error
    if not isinstance(header, dict):
        raise EnvgenError(f"{path}: is no glTF 2.0 file; export the file anew")
    return header


def _dropped(path: Path, header: dict[str, Any]) -> Iterator[Issue]:
    needed = header.get("extensionsRequired", [])
    if needed:
        raise EnvgenError(
            f"{path}: extensionsRequired {', '.join(map(str, needed))}: cannot be read; "
            "export the file without compression and extensions"
        )
    for name, action in _DROPPED.items():
        if header.get(name):
            yield lost(path, name, f"{len(header[name])} {name}", action)


def _missing_parts(path: Path) -> Iterator[Issue]:
    """Files of materials and textures that a Wavefront file names and that do not exist."""
    for library in _named(path, ("mtllib",)):
        if not _is_beside(path, library):
            action = "its faces get a grey material: put the file beside the .obj"
            yield lost(path, f"mtllib {library}", "does not exist", action)
            continue
        for texture in _named(path.parent / library, ("map_kd",)):
            yield from _lost_image(path, f"{library} map_Kd", texture)


def _lost_images(path: Path, header: dict[str, Any]) -> Iterator[Issue]:
    """Images beside a glTF file that cannot be read."""
    images = header.get("images")
    known = images if isinstance(images, list) else []
    places = [each.get("uri") for each in known if isinstance(each, dict)]
    for place in places:
        if isinstance(place, str) and not place.startswith("data:"):
            yield from _lost_image(path, "image", unquote(place))


def _lost_image(path: Path, what: str, name: str) -> Iterator[Issue]:
    """What is wrong with an image that a file names."""
    action = f"the plain colour is used: put the image beside the {path.suffix}"
    try:
        content = _Beside(str(path)).get(name)
    except FileNotFoundError:
        yield lost(path, f"{what} {name}", "does not exist", action)
        return
    except ValueError:
        yield lost(path, f"{what} {name}", "lies outside of the folder", action)
        return
    except OSError as error:
        yield lost(path, f"{what} {name}", f"cannot be read: {error.strerror}", action)
        return
    try:
        with Image.open(BytesIO(content)) as image:
            image.load()
    except UNREADABLE as error:
        action = "the plain colour is used: save the image anew"
        yield lost(path, f"{what} {name}", f"cannot be read: {one_line(error)}", action)


def _is_beside(path: Path, name: str) -> bool:
    """True if there is such a file beside another; names may be longer than any file's."""
    try:
        return (path.parent / name).is_file()
    except OSError:
        return False


def _named(path: Path, keys: tuple[str, ...]) -> Iterator[str]:
    """What the lines of a Wavefront file with a key name: a name with spaces, or several files."""
    for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
        key, rest = (*line.split(maxsplit=1), "", "")[:2]
        words = rest.split()
        if not words or key.lower() not in keys:
            continue
        # Options of a texture come first, e.g. -s 1 1 1.
        name = words[-1] if words[0].startswith("-") else rest.strip()
        several = not _is_beside(path, name) and all(_is_beside(path, word) for word in words)
        yield from words if several else (name,)


def _has_normals(path: Path, header: dict[str, Any]) -> bool:
    """Whether the file states normals; without them faces are flat (glTF 2.0, 3.7.2.1)."""
    if not header:
        return next(_named(path, ("vn",)), None) is not None
    primitives = [p for mesh in header.get("meshes", []) for p in mesh.get("primitives", [])]
    return bool(primitives) and all("NORMAL" in p.get("attributes", {}) for p in primitives)


def _mesh(
    name: str,
    mesh: trimesh.Trimesh,
    matrix: FloatArray,
    material: SourceMaterial,
    *,
    smooth: bool,
) -> SourceMesh:
    faces = np.asarray(mesh.faces, dtype=np.int64)
    mirrored = np.linalg.det(matrix[:3, :3]) < 0
    corners = (faces[:, ::-1] if mirrored else faces).reshape(-1)
    points = np.asarray(mesh.vertices) @ matrix[:3, :3].T + matrix[:3, 3]
    normals = None
    if smooth:
        turned = np.asarray(mesh.vertex_normals) @ np.linalg.pinv(matrix[:3, :3])
        length = np.maximum(np.linalg.norm(turned, axis=1, keepdims=True), 1e-12)
        normals = (turned / length)[corners]
    stated = getattr(mesh.visual, "uv", None)
    uv = None if stated is None else np.asarray(stated, dtype=np.float64)[corners]
    sizes = np.full(len(faces), 3)
    sheet = material.double_sided
    return SourceMesh(name, points, sizes, corners, normals, uv, material.name, sheet)


def _material(mesh: trimesh.Trimesh, path: Path, issues: list[Issue]) -> SourceMaterial:
    visual: Any = mesh.visual
    stated = getattr(visual, "material", None)
    if isinstance(stated, trimesh.visual.material.PBRMaterial):
        return _physical(stated, path, issues)
    if isinstance(stated, trimesh.visual.material.SimpleMaterial):
        return _simple(stated)
    if visual.kind in {"vertex", "face"}:
        mean = np.asarray(visual.main_color, dtype=np.float64)[:3]
        action = "the most frequent colour is used: bake the colours into a texture"
        issues.append(lost(path, "colours", "colours of vertices or faces", action))
        colour = _linear(mean / 255.0)
        return SourceMaterial(f"colour_{'_'.join(str(int(v)) for v in mean)}", colour)
    return _GREY


def _physical(stated: Any, path: Path, issues: list[Issue]) -> SourceMaterial:  # noqa: ANN401
    """A metallic-roughness material (glTF 2.0, 3.9.2); its factors are linear."""
    name = stated.name or "material"
    factor = np.ones(4) if stated.baseColorFactor is None else stated.baseColorFactor / 255.0
    rough = 1.0 if stated.roughnessFactor is None else float(stated.roughnessFactor)
    metal = 1.0 if stated.metallicFactor is None else float(stated.metallicFactor)
    both = stated.metallicRoughnessTexture
    rough_image = None
    if both is not None:
        channels = np.asarray(both.convert("RGB"), dtype=np.uint8)
        rough_image = np.ascontiguousarray(channels[..., 1])
        metal *= float(channels[..., 2].mean()) / 255.0
    mode = str(stated.alphaMode or "OPAQUE").upper()
    image = _pixels(stated.baseColorTexture)
    if mode == "BLEND" and image is None:
        action = "it becomes opaque: give the part the material 'glass' with new-variant"
        issues.append(lost(path, f"material '{name}'", "lets light through", action))
    cut = {"MASK": float(stated.alphaCutoff or 0.5), "BLEND": 0.5}.get(mode, 0.0)
    glow = np.zeros(3) if stated.emissiveFactor is None else np.asarray(stated.emissiveFactor)
    red, green, blue = (float(value) for value in factor[:3])
    return SourceMaterial(
        name,
        (red, green, blue),
        rough,
        metal,
        (float(glow[0]), float(glow[1]), float(glow[2])),
        image,
        None if stated.normalTexture is None else np.asarray(stated.normalTexture.convert("RGB")),
        rough_image,
        cut if image is not None else 0.0,
        bool(stated.doubleSided),
    )


def _simple(stated: Any) -> SourceMaterial:  # noqa: ANN401
    """A material of a Wavefront file, whose colours are sRGB; its texture replaces the colour."""
    image = _pixels(stated.image)
    colour = _linear(np.asarray(stated.diffuse, dtype=np.float64)[:3] / 255.0)
    # Walter and others 2007, "Microfacet models for refraction": Phong exponent to roughness.
    rough = float(np.clip((2.0 / (float(stated.glossiness) + 2.0)) ** 0.25, 0.0, 1.0))
    white = (1.0, 1.0, 1.0)
    return SourceMaterial(
        stated.name or "material", colour if image is None else white, rough, colour_image=image
    )


def _pixels(image: Image.Image | None) -> ByteArray | None:
    return None if image is None else np.asarray(to_rgba(image), dtype=np.uint8)


def _linear(encoded: FloatArray) -> tuple[float, float, float]:
    """Linear RGB of sRGB (IEC 61966-2-1)."""
    low = encoded / 12.92
    high = ((encoded + 0.055) / 1.055) ** 2.4
    red, green, blue = np.where(encoded <= 0.04045, low, high).tolist()
    return red, green, blue
