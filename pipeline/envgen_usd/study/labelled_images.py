"""Labelled images in memory: pictures of a common size, and their classes."""

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from PIL import Image, UnidentifiedImageError

from envgen_usd.errors import EnvgenError
from envgen_usd.image_pixels import UNREADABLE
from envgen_usd.models.array_types import ByteArray
from envgen_usd.study.study_classes import CLASSES, UNKNOWN

Size = tuple[int, int]
"""Width and height, pixels."""
_KEPT = 6000
"""Decoded images that a process keeps; a larger value reads files less often and takes memory."""


@dataclass(frozen=True)
class LabelledImage:
    """A picture and its label image.

    Attributes:
        picture: File of the picture.
        labels: File of the label image, 8 bit.
        sequence: The drive that it is from.
        table: 256 bytes: the class of each label value.
    """

    picture: Path
    labels: Path
    sequence: str
    table: bytes

    @property
    def name(self) -> str:
        """Name without folder and suffix."""
        return self.picture.stem


@dataclass(frozen=True, eq=False)
class Images:
    """Decoded images of one size.

    Attributes:
        pictures: N x H x W x 3, sRGB, 0 to 255.
        classes: N x H x W, 0 to 6 or `VOID`.
    """

    pictures: ByteArray
    classes: ByteArray

    def __len__(self) -> int:
        """Number of images."""
        return len(self.pictures)


def images_digest(images: Sequence[LabelledImage]) -> str:
    """A text that differs where names, sequences, sizes of files or class tables differ.

    Raises:
        OSError: A file is gone.
    """
    files = [
        [image.name, image.sequence, image.picture.stat().st_size, image.labels.stat().st_size]
        for image in images
    ]
    tables = sorted({image.table.hex() for image in images})
    return hashlib.sha256(json.dumps([files, tables]).encode()).hexdigest()


def decoded(images: Sequence[LabelledImage], size: Size) -> Images:
    """Reads images at a common size: pictures bilinear, classes by the nearest pixel.

    Raises:
        EnvgenError: A file cannot be read, or has a label value that its class map does not name.
    """
    pairs = [_decoded_pair(image, size) for image in images]
    width, height = size
    if not pairs:
        return Images(
            np.zeros((0, height, width, 3), np.uint8), np.zeros((0, height, width), np.uint8)
        )
    return Images(np.stack([p for p, _ in pairs]), np.stack([c for _, c in pairs]))


def full_classes(image: LabelledImage) -> ByteArray:
    """The classes of an image in the size of its file, H x W.

    Raises:
        EnvgenError: The file cannot be read, or has a label value that its class map does not name.
    """
    return _classes(image, _opened(image.labels))


@lru_cache(maxsize=_KEPT)
def _decoded_pair(image: LabelledImage, size: Size) -> tuple[ByteArray, ByteArray]:
    picture = _opened(image.picture).convert("RGB").resize(size, Image.Resampling.BILINEAR)
    labels = _opened(image.labels).resize(size, Image.Resampling.NEAREST)
    return np.asarray(picture), _classes(image, labels)


def _classes(image: LabelledImage, labels: Image.Image) -> ByteArray:
    if labels.mode not in {"L", "P"}:
        raise EnvgenError(
            f"{image.labels}: is a {labels.mode} image; labels are 8-bit images with a value"
            " for each pixel"
        )
    values = np.asarray(labels)
    classes: ByteArray = np.frombuffer(image.table, np.uint8)[values]
    if (classes == UNKNOWN).any():
        strange = sorted({int(value) for value in np.unique(values[classes == UNKNOWN])})
        raise EnvgenError(
            f"{image.labels}: label value {strange[0]} is no class of {', '.join(CLASSES)};"
            " name it in a class map (--classes MAP.toml), there under void if need be"
        )
    return classes


def _opened(path: Path) -> Image.Image:
    try:
        image: Image.Image = Image.open(path)
        image.load()
    except UnidentifiedImageError as error:
        raise EnvgenError(f"{path}: is no image; remove it, or copy it again") from error
    except UNREADABLE as error:
        raise EnvgenError(f"{path}: cannot be read ({error}); copy it again") from error
    return image
