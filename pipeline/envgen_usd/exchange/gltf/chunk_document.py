"""A chunk of a stage as a binary glTF file."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from envgen_usd.exchange.gltf.binary_gltf import BinaryGltf
from envgen_usd.exchange.gltf.coarse_ground import coarse_ground
from envgen_usd.exchange.gltf.gltf_materials import GltfMaterials, StageLooks
from envgen_usd.exchange.gltf.mesh_parts import Piece, add_mesh
from envgen_usd.exchange.gltf.y_up import Poses, boxes_at, poses_of, turned
from envgen_usd.exchange.object_tables import object_table
from envgen_usd.exchange.stage_chunks import StageChunk
from envgen_usd.exchange.stage_objects import StageObject
from envgen_usd.models.array_types import FloatArray
from envgen_usd.render.stage.placed_parts import Instance, Part, Template, refined

INSTANCES = "EXT_mesh_gpu_instancing"
LEVELS = "MSFT_lod"
_NO_LAYER = "Objects"
_GROUND = "terrain"
"""Kind of the objects of which a coarse mesh is computed."""


@dataclass(frozen=True)
class _Batch:
    """A mesh that stands at many places.

    Attributes:
        name: Name of its node.
        layer: Layer of the stage.
        meshes: The detailed mesh, and that for a distance, or `None`.
        extras: Facts of all instances.
        objects: Each instance; empty for scatter without objects.
    """

    name: str
    layer: str
    meshes: tuple[int | None, int | None]
    extras: dict[str, Any]
    objects: tuple[StageObject, ...] = ()


class ChunkDocument:
    """Nodes of a chunk: the chunk, its layers, their objects and batches of instances."""

    def __init__(
        self,
        chunk: StageChunk,
        looks: StageLooks,
        *,
        instancing: bool = True,
        extras: dict[str, Any] | None = None,
    ) -> None:
        """Fills the document.

        Args:
            chunk: The chunk.
            looks: Looks of the stage.
            instancing: False writes a node for each instance, for readers without
                EXT_mesh_gpu_instancing.
            extras: Further facts of the file.
        """
        self._chunk, self._instancing = chunk, instancing
        self._facts = {"chunk": chunk.name, **(extras or {})}
        self._document = BinaryGltf(self._facts)
        self._materials = GltfMaterials(self._document, looks)
        self._layers: dict[str, list[int]] = {}
        self._meshes: dict[tuple[object, ...], tuple[int | None, int | None]] = {}
        self._boxes: list[FloatArray] = []
        self._add_objects()
        self._add_batches()

    @property
    def files(self) -> list[str]:
        """Names of its texture files."""
        return self._materials.files

    @property
    def sources(self) -> frozenset[str]:
        """Paths of the images that it shows."""
        return self._materials.sources

    def to_bytes(self, images: Mapping[str, str] | None = None) -> bytes:
        """The file; `images` are the hashes of its images (`SourceImages`)."""
        document, chunk = self._document, self._chunk
        layers = [
            document.add("nodes", {"name": name, "children": nodes, "extras": {"layer": name}})
            for name, nodes in sorted(self._layers.items())
        ]
        extras = {"origin": chunk.origin.tolist(), "offset": turned(chunk.origin[None])[0].tolist()}
        root = document.add("nodes", {"name": chunk.name, "children": layers, "extras": extras})
        boxes = np.concatenate([*self._boxes, np.empty((0, 2, 3))])
        if len(boxes):
            extras["low"] = boxes[:, 0].min(axis=0).tolist()
            extras["high"] = boxes[:, 1].max(axis=0).tolist()
        self._facts |= {**extras, "textures": self._materials.files, "images": dict(images or {})}
        return document.to_bytes([root])

    def _add_objects(self) -> None:
        """A node for each object with triangles of its own."""
        owners: dict[str, list[Part]] = {}
        for placement in self._chunk.placements:
            if isinstance(placement, Part) and placement.slot.geometry is not None:
                owners.setdefault(placement.owner, []).append(placement)
        for owner, parts in owners.items():
            single = [part for part in parts if len(part.matrices) == 1]
            about = self._chunk.objects.get(owner)
            if single:
                self._add_object(owner, about, [Piece.of(each) for each in single], single)
            for part in parts:
                if len(part.matrices) > 1:
                    self._add_scatter(owner, about, part)

    def _add_object(
        self, owner: str, about: StageObject | None, pieces: list[Piece], parts: list[Part]
    ) -> None:
        name = about.id if about else owner.rpartition("/")[2] or _NO_LAYER
        near = [piece for piece, part in zip(pieces, parts, strict=True) if not _is_far(part)]
        mesh = self._mesh(name, near)
        if mesh is None:
            return
        extras = about.facts() if about else {"id": name}
        entry: dict[str, Any] = {"name": name, "mesh": mesh, "extras": extras}
        far = self._coarse(name, near) if about and about.kind == _GROUND else None
        if far is not None:
            lower = self._document.add("nodes", {"name": f"{name}_far", "mesh": far})
            entry["extensions"] = {LEVELS: {"ids": [lower]}}
            self._document.use_extension(LEVELS)
        node = self._document.add("nodes", entry)
        self._boxes.append(self._document.mesh_bounds(mesh)[None])
        self._layers.setdefault(about.layer if about else _NO_LAYER, []).append(node)

    def _add_scatter(self, owner: str, about: StageObject | None, part: Part) -> None:
        """What a point instancer scatters: a batch with the facts of its copies or its owner."""
        piece = replace(Piece.of(part), matrices=np.eye(4)[None])
        known = self._chunk.objects
        copies = tuple(known[each] for each in part.owners() if each in known) if part.many else ()
        copies = copies if len(copies) == len(part.matrices) else ()
        about = copies[0] if copies else about
        name = about.id.partition("[")[0] if about else owner.rpartition("/")[2]
        mesh = self._mesh(name, [piece])
        if mesh is not None:
            layer = about.layer if about else _NO_LAYER
            facts = (
                object_table(list(copies)) if copies else about.facts() if about else {"id": name}
            )
            self._add_poses(_Batch(name, layer, (mesh, None), facts, copies), part.matrices)

    def _add_batches(self) -> None:
        """The instances of each prototype, by layer and by the class of their surroundings."""
        batches: dict[tuple[int, str, str | None, str | None], list[Instance]] = {}
        for placement in self._chunk.placements:
            if isinstance(placement, Instance) and _is_drawn(placement.template):
                about = _about(self._chunk, placement)
                layer = about.layer if about else _NO_LAYER
                above = placement.context
                key = (id(placement.template), layer, above.label, above.part)
                batches.setdefault(key, []).append(placement)
        for (_, layer, _, _), those in batches.items():
            self._add_batch(layer, those)

    def _add_batch(self, layer: str, those: list[Instance]) -> None:
        known = [_about(self._chunk, each) for each in those]
        named = [
            each or _unknown(instance, layer) for each, instance in zip(known, those, strict=True)
        ]
        first = named[0]
        name = "_".join([first.asset or first.kind, *first.variants.values()])
        matrices = np.array([each.context.matrix for each in those])
        meshes = self._levels(name, those[0])
        exact = poses_of(matrices).are_exact
        if exact.any():
            chosen = [each for each, ok in zip(named, exact, strict=True) if ok]
            batch = _Batch(name, layer, meshes, object_table(chosen), tuple(chosen))
            self._add_poses(batch, matrices[exact])
        for index in np.flatnonzero(~exact):
            # A mesh of its own says what a translation, a rotation and a scale cannot: shear.
            parts = [part for part in _labelled(those[index]) if not _is_far(part)]
            pieces = [Piece.of(part, matrices[index] @ part.matrices) for part in parts]
            self._add_object(named[index].path, named[index], pieces, parts)

    def _levels(self, name: str, instance: Instance) -> tuple[int | None, int | None]:
        """Meshes of a prototype: the detailed one, and that for a distance where there is one."""
        above = instance.context
        key = (id(instance.template), above.label, above.part)
        if key not in self._meshes:
            parts = _labelled(instance)
            near = self._mesh(name, [Piece.of(part) for part in parts if not _is_far(part)])
            far = None
            if any(map(_is_far, parts)):
                those = [part for part in parts if _is_far(part) or not _is_replaced(part)]
                far = self._mesh(f"{name}_far", [Piece.of(part) for part in those])
            self._meshes[key] = near, far
        return self._meshes[key]

    def _add_poses(self, batch: _Batch, matrices: FloatArray) -> None:
        """Nodes of a mesh at many places."""
        near, far = batch.meshes
        if near is None:
            return
        poses = poses_of(matrices)
        self._boxes.append(boxes_at(self._document.mesh_bounds(near), matrices))
        nodes = self._layers.setdefault(batch.layer, [])
        if not self._instancing:
            nodes += self._single_nodes(batch, poses)
            return
        entry = {"name": batch.name, "mesh": near, "extras": batch.extras}
        extensions: dict[str, Any] = {INSTANCES: {"attributes": self._pose_arrays(poses)}}
        self._document.use_extension(INSTANCES)
        if far is not None:
            lower = {"name": f"{batch.name}_far", "mesh": far, "extensions": dict(extensions)}
            extensions[LEVELS] = {"ids": [self._document.add("nodes", lower)]}
            self._document.use_extension(LEVELS)
        nodes.append(self._document.add("nodes", {**entry, "extensions": extensions}))

    def _pose_arrays(self, poses: Poses) -> dict[str, int]:
        arrays = {
            "TRANSLATION": poses.translations,
            "ROTATION": poses.rotations,
            "SCALE": poses.scales,
        }
        return {
            name: self._document.accessor(values.astype(np.float32))
            for name, values in arrays.items()
        }

    def _single_nodes(self, batch: _Batch, poses: Poses) -> list[int]:
        """A node for each instance."""
        places = zip(
            poses.translations.tolist(),
            poses.rotations.tolist(),
            poses.scales.tolist(),
            strict=True,
        )
        nodes = []
        for number, (translation, rotation, scale) in enumerate(places):
            about = batch.objects[number] if batch.objects else None
            entry = {
                "name": about.id if about else f"{batch.name}_{number}",
                "mesh": batch.meshes[0],
                "translation": translation,
                "rotation": rotation,
                "scale": scale,
                "extras": about.facts() if about else batch.extras,
            }
            nodes.append(self._document.add("nodes", entry))
        return nodes

    def _coarse(self, name: str, pieces: list[Piece]) -> int | None:
        """The mesh of ground that replaces a detailed one at a distance."""
        coarse = [replace(piece, geometry=coarse_ground(piece.geometry)) for piece in pieces]
        return self._mesh(f"{name}_far", coarse)

    def _mesh(self, name: str, pieces: Iterable[Piece]) -> int | None:
        return add_mesh(self._document, name, pieces, self._materials)


def _about(chunk: StageChunk, instance: Instance) -> StageObject | None:
    """An instance that is an object, or the object that it is part of: a person in a pose."""
    return chunk.objects.get(instance.path) or chunk.objects.get(instance.context.owner)


def _is_far(part: Part) -> bool:
    """True for what replaces a detailed mesh at a distance."""
    return part.slot.levels is not None and part.slot in part.slot.levels.far


def _is_replaced(part: Part) -> bool:
    """True if a simpler mesh replaces it at a distance."""
    levels = part.slot.levels
    return levels is not None and any(slot.geometry is not None for slot in levels.far)


def _is_drawn(template: Template) -> bool:
    return any(part.slot.geometry is not None for part in template.parts)


def _labelled(instance: Instance) -> list[Part]:
    """Parts of the prototype in its space, with the labels that this instance gives them."""
    above = instance.context.label, instance.context.part
    parts = []
    for part in instance.template.parts:
        if part.slot.geometry is not None:
            label, meant = refined((part.label, part.part), above)
            parts.append(replace(part, label=label, part=meant))
    return parts


def _unknown(instance: Instance, layer: str) -> StageObject:
    """An instance that is no component."""
    name = instance.path.rpartition("/")[2]
    matrix = instance.context.matrix
    label = instance.context.label or ""
    return StageObject(instance.path, name, layer.lower(), label, layer, matrix)
