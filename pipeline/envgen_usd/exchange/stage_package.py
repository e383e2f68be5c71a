"""A folder that hands an environment on: .usdz, .xodr and ASAM OpenMATERIAL 3D files.

A valid .usdz holds layers, images and sounds only. So the other files lie beside it, where
OpenMATERIAL looks for the 3D model of an asset.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from envgen_usd.errors import EnvgenError, Issue, Severity
from envgen_usd.exchange.build_road import check_road, copy_road
from envgen_usd.exchange.environment_export import NOTHING_DRAWN, stage_of
from envgen_usd.exchange.open_material.material_files import (
    Contents,
    asset_text,
    mapping_text,
    material_text,
    reflectance_of,
    reflectance_text,
)
from envgen_usd.exchange.stage_chunks import StageChunks
from envgen_usd.folder_lock import locked
from envgen_usd.layers.flat_stage import flatten_stage
from envgen_usd.render.render_scene import Geometry, Level, Material, Use
from envgen_usd.render.stage.placed_parts import gathered_uses
from envgen_usd.render.stage.stage_reader import bounds_of
from envgen_usd.render.stage.texture_images import read_texture
from envgen_usd.render.stage.usd_errors import usd_errors_named
from envgen_usd.step_clock import Progress
from envgen_usd.whole_files import make_folder, write_whole

MATERIALS = "materials"
"""Folder of the material files beside the asset."""


@dataclass(frozen=True)
class PackageResult:
    """Files of a package.

    Attributes:
        asset: The OpenMATERIAL asset, .xoma.
        stage: The packed stage, .usdz.
        road: Copy of the road, .xodr; `None` without one.
        materials: Names of the materials.
        issues: What the files of materials cannot say.
    """

    asset: Path
    stage: Path
    road: Path | None
    materials: tuple[str, ...]
    issues: tuple[Issue, ...]


@usd_errors_named()
def package_environment(
    environment: Path,
    target: Path,
    *,
    road: Path | None = None,
    progress: Progress = lambda _step, _done, _total: None,
) -> PackageResult:
    """Writes the folder; each file appears whole or not at all.

    Args:
        environment: Folder of a build, or a stage file.
        target: Folder to write; its name names the files.
        road: OpenDRIVE file of the build; `None` leaves it out.
        progress: Called after each step.

    Raises:
        EnvgenError: There is no stage, the road is another one, or a file cannot be written.
    """
    stage = stage_of(environment)
    chunks = StageChunks(stage)
    if road is not None:
        check_road(stage.parent, road, *chunks.folders)
    with locked(target):
        return _packed(stage, chunks, target, road, progress)


def _packed(
    stage: Path, chunks: StageChunks, target: Path, road: Path | None, progress: Progress
) -> PackageResult:
    make_folder(target / MATERIALS)
    name = target.absolute().name
    files = {suffix: target / f"{name}.{suffix}" for suffix in ("usdz", "xodr", "xoma", "xomm")}
    progress("stage", 0, 1)
    flatten_stage(stage, files["usdz"])
    progress("stage", 1, 1)
    if road is not None:
        copy_road(road, files["xodr"])
    contents = _contents(chunks, progress)
    looks, issues = _named_looks(chunks)
    if road is None and files["xodr"].exists():
        text = "lies here from before, and may be of another town"
        action = "it is left alone: remove it, or give --road"
        where = files["xodr"].name
        issues = (*issues, Issue("package.road", Severity.WARNING, where, text, action))
    former = files["xomm"].read_text("utf-8", "replace") if files["xomm"].is_file() else ""
    written = _write_materials(target / MATERIALS, looks, progress)
    places = {title: f"{MATERIALS}/{title}.xomp" for title in looks}
    write_whole(files["xomm"], mapping_text(name, places))
    for path in {*(target / MATERIALS).glob("*.xomp")} - written:
        if f"{MATERIALS}/{path.name}" in former:
            path.unlink()
            _table(path).unlink(missing_ok=True)
    sides = [max(read_texture(t).shape) for look in looks.values() for t in look.textures.values()]
    write_whole(files["xoma"], asset_text(name, replace(contents, side=max(sides, default=0))))
    kept_road = road and files["xodr"]
    return PackageResult(files["xoma"], files["usdz"], kept_road, tuple(looks), issues)


def _write_materials(folder: Path, looks: Mapping[str, Material], progress: Progress) -> set[Path]:
    """Writes the files of all materials; returns them without their tables."""
    written = set[Path]()
    for number, (title, look) in enumerate(looks.items()):
        measured, material = reflectance_of(look), folder / f"{title}.xomp"
        write_whole(_table(material), reflectance_text(title, measured))
        write_whole(material, material_text(title, measured))
        written.add(material)
        progress("materials", number + 1, len(looks))
    return written


def _table(material: Path) -> Path:
    """File of the reflectance of a material."""
    return material.with_name(f"{material.stem}_camera_brdf.xompt")


def _named_looks(chunks: StageChunks) -> tuple[dict[str, Material], tuple[Issue, ...]]:
    """Looks by the names of their materials, which are read with the chunks."""
    looks: dict[str, Material] = {}
    issues = []
    for index, title in chunks.material_names().items():
        if title in looks:
            text = "several materials have this name and differ"
            action = "the file of the first stands for all: rename the others"
            issues.append(Issue("package.material", Severity.WARNING, title, text, action))
        looks.setdefault(title, chunks.materials[index])
    return looks, tuple(dict.fromkeys(issues))


def _contents(chunks: StageChunks, progress: Progress) -> Contents:
    """Counts what the stage draws, with the detailed level of each mesh; without textures."""
    triangles, boxes = 0, []
    meshes: dict[int, Geometry] = {}
    for number, place in enumerate(chunks):
        chunk = chunks.read(place)
        geometries, uses = gathered_uses(chunk.placements, lambda _label, _path, _part: 0)
        drawn = [use for use in uses if not _is_far(use)]
        triangles += sum(len(geometries[u.geometry].triangles) * len(u.matrices) for u in drawn)
        meshes |= {id(geometries[use.geometry]): geometries[use.geometry] for use in drawn}
        if drawn:
            boxes.append(bounds_of(geometries, drawn) + chunk.origin)
        progress("contents", number + 1, len(chunks.places))
    if not boxes:
        raise EnvgenError(NOTHING_DRAWN)
    low = np.min([box[0] for box in boxes], axis=0)
    bounds = np.stack((low, np.max([box[1] for box in boxes], axis=0)))
    return Contents(triangles, len(meshes), bounds, 0)


def _is_far(use: Use) -> bool:
    level: Level | None = use.level
    return level is not None and level.far
