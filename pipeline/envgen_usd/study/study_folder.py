"""The folder of a study: where results are, and what they follow from."""

import hashlib
import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from envgen_usd.errors import EnvgenError
from envgen_usd.output_folder import refuse_build
from envgen_usd.study.labelled_images import LabelledImage, images_digest
from envgen_usd.study.training_options import TrainingOptions
from envgen_usd.whole_files import make_folder, write_whole

RUNS = "runs"
"""Folder with the result of each run."""
MARK = "study.json"
"""File that says which study a folder holds."""


def open_folder(
    out: Path,
    options: TrainingOptions,
    images: Sequence[LabelledImage],
    *,
    random_split: bool = False,
) -> None:
    """Marks a folder with what its results follow from.

    Args:
        out: The folder; it is created.
        options: How networks are trained.
        images: The images that all results follow from.
        random_split: The split is random.

    Raises:
        EnvgenError: The folder holds results of other options or images or a build, or cannot be
            written.
    """
    refuse_build(out)
    make_folder(out / RUNS)
    path, mark = out / MARK, _mark(options, random_split, images)
    if path.is_file():
        earlier = _earlier(path)
        if earlier["mark"] != mark:
            before, now = earlier["options"], asdict(options)
            other = [key for key in now if before.get(key) != now[key]]
            fault = f"{other[0]} was {before.get(other[0])!r}" if other else "its images differ"
            raise EnvgenError(f"{out}: holds another study: {fault}; choose another --out")
        return
    content = {"mark": mark, "options": asdict(options)}
    write_whole(path, json.dumps(content, indent=1) + "\n")


def _earlier(path: Path) -> dict[str, Any]:
    """What a folder is marked with."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        return {"mark": str(content["mark"]), "options": dict(content["options"])}
    except (OSError, ValueError, TypeError, KeyError) as error:
        remedy = "remove it if the options and images are those of before, or choose another --out"
        raise EnvgenError(
            f"{path}: does not tell what its results follow from; {remedy}"
        ) from error


def _mark(options: TrainingOptions, random_split: bool, images: Sequence[LabelledImage]) -> str:
    content = json.dumps([asdict(options), random_split, images_digest(images)], sort_keys=True)
    return hashlib.sha256(content.encode()).hexdigest()
