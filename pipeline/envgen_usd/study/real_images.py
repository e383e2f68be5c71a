"""Real driving images with labels: KITTI-360, Cityscapes, CamVid, or folders with a class map."""

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from envgen_usd.errors import EnvgenError
from envgen_usd.input_paths import check_input_folder
from envgen_usd.study.labelled_images import LabelledImage, full_classes
from envgen_usd.study.study_classes import (
    CLASSES,
    ClassTable,
    camvid_frame_table,
    mapped_table,
    number_table,
    segnet_table,
    street_table,
)

_PICTURES = (".png", ".jpg", ".jpeg")
_FRAME = re.compile(r"([_-][a-z]?)?\d+$")
"""The number of a frame at the end of a file name; what stands before it names the drive."""
_Pair = tuple[Path, Path, str]
"""Picture, labels and sequence."""


@dataclass(frozen=True)
class RealImages:
    """A real data set.

    Attributes:
        layout: Name of its layout.
        images: The images by sequence and name.
        frame_table: Classes of our frames, merged as this data set merges its own.
    """

    layout: str
    images: tuple[LabelledImage, ...]
    frame_table: ClassTable

    @property
    def sequences(self) -> tuple[str, ...]:
        """Names of the sequences, sorted."""
        return tuple(sorted({image.sequence for image in self.images}))


def read_real_images(folder: Path, classes: Path | None = None, part: str = "") -> RealImages:
    """Finds the labelled images of a real data set; of ``labels``, whether any shows terrain.

    Layouts are told apart by their folders: ``leftImg8bit`` and ``gtFine`` (Cityscapes, a city is a
    sequence), ``data_2d_raw`` and ``data_2d_semantics`` (KITTI-360), ``trainannot`` (CamVid of
    SegNet's tutorial), or ``images`` and ``labels`` with equal file names.

    Args:
        folder: Folder of the data set.
        classes: Class map of ``images`` and ``labels``; without it their values are 0 to 6 and 255.
        part: Part of the data set, e.g. train; empty: train where there is such a part, else all.

    Raises:
        EnvgenError: The folder is missing, has no known layout, or an image has no labels.
    """
    check_input_folder(folder, "name the folder of a real data set", "--real")
    for mark, layout, find, table in _LAYOUTS:
        if not (folder / mark).is_dir():
            continue
        numbers = mapped_table(classes) if classes else table()
        found = [
            LabelledImage(picture, labels, sequence, numbers.tobytes())
            for picture, labels, sequence in find(folder, part)
        ]
        if not found:
            raise EnvgenError(f"{folder}: holds no labelled images of part '{part or 'train'}'")
        return RealImages(
            layout,
            tuple(sorted(found, key=lambda image: (image.sequence, image.name))),
            _frame_table(layout, found),
        )
    marks = ", ".join(f"{mark} ({layout})" for mark, layout, _, _ in _LAYOUTS)
    raise EnvgenError(f"{folder}: has none of the folders of a known layout: {marks}")


def _frame_table(layout: str, images: Sequence[LabelledImage]) -> ClassTable:
    """Classes of our frames beside real images."""
    if layout not in {"camvid", "folders"}:
        return street_table()
    # Where no label says grass, grass counts as vegetation, as in CamVid.
    terrain = CLASSES.index("terrain")
    return camvid_frame_table(
        has_terrain=layout == "folders"
        and any(bool((full_classes(image) == terrain).any()) for image in images)
    )


def _cityscapes(folder: Path, part: str) -> Iterator[_Pair]:
    for picture in sorted((folder / "leftImg8bit" / (part or "train")).glob("*/*.png")):
        city = picture.parent.name
        stem = picture.name.removesuffix("_leftImg8bit.png")
        place = folder / "gtFine" / (part or "train") / city
        yield picture, _existing(place / f"{stem}_gtFine_labelIds.png", picture), city


def _kitti_360(folder: Path, part: str) -> Iterator[_Pair]:
    """Frames that have labels; of the raw images only a part has."""
    semantics = folder / "data_2d_semantics" / (part or "train")
    for labels in sorted(semantics.glob("*/image_00/semantic/*.png")):
        drive = labels.parts[-4]
        picture = folder / "data_2d_raw" / drive / "image_00" / "data_rect" / labels.name
        if not picture.is_file():
            raise EnvgenError(f"{picture}: is missing, the picture of {labels}; copy it there")
        yield picture, labels, drive


def _segnet(folder: Path, part: str) -> Iterator[_Pair]:
    for picture in _pictures(folder / (part or "train")):
        labels = folder / f"{part or 'train'}annot" / f"{picture.stem}.png"
        yield picture, _existing(labels, picture), _sequence(picture)


def _folders(folder: Path, part: str) -> Iterator[_Pair]:
    images = folder / "images"
    part = part or ("train" if (images / "train").is_dir() else "")
    if not (folder / "labels").is_dir():
        raise EnvgenError(f"{folder / 'labels'}: is missing; labels have the names of images")
    for picture in _pictures(images / part):
        place = folder / "labels" / picture.relative_to(images)
        yield picture, _existing(place.with_suffix(".png"), picture), _sequence(picture)


_LAYOUTS: tuple[
    tuple[str, str, Callable[[Path, str], Iterator[_Pair]], Callable[[], ClassTable]], ...
] = (
    ("leftImg8bit", "cityscapes", _cityscapes, street_table),
    ("data_2d_raw", "kitti360", _kitti_360, street_table),
    ("trainannot", "camvid", _segnet, segnet_table),
    ("images", "folders", _folders, number_table),
)
"""Folder that marks a layout, its name, how its files are found, and its classes."""


def _pictures(folder: Path) -> list[Path]:
    check_input_folder(folder, "name another part with --part")
    return sorted(p for p in folder.rglob("*") if p.suffix.lower() in _PICTURES)


def _existing(labels: Path, picture: Path) -> Path:
    if not labels.is_file():
        raise EnvgenError(f"{picture}: has no labels ({labels} is missing); add them, or remove it")
    return labels


def _sequence(picture: Path) -> str:
    """What stands before the number of the frame; the whole name if nothing does."""
    return _FRAME.sub("", picture.stem) or picture.stem
