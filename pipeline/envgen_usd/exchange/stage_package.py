"""A folder that hands an environment on: .usdz, .xodr and ASAM OpenMATERIAL 3D files.

A valid .usdz holds layers, images and sounds only. So the other files lie beside it, where
OpenMATERIAL looks for the 3D model of an asset.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from envgen_usd.errors import EnvgenError
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
    """

    asset: Path
    stage: Path
    road: Path | None
    materials: tuple[str, ...]


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
    if road is not None:
        check_road(stage.parent, road)
    make_folder(target / MATERIALS)
    name = target.absolute().name
    files = {suffix: target / f"{name}.{suffix}" for suffix in ("usdz", "xodr", "xoma", "xomm")}
    progress("stage", 0, 1)
    flatten_stage(stage, files["usdz"])
    progress("stage", 1, 1)
    if road is not None:
        copy_road(road, files["xodr"])
    chunks = StageChunks(stage)
    looks = {title: chunks.materials[k] for k, title in chunks.material_names().items()}
    for number, (title, look) in enumerate(looks.items()):
        measured = reflectance_of(look)
        table = target / MATERIALS / f"{title}_camera_brdf.xompt"
        write_whole(table, reflectance_text(title, measured))
        write_whole(target / MATERIALS / f"{title}.xomp", material_text(title, measured))
        progress("materials", number + 1, len(looks))
    places = {title: f"{MATERIALS}/{title}.xomp" for title in looks}
    write_whole(files["xomm"], mapping_text(name, places))
    write_whole(files["xoma"], asset_text(name, _contents(chunks, looks, progress)))
    return PackageResult(files["xoma"], files["usdz"], road and files["xodr"], tuple(looks))


def _contents(chunks: StageChunks, looks: dict[str, Material], progress: Progress) -> Contents:
    """Counts what the stage draws, with the detailed level of each mesh."""
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
    sides = [max(read_texture(t).shape) for look in looks.values() for t in look.textures.values()]
    bounds = np.stack((low, np.max([box[1] for box in boxes], axis=0)))
    return Contents(triangles, len(meshes), bounds, max(sides, default=0))


def _is_far(use: Use) -> bool:
    level: Level | None = use.level
    return level is not None and level.far
