"""The table of contents of a map for CARLA: tiles, road, package file, and how to go on."""

import json
from importlib import metadata, resources
from pathlib import Path

import numpy as np

from envgen_usd.build_manifest import hash_bytes, hash_folder
from envgen_usd.compressed_files import content_stem
from envgen_usd.errors import EnvgenError, Issue, Severity
from envgen_usd.exchange.build_road import check_road, copy_road
from envgen_usd.exchange.carla.carla_names import map_name, material_name
from envgen_usd.exchange.carla.carla_tiles import LARGEST, Tile, tiles_of
from envgen_usd.exchange.carla.tile_document import DETAILS, TileDocument
from envgen_usd.exchange.environment_export import NOTHING_DRAWN, ExportResult, stage_of
from envgen_usd.exchange.exported_files import file_facts, kept_facts
from envgen_usd.exchange.gltf.gltf_materials import (
    TEXTURES,
    StageLooks,
    remove_textures,
)
from envgen_usd.exchange.source_images import SourceImages
from envgen_usd.exchange.stage_chunks import StageChunks
from envgen_usd.folder_lock import locked
from envgen_usd.render.stage.usd_errors import usd_errors_named
from envgen_usd.step_clock import Progress
from envgen_usd.whole_files import make_folder, write_whole

_FILES = Path(str(resources.files("envgen_usd.exchange.carla"))) / "files"
_FARTHEST = 50_000.0
"""Distance from the origin, metres, up to which Unreal's numbers are exact enough."""
_GLTF_LIMIT = 2**32 - 1
"""Largest binary glTF file, bytes (glTF 2.0, 4.4.2)."""


@usd_errors_named()
def export_carla(  # noqa: PLR0913 - what the files follow from
    environment: Path,
    target: Path,
    *,
    road: Path,
    tile_size: float = LARGEST,
    detail: str = "full",
    progress: Progress = lambda _step, _done, _total: None,
) -> ExportResult:
    """Writes a .glb for each tile, the road, and the package file that CARLA's import reads.

    A tile whose layers, textures and options have not changed keeps its file. Moving actors are
    left out: CARLA moves its own.

    Args:
        environment: Folder of a build, or a stage file.
        target: Folder to write; its name is that of the package.
        road: OpenDRIVE file of the build; its name is that of the map.
        tile_size: Largest side of a tile, metres.
        detail: One of `DETAILS`.
        progress: Called after each tile.

    Raises:
        EnvgenError: There is no stage, the road is another one, or a file cannot be written.
    """
    if detail not in DETAILS:
        raise EnvgenError(f"--detail {detail}: give {' or '.join(DETAILS)}")
    stage = stage_of(environment)
    chunks = StageChunks(stage, moving=False)
    check_road(stage.parent, road, *chunks.folders)
    name = map_name(content_stem(road))
    with locked(target):
        run = _Run(chunks, target, detail)
        tiles = run.tiles(name, tile_size)
        progress("tiles", 0, len(tiles))
        for number, tile in enumerate(tiles):
            run.export(tile)
            progress("tiles", number + 1, len(tiles))
        run.fill()
        copy_road(road, target / f"{name}.xodr")
        write_whole(target / f"{target.absolute().name}.json", _package(name, tiles))
        for file in ("README.md", "to_fbx.py"):
            write_whole(target / file, (_FILES / file).read_bytes())
        run.remove_others(tiles)
    return ExportResult(target, tuple(run.files), run.kept, run.issues())


class _Run:
    """State of an export."""

    def __init__(self, chunks: StageChunks, target: Path, detail: str) -> None:
        self.files: list[Path] = []
        self.kept = 0
        self._chunks, self._target, self._detail = chunks, target, detail
        self._found: list[Issue] = []
        names = {key: material_name(name) for key, name in chunks.material_names().items()}
        self._looks = StageLooks(chunks.materials, names)
        self._lowest = np.inf
        self._gaps: list[Tile] = []
        self._images = SourceImages(chunks.folder)
        code = hash_folder(Path(__file__).parents[1], "*.py")
        self._base = (code, json.dumps([detail, metadata.version("envgen-usd")]))

    def tiles(self, name: str, side: float) -> list[Tile]:
        """The tiles of the map; chunks without payloads go with the first chunk."""
        places = self._chunks.places
        origins = np.array([self._chunks.origin(place) for place in places])
        farthest = float(np.abs(origins[:, :2]).max())
        if farthest > _FARTHEST:
            text = (
                f"the map lies {farthest / 1000:.0f} km from its origin; Unreal draws it coarsely"
            )
            action = "move the road's coordinates to its middle"
            self._found.append(Issue("carla.far", Severity.WARNING, name, text, action))
        return tiles_of(name, places, origins, side)

    def export(self, tile: Tile) -> None:
        """Writes the file of a tile unless it still holds; `fill` does so for a bare one."""
        if not tile.places:
            self._gaps.append(tile)
            return
        digests = [digest for place in tile.places for digest in self._chunks.digests(place)]
        key = hash_bytes(*self._base, tile.name, *digests)
        path = self._target / f"{tile.name}.glb"
        if facts := kept_facts(path, key, self._images):
            self.files.append(path)
            self.kept += 1
            self._lowest = min(self._lowest, float(facts["lowest"]))
            return
        document = TileDocument(tile, self._looks, key, self._detail)
        for place in tile.places:
            with np.errstate(over="ignore"):  # The document refuses what is too large for it.
                document.add_chunk(self._chunks.read(place))
        if not np.isfinite(document.lowest):
            self._gaps.append(tile)
            return
        self._lowest = min(self._lowest, document.lowest)
        self.files.append(path)
        self._write(path, document)

    def fill(self) -> None:
        """Writes a plate of ground for each gap of the grid, below everything else.

        Raises:
            EnvgenError: The map is nothing but gaps.
        """
        if not np.isfinite(self._lowest):
            raise EnvgenError(NOTHING_DRAWN)
        for tile in self._gaps:
            document = TileDocument(tile, self._looks, "gap", self._detail)
            document.add_plate(tile, self._lowest)
            path = self._target / f"{tile.name}.glb"
            self._write(path, document)
            self.files.append(path)
            text = "nothing lies in this tile, and CARLA ends at the first gap"
            action = "a level plate of terrain fills it"
            self._found.append(Issue("carla.gap", Severity.WARNING, tile.name, text, action))

    def remove_others(self, tiles: list[Tile]) -> None:
        """Removes tiles of an earlier export that this one lacks."""
        names = {f"{tile.name}.glb" for tile in tiles}
        for path in self._target.glob("*.glb"):
            if path.name not in names and file_facts(path):
                path.unlink()
        used = {name for path in self.files for name in file_facts(path).get("textures", ())}
        remove_textures(self._target / TEXTURES, used)

    def issues(self) -> tuple[Issue, ...]:
        """Warnings about the stage and the map."""
        return (*self._chunks.issues, *self._found)

    def _write(self, path: Path, document: TileDocument) -> None:
        textures = self._looks.textures.files
        content = document.to_bytes(self._images.facts(document.sources))
        if len(content) > _GLTF_LIMIT:
            raise EnvgenError(
                f"{path}: would hold more than 4 GiB; take a smaller --tile-size, "
                "or --detail simple"
            )
        make_folder(self._target / TEXTURES)
        for name, image in textures.items():
            if not self._images.is_whole(self._target / TEXTURES / name):
                write_whole(self._target / TEXTURES / name, image)
        write_whole(path, content)


def _package(name: str, tiles: list[Tile]) -> str:
    """The package file: a map with a single source, or a large map with its tiles."""
    entry: dict[str, object] = {"name": name, "xodr": f"./{name}.xodr"}
    entry["use_carla_materials"] = False
    if len(tiles) == 1:
        entry["source"] = f"./{name}.fbx"
    else:
        entry["tile_size"] = int(tiles[0].side)
        entry["tiles"] = [f"./{tile.name}.fbx" for tile in tiles]
    return json.dumps({"maps": [entry], "props": []}, indent=2) + "\n"
