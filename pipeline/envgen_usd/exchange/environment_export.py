"""The table of contents of an export: a file for each chunk, the textures, and the list of all."""

import json
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np

from envgen_usd.build_manifest import hash_bytes, hash_folder
from envgen_usd.errors import EnvgenError, Issue
from envgen_usd.exchange.chunk_metadata import metadata_text
from envgen_usd.exchange.exported_files import INDEX, file_facts, kept_facts, read_index
from envgen_usd.exchange.gltf.chunk_document import ChunkDocument
from envgen_usd.exchange.gltf.gltf_materials import (
    TEXTURES,
    StageLooks,
    remove_textures,
)
from envgen_usd.exchange.source_images import SourceImages
from envgen_usd.exchange.stage_chunks import ChunkPlace, StageChunks
from envgen_usd.exchange.stage_objects import json_value, value_issue
from envgen_usd.folder_lock import locked
from envgen_usd.label_taxonomy import labels
from envgen_usd.output_folder import STAGE_FILE
from envgen_usd.render.stage.typed_values import BadValueError
from envgen_usd.render.stage.usd_errors import usd_errors_named
from envgen_usd.step_clock import Progress
from envgen_usd.whole_files import make_folder, write_whole

EMBEDDED = "embedded"
METADATA = (EMBEDDED, "only")
"""Metadata in the nodes of the geometry, or alone."""
NOTHING_DRAWN = "the stage has no drawable prims; look whether they are visible and active"


@dataclass(frozen=True)
class ExportResult:
    """What an export wrote.

    Attributes:
        folder: Folder of the files.
        files: Files of the chunks.
        kept: Number of chunks whose files still held.
        issues: Warnings about the parts of the stage that were read.
    """

    folder: Path
    files: tuple[Path, ...]
    kept: int
    issues: tuple[Issue, ...]


def stage_of(environment: Path) -> Path:
    """The stage of a built environment, or the given stage file.

    Raises:
        EnvgenError: There is no stage.
    """
    stage = environment / STAGE_FILE if environment.is_dir() else environment
    if not stage.is_file():
        raise EnvgenError(f"{environment}: holds no stage; build it with `envgen-usd build`")
    return stage


@usd_errors_named()
def export_gltf(
    environment: Path,
    target: Path,
    *,
    metadata_kind: str = EMBEDDED,
    instancing: bool = True,
    progress: Progress = lambda _step, _done, _total: None,
) -> ExportResult:
    """Writes a file for each chunk, the textures, and `tiles.json`.

    A chunk whose layers, textures and options have not changed keeps its file. Each file appears
    whole or not at all, so an interrupted export resumes.

    Args:
        environment: Folder of a build, or a stage file, e.g. one with an artist's edits.
        target: Folder to write.
        metadata_kind: One of `METADATA`.
        instancing: False writes a node for each instance.
        progress: Called after each chunk.

    Raises:
        EnvgenError: There is no stage, nothing in it is drawn, or a file cannot be written.
    """
    if metadata_kind not in METADATA:
        raise EnvgenError(f"--metadata {metadata_kind}: give {' or '.join(METADATA)}")
    stage = stage_of(environment)
    with locked(target):
        chunks = StageChunks(stage)
        run = _Run(chunks, target, metadata_kind, instancing)
        progress("chunks", 0, len(chunks.places))
        for number, place in enumerate(chunks.places):
            run.export(place)
            progress("chunks", number + 1, len(chunks.places))
        if not run.files and metadata_kind == EMBEDDED:
            raise EnvgenError(NOTHING_DRAWN)
        run.finish()
    return ExportResult(target, tuple(run.files), run.kept, (*chunks.issues, *run.issues))


class _Run:
    """State of an export."""

    def __init__(self, chunks: StageChunks, target: Path, kind: str, instancing: bool) -> None:
        self.files: list[Path] = []
        self.kept = 0
        self.issues: list[Issue] = []
        self._chunks, self._target, self._instancing = chunks, target, instancing
        self._suffix = ".json" if kind == "only" else ".glb"
        self._looks = StageLooks(chunks.materials, chunks.material_names())
        self._images = SourceImages(chunks.folder)
        code = hash_folder(Path(__file__).parent, "*.py")
        self._base = (code, json.dumps([instancing, metadata.version("envgen-usd")]))

    def export(self, place: ChunkPlace) -> None:
        """Writes the file of a chunk unless it still holds."""
        key = hash_bytes(*self._base, *self._chunks.digests(place))
        path = self._target / f"{place.name}{self._suffix}"
        if kept_facts(path, key, self._images):
            self.files.append(path)
            self.kept += 1
            return
        make = self._metadata if self._suffix == ".json" else self._geometry
        content = make(place, key)
        if content is not None:
            write_whole(path, content)
            self.files.append(path)

    def finish(self) -> None:
        """Lists the chunks, and removes files of chunks that are gone."""
        entries, used = [], set[str]()
        for path in self.files:
            facts = {k: v for k, v in file_facts(path).items() if k not in {"key", "images"}}
            entries.append({"file": path.name, "bytes": path.stat().st_size, **facts})
            used |= set(facts.get("textures", ()))
        for name in _listed(self._target) - {path.name for path in self.files}:
            (self._target / name).unlink(missing_ok=True)
        content = {
            "chunks": entries,
            "axes": "y up and metres, relative to the origin; origins have z up",
            "environment": self._environment(),
            "classes": {each.name: list(each.colour) for each in labels()},
        }
        write_whole(self._target / INDEX, json.dumps(content, indent=1, allow_nan=False) + "\n")
        remove_textures(self._target / TEXTURES, used)

    def _environment(self) -> dict[str, Any]:
        """What the root layer says of the environment, without what JSON cannot hold."""
        layer, given = self._chunks.stage.GetRootLayer(), {}
        for name, value in dict(layer.customLayerData).items():
            try:
                given[str(name)] = json_value(value)
            except BadValueError as error:
                where = f"{layer.identifier}: customLayerData {name}"
                self.issues.append(value_issue(where, str(error)))
        return given

    def _metadata(self, place: ChunkPlace, key: str) -> str | None:
        chunk = self._chunks.read(place)
        return metadata_text(chunk, {"key": key, "textures": []}) if chunk.objects else None

    def _geometry(self, place: ChunkPlace, key: str) -> bytes | None:
        """The file of a chunk, after its textures."""
        chunk = self._chunks.read(place)
        if not chunk.placements:
            return None
        textures = self._looks.textures.files
        with np.errstate(over="ignore"):  # The document refuses what is too large for it.
            document = ChunkDocument(
                chunk, self._looks, instancing=self._instancing, extras={"key": key}
            )
        make_folder(self._target / TEXTURES)
        content = document.to_bytes(self._images.facts(document.sources))
        for name in document.files:
            if not self._images.is_whole(self._target / TEXTURES / name):
                write_whole(self._target / TEXTURES / name, textures[name])
        return content


def _listed(folder: Path) -> set[str]:
    """Names of the chunks' files of an earlier export."""
    try:
        entries = read_index(folder)["chunks"]
        return {Path(str(entry["file"])).name for entry in entries}
    except (EnvgenError, KeyError, TypeError):
        return set()
