"""The index of a data set: what each frame shows, and in which split it is."""

import json
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from envgen_usd.errors import EnvgenError
from envgen_usd.render.frames.frame_folder import SUFFIXES
from envgen_usd.toml_files import typed_table
from envgen_usd.whole_files import make_folder, write_whole

INDEX = "index.jsonl"
"""File with a line for each frame of each camera."""


@dataclass(frozen=True)
class IndexedFrame:
    """A frame of a camera.

    Attributes:
        split: Split of its street.
        folder: Folder of the camera's frames, relative to the data set.
        frame: Number of the frame in its folder.
        road: Name of the road file.
        street: Least id of the roads of its street.
        country: Country of the environment.
        area: Area type.
        seed: Seed of the town.
        weather: Weather that was drawn; empty for the light of the stage.
        rig: Name of the rig.
        camera: Name of the camera.
        place: x, y, z of the camera, metres.
    """

    split: str
    folder: str
    frame: int
    road: str
    street: str
    country: str
    area: str
    seed: int
    weather: str
    rig: str
    camera: str
    place: tuple[float, float, float]

    @property
    def town(self) -> str:
        """Name of the town: road, country, area and seed."""
        return f"{self.road}_{self.country}_{self.area}_{self.seed}"

    def file(self, kind: str) -> str:
        """Path of an image, relative to the data set."""
        return f"{self.folder}/{kind}/{self.frame:06d}.{SUFFIXES[kind]}"


def write_index(folder: Path, frames: Sequence[IndexedFrame], splits: Iterable[str]) -> None:
    """Writes `index.jsonl`, and a list of frames for each split.

    Args:
        folder: Folder of the data set.
        frames: All frames in their order.
        splits: Names of the splits.

    Raises:
        EnvgenError: A file cannot be written.
    """
    write_whole(folder / INDEX, "".join(json.dumps(asdict(each)) + "\n" for each in frames))
    make_folder(folder / "splits")
    for split in splits:
        lines = [f"{each.folder} {each.frame:06d}\n" for each in frames if each.split == split]
        write_whole(folder / "splits" / f"{split}.txt", "".join(lines))


def read_index(folder: Path) -> tuple[IndexedFrame, ...]:
    """Reads the index of a finished data set.

    Raises:
        EnvgenError: The folder holds no finished data set, or its index cannot be read.
    """
    path = folder / INDEX
    try:
        rows = [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]
    except FileNotFoundError as error:
        fault = "holds no finished data set; run envgen-usd dataset"
        raise EnvgenError(f"{folder}: {fault}") from error
    except (OSError, ValueError) as error:
        raise EnvgenError(f"{path}: cannot be read ({error})") from error
    return tuple(
        typed_table(row, IndexedFrame, f"{path}: line {n}") for n, row in enumerate(rows, 1)
    )
