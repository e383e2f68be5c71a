"""Synthetic images: folders of rendered frames, and data sets of ours."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from envgen_usd.datasets.dataset_index import INDEX, read_index
from envgen_usd.errors import EnvgenError
from envgen_usd.input_paths import check_input_folder
from envgen_usd.study.labelled_images import LabelledImage
from envgen_usd.study.study_classes import ClassTable


def read_synthetic_images(folders: Sequence[Path], table: ClassTable) -> tuple[LabelledImage, ...]:
    """Finds the frames of folders with ``rgb`` and ``semantic``, and of data sets.

    Args:
        folders: Folders of frames, or data sets (all of their splits).
        table: The class of each id of a semantic image.

    Raises:
        EnvgenError: A folder is missing or holds no frames, or a frame has no labels.
    """
    images = [
        LabelledImage(picture, labels, str(folder), table.tobytes())
        for folder in folders
        for picture, labels in _pairs(folder)
    ]
    return tuple(images)


def _pairs(folder: Path) -> Iterator[tuple[Path, Path]]:
    remedy = "name a folder of envgen-usd render or dataset"
    check_input_folder(folder, remedy, "--synthetic")
    if (folder / INDEX).is_file():
        for row in read_index(folder):
            yield folder / row.file("rgb"), _existing(folder / row.file("semantic"))
        return
    pictures = sorted(p for p in (folder / "rgb").glob("*") if p.suffix in {".png", ".jpg"})
    if not pictures:
        fault = "holds no frames; render them with --outputs rgb,semantic"
        raise EnvgenError(f"{folder / 'rgb'}: {fault}")
    for picture in pictures:
        yield picture, _existing(folder / "semantic" / f"{picture.stem}.png")


def _existing(labels: Path) -> Path:
    if not labels.is_file():
        raise EnvgenError(f"{labels}: is missing; render with --outputs rgb,semantic")
    return labels
