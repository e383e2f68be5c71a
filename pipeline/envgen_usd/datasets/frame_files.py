"""Files that several formats share: linked pictures, label arrays, cameras of the frames."""

import json
import os
import shutil
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from envgen_usd.datasets.dataset_index import IndexedFrame
from envgen_usd.errors import EnvgenError
from envgen_usd.image_pixels import UNREADABLE
from envgen_usd.models.array_types import ByteArray
from envgen_usd.whole_files import make_folder, whole_file

_AGAIN = "delete it and run envgen-usd dataset again, which makes it anew"
_THREADS = 2
Item = TypeVar("Item")
Result = TypeVar("Result")


@dataclass(frozen=True)
class FrameFiles:
    """A frame of a data set and its files.

    Attributes:
        root: Folder of the data set.
        frame: What the index says.
    """

    root: Path
    frame: IndexedFrame

    @property
    def rgb(self) -> Path:
        """File of the picture."""
        return self.root / self.frame.file("rgb")

    @property
    def semantic(self) -> ByteArray:
        """H x W, class ids."""
        return read_image(self.root / self.frame.file("semantic"))

    @property
    def instance(self) -> NDArray[np.uint32]:
        """H x W, instance values."""
        return read_image(self.root / self.frame.file("instance")).astype(np.uint32)

    @property
    def boxes(self) -> list[dict[str, Any]]:
        """Records of the objects that the frame shows."""
        rows: list[dict[str, Any]] = _read_json(self.root / self.frame.file("boxes"), list)
        return rows

    @property
    def cameras(self) -> dict[str, Any]:
        """Content of ``cameras.json``; not to be changed."""
        path = self.root / self.frame.folder / "cameras.json"
        return _cameras(path, path.stat().st_mtime_ns)

    @property
    def pose_row(self) -> dict[str, Any]:
        """What ``cameras.json`` says of the frame; not to be changed."""
        rows: list[dict[str, Any]] = self.cameras.get("frames", [])
        if not self.frame.frame < len(rows):
            path = self.root / self.frame.folder / "cameras.json"
            raise EnvgenError(f"{path}: lacks frame {self.frame.frame}; {_AGAIN}")
        return rows[self.frame.frame]

    @property
    def has_lens(self) -> bool:
        """True if the camera has another lens model than the pinhole."""
        lens = self.cameras["camera"].get("lens", {})
        return bool(lens.get("model", "pinhole") != "pinhole")

    @property
    def name(self) -> str:
        """A name of the frame that is unique in the data set, without underscores at its ends."""
        take = Path(self.frame.folder).relative_to("frames").as_posix().replace("/", "_")
        return f"{take}_{self.frame.frame:06d}"


@lru_cache(maxsize=64)
def _cameras(path: Path, _changed: int) -> dict[str, Any]:
    """Content of a file at a time of its last change."""
    content: dict[str, Any] = _read_json(path, dict)
    if not {"camera", "frames"} <= content.keys():
        raise EnvgenError(f"{path}: lacks its camera or its frames; {_AGAIN}")
    return content


def read_image(path: Path) -> NDArray[Any]:
    """Reads an image of a data set.

    Raises:
        EnvgenError: It is missing or damaged.
    """
    try:
        return np.asarray(Image.open(path))
    except UNREADABLE as error:
        raise EnvgenError(f"{path}: cannot be read as an image; {_AGAIN}") from error


def _read_json(path: Path, kind: type) -> Any:  # noqa: ANN401 - JSON
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise EnvgenError(f"{path}: cannot be read ({error}); {_AGAIN}") from error
    if not isinstance(content, kind):
        raise EnvgenError(f"{path}: holds something else than expected; {_AGAIN}")
    return content


def link_file(source: Path, target: Path) -> None:
    """Gives a file a second name; copies it where the file system has no hard links.

    Files of a data set are only ever replaced whole, so the names do not change each other.

    Raises:
        EnvgenError: The file cannot be written.
    """
    make_folder(target.parent)
    if target.exists() and target.samefile(source):
        return
    with whole_file(target) as part:
        part.unlink(missing_ok=True)
        try:
            os.link(source, part)
        except OSError:
            shutil.copyfile(source, part)


def each_frame(
    frames: Sequence[Item],
    write: Callable[[Item], Result],
    progress: Callable[[int, int], None],
) -> list[Result]:
    """Calls a function with each frame, in threads; returns the results in the frames' order."""
    results = []
    with ThreadPoolExecutor(_THREADS) as pool:
        for result in pool.map(write, frames):
            results.append(result)
            progress(len(results), len(frames))
    return results
