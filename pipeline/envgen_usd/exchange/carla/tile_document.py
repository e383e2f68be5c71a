"""A tile as a binary glTF file: all meshes in the frame of the map, named as CARLA asks.

CARLA's import places each mesh once and at the origin, so that instances become part of their mesh
here. It makes the drawn triangles those of collisions, so that there are no other collision meshes.
"""

from collections import defaultdict
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from envgen_usd.exchange.carla.carla_names import (
    SIGN,
    SIGNAL,
    TERRAIN,
    mesh_name,
    name_start,
)
from envgen_usd.exchange.carla.carla_tiles import Tile
from envgen_usd.exchange.gltf.binary_gltf import BinaryGltf
from envgen_usd.exchange.gltf.gltf_materials import GltfMaterials, StageLooks
from envgen_usd.exchange.gltf.mesh_parts import Piece, add_mesh
from envgen_usd.exchange.stage_chunks import StageChunk
from envgen_usd.exchange.stage_objects import StageObject
from envgen_usd.models.array_types import FloatArray
from envgen_usd.render.render_scene import Geometry
from envgen_usd.render.stage.placed_parts import Instance, Part, Placement

DETAILS = ("full", "simple")
"""Meshes as drawn from near, or those for a distance where the stage has them."""
_SURFACES = {"Roads", "Terrain"}
"""Layers with a mesh for each material."""


class TileDocument:
    """Meshes of a tile; each chunk adds its nodes."""

    def __init__(self, tile: Tile, looks: StageLooks, key: str, detail: str) -> None:
        """Starts empty.

        Args:
            tile: The tile.
            looks: Looks of the stage, with names that CARLA keeps.
            key: Hash of all that the file follows from.
            detail: One of `DETAILS`.
        """
        self._facts: dict[str, Any] = {"key": key, "chunk": tile.name, "textures": []}
        self._document = BinaryGltf(self._facts)
        self._materials = GltfMaterials(self._document, looks)
        self._looks, self._detail = looks, detail
        self._roots: list[int] = []
        self._lowest = np.inf

    def add_chunk(self, chunk: StageChunk) -> None:
        """Adds the meshes of a chunk."""
        groups: dict[str, list[Piece]] = defaultdict(list)
        classes: dict[str, str] = {}
        for placement in chunk.placements:
            about = _top(placement, chunk)
            layer = about.layer if about else ""
            signal = _signal(placement)
            for part in self._drawn(placement):
                start = signal or name_start(layer, part.label, part.part)
                name = mesh_name(start, *self._words(part, about, chunk.name))
                groups[name].append(_piece(part, chunk.origin))
                classes.setdefault(name, part.label or "")
        for name, pieces in groups.items():
            mesh = add_mesh(self._document, name, pieces, self._materials)
            if mesh is not None:
                extras = {"class": classes[name], "chunk": chunk.name}
                node = {"name": name, "mesh": mesh, "extras": extras}
                self._roots.append(self._document.add("nodes", node))
                self._lowest = min(self._lowest, float(self._document.mesh_bounds(mesh)[0, 1]))

    @property
    def lowest(self) -> float:
        """Height of the lowest point, metres; infinite without meshes."""
        return self._lowest

    def add_plate(self, tile: Tile, height: float) -> None:
        """Fills a gap of the map with a level square, metres: CARLA accepts no gap."""
        (x, y), side, self._lowest = tile.low, tile.side, height
        corners = np.array([(x, y), (x + side, y), (x + side, y + side), (x, y + side)])
        plate = Geometry(
            points=np.column_stack((corners, np.full(4, height))),
            normals=np.tile(np.array((0.0, 0.0, 1.0), np.float32), (4, 1)),
            uvs=(corners - corners[0]).astype(np.float32),
            colours=np.zeros((4, 4), np.uint8),
            triangles=np.array([(0, 1, 2), (0, 2, 3)], np.uint32),
            material=0,
            double_sided=False,
        )
        name = mesh_name(TERRAIN, "gap", tile.name)
        mesh = add_mesh(
            self._document, name, [Piece(plate, np.eye(4)[None], None, None)], self._materials
        )
        node = {"name": name, "mesh": mesh, "extras": {"class": "terrain"}}
        self._roots.append(self._document.add("nodes", node))

    @property
    def sources(self) -> frozenset[str]:
        """Paths of the images that it shows."""
        return self._materials.sources

    def to_bytes(self, images: Mapping[str, str]) -> bytes:
        """The file; `images` are the hashes of its images (`SourceImages`)."""
        files = {"textures": self._materials.files, "images": dict(images)}
        self._facts |= {**files, "lowest": self._lowest}
        return self._document.to_bytes(self._roots)

    def _drawn(self, placement: Placement) -> Iterable[Part]:
        """Parts of the chosen level of detail."""
        parts = [placement] if isinstance(placement, Part) else placement.parts()
        for part in parts:
            levels = part.slot.levels
            level = levels.level(part.slot) if levels else None
            if part.slot.geometry is None or (levels and level is None and part.slot in levels.far):
                continue
            if level is None or level.far == (self._detail == "simple"):
                yield part

    def _words(self, part: Part, about: StageObject | None, chunk: str) -> list[str]:
        """What a name says after its begin, so that what differs gets a mesh of its own."""
        geometry = part.slot.geometry
        assert geometry is not None
        layer = about.layer if about else ""
        if layer in _SURFACES:
            return [part.part or "", self._looks.names.get(geometry.material, ""), chunk]
        if layer == "Buildings" and about:
            return [about.part_of or about.id, chunk]
        return [about.kind if about else "object", chunk]


def _top(placement: Placement, chunk: StageChunk) -> StageObject | None:
    if isinstance(placement, Part):
        return chunk.objects.get(placement.owner)
    return chunk.objects.get(placement.path) or chunk.objects.get(placement.context.owner)


def _signal(placement: Placement) -> str:
    """Begin of the names of signs and traffic lights with their posts; else empty."""
    if not isinstance(placement, Instance):
        return ""
    labels = {part.label for part in placement.template.parts}
    return SIGNAL if "traffic_light" in labels else SIGN if "traffic_sign" in labels else ""


def _piece(part: Part, origin: FloatArray) -> Piece:
    """A part in the frame of the map, without labels: a slot of a mesh is a material."""
    matrices = part.matrices.copy()
    matrices[:, :3, 3] += origin
    piece = Piece.of(part, matrices)
    return Piece(piece.geometry, piece.matrices, None, None)
