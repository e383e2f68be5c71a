"""Reads the images of `render`, frame by frame."""

import json
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, overload

import numpy as np
import rasterio
from numpy.typing import NDArray
from PIL import Image

from envgen_usd.errors import EnvgenError
from envgen_usd.models.array_types import ByteArray, FloatArray
from envgen_usd.render.cameras.camera_rig import Camera
from envgen_usd.render.frames.frame_folder import SUFFIXES
from envgen_usd.render.frames.image_files import MOST_FLOW
from envgen_usd.toml_files import typed_table


@dataclass(frozen=True)
class Frame:
    """Images of a pose; each file is read at its first use.

    Attributes:
        folder: Folder of the frames.
        number: Number of the frame, from 0.
        camera_to_world: 4 x 4, from camera space (x right, y down, z forward) to world space
            (metres, z up).
        route: Number of the drive; frames of a drive share it.
        time: Seconds since the start of the drive, and of what moves on the stage; `None` for
            frames without a time.
    """

    folder: Path
    number: int
    camera_to_world: FloatArray
    route: int
    time: float | None = None

    @property
    def rgb(self) -> ByteArray:
        """H x W x 3, sRGB, 8 bit."""
        return np.asarray(self._image("rgb", "png"))

    @property
    def semantic(self) -> ByteArray:
        """H x W, class ids, as named by `FrameSet.classes`."""
        return np.asarray(self._image("semantic", "png"))

    @property
    def instance(self) -> NDArray[np.uint32]:
        """H x W, class id * 10,000,000 + n; an object of the stage has one value in all frames.

        n is 0 where a class has no instances.
        """
        return np.asarray(self._image("instance", "tif")).astype(np.uint32)

    @property
    def part(self) -> ByteArray:
        """H x W, part ids, as named by `FrameSet.parts`."""
        return np.asarray(self._image("part", "png"))

    @property
    def depth(self) -> NDArray[np.float32]:
        """H x W, metres along the optical axis, or from a fisheye camera; 0 in the sky."""
        return np.asarray(self._image("depth", "tif"))

    @property
    def normals(self) -> NDArray[np.float32]:
        """H x W x 3, unit normals towards the camera: x right, y down, z ahead; 0 in the sky."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", rasterio.errors.NotGeoreferencedWarning)
            # Pillow reads only 8 of 16 bits of colours.
            with rasterio.open(self._path("normals", "png")) as image:
                values = np.asarray(image.read()).transpose(1, 2, 0)
        normals = (values.astype(np.float32) - np.float32(32768.0)) / np.float32(32767.0)
        normals[~values.any(axis=2)] = 0.0
        return normals

    @property
    def objects(self) -> Mapping[int, str]:
        """Prim path by value of the instance image."""
        text = (self.folder / "objects" / f"{self.number:06d}.json").read_text("utf-8")
        return {int(value): str(prim) for value, prim in json.loads(text).items()}

    @property
    def boxes(self) -> Sequence[Mapping[str, Any]]:
        """Boxes of the visible instances, as `object_boxes.ObjectBox` describes them."""
        rows: list[dict[str, Any]] = json.loads(self._path("boxes", "json").read_text("utf-8"))
        return rows

    @property
    def flow(self) -> NDArray[np.float32]:
        """H x W x 2, pixels right and down to the place in the next frame; NaN if unknown."""
        content = self._path("flow", "flo").read_bytes()
        width, height = np.frombuffer(content, "<i4", 2, offset=4).tolist()
        flow = np.frombuffer(content, "<f4", offset=12).reshape(height, width, 2)
        return np.where(np.abs(flow) > MOST_FLOW, np.float32(np.nan), flow)

    def _image(self, name: str, suffix: str) -> Image.Image:
        return Image.open(self._path(name, suffix))

    def _path(self, name: str, suffix: str) -> Path:
        path = self.folder / name / f"{self.number:06d}.{suffix}"
        if not path.is_file():
            raise EnvgenError(f"{path}: is missing; render the frames with --outputs {name}")
        return path


@dataclass(frozen=True)
class FrameSet(Sequence[Frame]):
    """The frames of a folder, in the order of the drive.

    Attributes:
        folder: Folder of the frames.
        camera: Camera of all frames.
        classes: Class name by id, as in the semantic images.
        parts: Part name by id, as in the part images.
        frames: Frames in the order of the drive.
    """

    folder: Path
    camera: Camera
    classes: Mapping[int, str]
    parts: Mapping[int, str]
    frames: tuple[Frame, ...]

    def __repr__(self) -> str:
        """Folder, number of frames and size of the images."""
        size = f"{self.camera.width} x {self.camera.height}"
        return f"FrameSet('{self.folder}', {len(self.frames)} frames of {size} pixels)"

    def __len__(self) -> int:
        """Number of frames."""
        return len(self.frames)

    @overload
    def __getitem__(self, index: int) -> Frame: ...

    @overload
    def __getitem__(self, index: slice) -> Sequence[Frame]: ...

    def __getitem__(self, index: int | slice) -> Frame | Sequence[Frame]:
        """A frame, or a slice of the frames."""
        return self.frames[index]

    def __iter__(self) -> Iterator[Frame]:
        """The frames, in the order of the drive."""
        return iter(self.frames)


def read_frames(folder: Path | str) -> FrameSet:
    """Reads the output of `render_frames`; images are opened at their first use.

    Planned frames that are not yet rendered are left out.

    Args:
        folder: Holds ``cameras.json``, ``labels.json`` and a folder for each kind of image.

    Raises:
        EnvgenError: The folder holds no frames, or its tables cannot be read.
    """
    folder = Path(folder)
    drive = _table(folder / "cameras.json")
    if "cameras" in drive:
        names = ", ".join(str(row["name"]) for row in drive["cameras"])
        raise EnvgenError(f"{folder}: holds several cameras; read the folder of one: {names}")
    taxonomy = _table(folder / "labels.json")
    kinds = SUFFIXES.items()
    try:
        camera = typed_table(drive["camera"], Camera, f"{folder / 'cameras.json'}: camera")
        frames = tuple(
            Frame(
                folder,
                row["frame"],
                np.array(row["camera_to_world"]),
                row["route"],
                row.get("time"),
            )
            for row in drive["frames"]
            if any((folder / kind / f"{row['frame']:06d}.{end}").is_file() for kind, end in kinds)
        )
        classes = {int(row["id"]): str(row["name"]) for row in taxonomy["classes"]}
        parts = {int(number): str(name) for name, number in taxonomy["parts"].items()}
    except (KeyError, TypeError, ValueError) as error:
        raise EnvgenError(f"{folder}: not a folder of frames ({error!r})") from error
    return FrameSet(folder, camera, classes, parts, frames)


def _table(path: Path) -> dict[str, Any]:
    try:
        content: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise EnvgenError(f"{path}: cannot be read ({error}); render frames first") from error
    return content
