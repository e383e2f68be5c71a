"""Merges the shards of a data set into one folder."""

import shutil
from collections.abc import Sequence
from pathlib import Path

from envgen_usd.datasets.dataset_index import IndexedFrame
from envgen_usd.errors import EnvgenError
from envgen_usd.recipe.dataset_files import read_file_list
from envgen_usd.recipe.dataset_recipe import read_recipe, recipe_mark
from envgen_usd.recipe.dataset_run import MARK, finish_dataset, open_dataset, with_formats
from envgen_usd.recipe.product_files import file_fault
from envgen_usd.recipe.street_splits import share_streets
from envgen_usd.render.frames.frame_folder import read_table
from envgen_usd.step_clock import Progress
from envgen_usd.whole_files import PART_PREFIX, make_folder, whole_file

_COPIED = ("frames", "towns")
"""Folders of a shard that are merged."""


def merge_shards(
    source: Path,
    shards: Sequence[Path],
    out: Path,
    *,
    formats: Sequence[str] = (),
    progress: Progress = lambda *_: None,
) -> tuple[IndexedFrame, ...]:
    """Copies the frames and towns of shards into a folder, and finishes the data set.

    Files that are there already are kept, so an interrupted merge goes on. Without shards, a folder
    that several shards wrote into is finished.

    Args:
        source: Recipe of the shards.
        shards: Folders of the shards.
        out: Folder of the whole data set; may be one of the shards.
        formats: Layouts that are written besides those of the recipe.
        progress: Called with the step's name, the parts done and the total.

    Raises:
        EnvgenError: A folder holds no shard or that of another recipe, two shards have another
            town, frames are missing, a file is damaged, or one cannot be written.
    """
    recipe = with_formats(read_recipe(source), formats)
    streets = share_streets(recipe, source)
    mark = recipe_mark(recipe)
    for shard in shards:
        found = read_table(shard / MARK).get("recipe_sha256")
        if found != mark:
            fault = f"is of another recipe than {source}" if found else "is no shard of a data set"
            raise EnvgenError(f"{shard}: {fault} ({MARK}); give the --out of dataset --shard")
    open_dataset(out, recipe)
    known = _whole_files(out)
    others = [shard for shard in shards if shard.resolve() != out.resolve()]
    for number, shard in enumerate(others):
        progress("copy shards", number, len(others))
        known |= _copy(shard, out)
    progress("copy shards", len(others), max(len(others), 1))
    return finish_dataset(out, recipe, streets, progress, known)


def _whole_files(out: Path) -> dict[str, str]:
    """Hashes of the files that a folder has of its own shards; a damaged one is an error."""
    written = read_file_list(out) or {}
    present = {name: value for name, value in written.items() if (out / name).exists()}
    for name, value in present.items():
        _check_whole(out / name, value)
    return present


def _copy(shard: Path, out: Path) -> dict[str, str]:
    """Copies what is missing; damaged files, and tables that differ, are an error.

    Returns:
        Hashes of what was copied, where the shard lists them.
    """
    written, copied = read_file_list(shard) or {}, dict[str, str]()
    for part in _COPIED:
        for path in sorted((shard / part).rglob("*")):
            target = out / path.relative_to(shard)
            if path.is_dir() or PART_PREFIX in str(path) or path.name == ".lock":
                continue
            if not target.exists():
                name = path.relative_to(shard).as_posix()
                if name in written:
                    _check_whole(path, written[name])
                    copied[name] = written[name]
                make_folder(target.parent)
                with whole_file(target) as unfinished:
                    shutil.copyfile(path, unfinished)
            elif path.name in {"render.json", "cameras.json", "lidar.json"}:
                _check_same(path, target)
    return copied


def _check_whole(path: Path, value: str) -> None:
    if fault := file_fault(path, value):
        raise EnvgenError(f"{path}: {fault}; run the shard again, which makes damaged files anew")


def _check_same(path: Path, target: Path) -> None:
    if path.read_bytes() != target.read_bytes():
        fault = f"differs from {target}: the shards drew different towns or versions"
        raise EnvgenError(f"{path}: {fault}; render one of them again")
