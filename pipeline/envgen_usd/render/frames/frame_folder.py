"""The folder of images: its frames, their stage, and the image files."""

import hashlib
import json
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from typing import Any, TypeVar

from envgen_usd import __version__
from envgen_usd.errors import EnvgenError
from envgen_usd.models.array_types import ByteArray
from envgen_usd.render.cameras.camera_pose import Pose
from envgen_usd.render.cameras.camera_rig import Camera
from envgen_usd.render.frames.image_files import (
    write_depth,
    write_flow,
    write_instances,
    write_normals,
    write_png,
)
from envgen_usd.render.frames.label_images import LabelImages
from envgen_usd.render.frames.labels_json import labels_json
from envgen_usd.render.frames.object_boxes import ObjectBox
from envgen_usd.render.render_scene import Floats, Scene
from envgen_usd.render.stage.resolved_files import read_resolved
from envgen_usd.whole_files import make_folder, write_whole

SUFFIXES = {
    "rgb": "png",
    "semantic": "png",
    "semantic_colour": "png",
    "instance": "tif",
    "part": "png",
    "depth": "tif",
    "normals": "png",
    "objects": "json",
    "boxes": "json",
    "flow": "flo",
}
"""Folder and file suffix of each kind of image."""
LIDAR = "lidar"
"""Name of the output of scans, which have folders of their own."""
OUTPUTS = (*SUFFIXES, LIDAR)
"""Names of all outputs."""
DEFAULT_OUTPUTS = tuple(name for name in SUFFIXES if name not in {"boxes", "flow"})
"""Outputs of a run that names none: those that cost little."""
_LAYOUT = 2
"""Version of the files; frames of another version are removed."""
_FORMER = (("instance", "png"), ("full_id", "png"))
"""Folders and suffixes of earlier versions."""
_STAMP = "render.json"
_OPENED = (_STAMP, "cameras.json", "labels.json")
_TABLES = ("cameras.json", "labels.json", "things.json")
Content = TypeVar("Content")


class FrameFolder:
    """Images of a stage from a camera."""

    def __init__(self, path: Path, outputs: Collection[str] = DEFAULT_OUTPUTS) -> None:
        """Sets the folder and the kinds of its images; no file is created yet."""
        self._path = path
        self._suffixes = {name: suffix for name, suffix in SUFFIXES.items() if name in outputs}

    def open(
        self,
        mark: str,
        calibration: Mapping[str, object],
        poses: Sequence[Pose],
        records: Sequence[Mapping[str, object]] = (),
    ) -> int:
        """Prepares the folder for the images of a drive.

        Images of the same stage, camera and drive are kept, including frames beyond `poses`, which
        `cameras.json` still lists. All others are removed.

        Args:
            mark: Identifies stage and camera: their `fingerprint`.
            calibration: Camera and its place, recorded in `cameras.json`.
            poses: Camera pose of each frame.
            records: Light of each frame, recorded in `cameras.json`.

        Returns:
            Number of removed frames.

        Raises:
            EnvgenError: The folder cannot be written.
        """
        try:
            for name in ("", *self._suffixes):
                make_folder(self._path / name)
            stamp, drive = self._path / _STAMP, self._path / "cameras.json"
            frames = _rows(poses, records or [{}] * len(poses))
            earlier = self.rows()
            same = read_table(stamp).get("fingerprint") == mark
            common = min(len(earlier), len(frames))
            removed = 0
            if not same or earlier[:common] != frames[:common]:
                removed, earlier = self._remove_frames(), []
            write_whole(drive, _cameras(calibration, max(earlier, frames, key=len)))
            write_whole(self._path / "labels.json", labels_json())
            write_whole(stamp, json.dumps({"fingerprint": mark, "version": __version__}) + "\n")
        except OSError as error:
            raise EnvgenError(
                f"render: {self._path} cannot be written: {error.strerror}"
            ) from error
        return removed

    def rows(self) -> list[Mapping[str, Any]]:
        """Frames that ``cameras.json`` lists; none without the file."""
        rows: list[Mapping[str, Any]] = read_table(self._path / "cameras.json").get("frames", [])
        return rows

    def clear(self) -> int:
        """Removes the frames of a finished or interrupted run, and returns their number."""
        if not (self._path / _STAMP).is_file():
            return 0
        removed = self._remove_frames()
        for name in _TABLES:
            (self._path / name).unlink(missing_ok=True)
        for folder in (*SUFFIXES, *(name for name, _ in _FORMER), ""):
            with suppress(OSError):
                (self._path / folder).rmdir()
        return removed

    def _remove_frames(self) -> int:
        removed = self.count()
        (self._path / _STAMP).unlink(missing_ok=True)
        for stale in self._all_frames():
            stale.unlink()
        return removed

    def count(self) -> int:
        """Number of frames in the folder, complete or partial."""
        return len({path.stem for path in self._all_frames()})

    def has_tables(self) -> bool:
        """True if the files exist that belong to all frames."""
        return all((self._path / name).is_file() for name in _OPENED)

    def has(self, number: int) -> bool:
        """True if every image of a frame exists; each is written whole or not at all."""
        return all(self._file(name, number).is_file() for name in self._suffixes)

    def write(  # noqa: PLR0913, PLR0917 - the images of a frame
        self,
        number: int,
        rgb: ByteArray | None,
        depth: Floats,
        normals: Floats | None,
        images: LabelImages,
        flow: Floats | None = None,
        boxes: Sequence[ObjectBox] = (),
    ) -> None:
        """Writes the images of a frame that are outputs; no other label image is computed.

        Args:
            number: Number of the frame.
            rgb: H x W x 3; `None` if it is no output.
            depth: H x W, metres.
            normals: H x W x 3; `None` if they are no output.
            images: Labels.
            flow: H x W x 2; `None` if it is no output.
            boxes: Boxes of the instances.
        """
        if rgb is not None:
            self._write("rgb", number, write_png, lambda: rgb)
        if normals is not None:
            self._write("normals", number, write_normals, lambda: normals)
        self._write("depth", number, write_depth, lambda: depth)
        self._write("semantic", number, write_png, lambda: images.semantic)
        self._write("semantic_colour", number, write_png, lambda: images.colour)
        self._write("instance", number, write_instances, lambda: images.instance)
        self._write("part", number, write_png, lambda: images.part)
        if flow is not None:
            self._write("flow", number, write_flow, lambda: flow)
        self._write("boxes", number, write_whole, lambda: _boxes(boxes))
        self._write("objects", number, write_whole, lambda: _objects(images))

    def _write(
        self,
        name: str,
        number: int,
        write: Callable[[Path, Content], None],
        content: Callable[[], Content],
    ) -> None:
        """Writes a file of a frame, if its kind is an output."""
        if name in self._suffixes:
            write(self._file(name, number), content())

    def _file(self, name: str, number: int) -> Path:
        return self._path / name / f"{number:06d}.{self._suffixes[name]}"

    def _all_frames(self) -> Iterable[Path]:
        """Files that any run of this program wrote, by name."""
        for name, suffix in (*SUFFIXES.items(), *_FORMER):
            digits = "[0-9]" * 6
            yield from (self._path / name).glob(f"{digits}.{suffix}")


def fingerprint(
    layers: Collection[bytes], scene: Scene, picture: Mapping[str, object] | None = None
) -> str:
    """Hash of all inputs of an image besides camera and pose: version, layers, textures, light.

    `layers` are the hashes of the stage's layers.
    """
    digest = hashlib.sha256(f"{__version__} {_LAYOUT}".encode())
    paths = {t.path for material in scene.materials for t in material.textures.values()}
    textures = [hashlib.sha256(read_resolved(path)).digest() for path in paths]
    for part in sorted([*layers, *textures]):
        digest.update(part)
    light = scene.light
    for values in (light.sun_direction, light.sun, light.sky):
        digest.update(values.tobytes())
    digest.update(json.dumps(picture or {}, sort_keys=True, default=str).encode())
    return digest.hexdigest()


def camera_mark(inputs: str, camera: Camera) -> str:
    """Hash of a `fingerprint` and a camera."""
    figures = json.dumps(asdict(camera), sort_keys=True)
    return hashlib.sha256(f"{inputs} {figures}".encode()).hexdigest()


def read_table(path: Path) -> dict[str, Any]:
    """Content of a JSON file; empty if the file is missing or is not a table."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (FileNotFoundError, ValueError):
        return {}
    return content if isinstance(content, dict) else {}


def _rows(poses: Sequence[Pose], records: Sequence[Mapping[str, object]]) -> list[dict[str, Any]]:
    return [
        {
            "frame": number,
            "route": pose.route,
            "turn": pose.turn,
            **({} if pose.time is None else {"time": round(pose.time, 6)}),
            **({"vehicle": pose.vehicle} if pose.vehicle else {}),
            **record,
            "camera_to_world": pose.matrix.tolist(),
        }
        for number, (pose, record) in enumerate(zip(poses, records, strict=True))
    ]


def _cameras(calibration: Mapping[str, object], frames: Sequence[Mapping[str, Any]]) -> str:
    axes = "x right, y down, z ahead; pixel centres are whole numbers; world: metres, z up"
    normals = "(v - 32768) / 32767 along the camera's axes, towards it; v = 0 for no surface"
    content = {"axes": axes, "normals": normals, **calibration, "frames": [*frames]}
    return json.dumps(content, indent=1) + "\n"


def _boxes(boxes: Sequence[ObjectBox]) -> str:
    return "[\n" + ",\n".join(json.dumps(each.record()) for each in boxes) + "\n]\n"


def _objects(images: LabelImages) -> str:
    named = {str(value): path for value, path in sorted(images.objects.items())}
    return json.dumps(named, indent=1) + "\n"
