"""The layout of WebDataset: shards that are tar files (github.com/webdataset/webdataset)."""

import hashlib
import io
import json
import tarfile
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from pathlib import Path

from envgen_usd.datasets.frame_files import FrameFiles
from envgen_usd.errors import EnvgenError
from envgen_usd.render.frames.frame_folder import SUFFIXES
from envgen_usd.whole_files import make_folder, whole_file

SHARD = 200
"""Largest number of frames of a shard; a larger value makes fewer and larger files."""
_DIGITS = 6
_THREADS = 2
_MODE = 0o644


def write_webdataset(
    frames: Sequence[FrameFiles], out: Path, progress: Callable[[int, int], None]
) -> None:
    """Writes ``<split>-000000.tar``, ... with all images of each frame.

    A sample has the files ``<key>.rgb.png``, ``<key>.semantic.png``, ... and ``<key>.json``: what
    the index says, with camera and pose. Frames are in the order of the hash of their keys, since
    readers shuffle little more than the order of the shards. The bytes follow from the frames
    alone.

    Args:
        frames: Frames of the data set.
        out: Folder of the format.
        progress: Called with the frames done and their number.

    Raises:
        EnvgenError: Two frames have one key, or a file cannot be written.
    """
    _check_keys(frames)
    make_folder(out)
    shards: list[tuple[Path, Sequence[FrameFiles]]] = []
    for split in dict.fromkeys(each.frame.split for each in frames):
        those = sorted((each for each in frames if each.frame.split == split), key=_order)
        for number, first in enumerate(range(0, len(those), SHARD)):
            path = out / f"{split}-{number:0{_DIGITS}d}.tar"
            shards.append((path, those[first : first + SHARD]))
    done = 0
    with ThreadPoolExecutor(_THREADS) as pool:
        for count in pool.map(lambda shard: _write_shard(*shard), shards):
            done += count
            progress(done, len(frames))
    wanted = {path for path, _ in shards}
    for stale in sorted(set(out.glob(f"*-{'[0-9]' * _DIGITS}.tar")) - wanted):
        stale.unlink()


def sample_key(each: FrameFiles) -> str:
    """Key of a frame; what follows the first dot of a name is the kind of file."""
    return each.name.replace(".", "-")


def _check_keys(frames: Sequence[FrameFiles]) -> None:
    keys: set[str] = set()
    for each in frames:
        key = sample_key(each)
        if key in keys:
            raise EnvgenError(f"webdataset: two frames have the key {key}; rename a weather or rig")
        keys.add(key)


def _order(each: FrameFiles) -> bytes:
    return hashlib.sha256(sample_key(each).encode()).digest()


def _write_shard(path: Path, frames: Sequence[FrameFiles]) -> int:
    """Writes a shard; returns the number of its frames."""
    with (
        whole_file(path) as part,
        tarfile.open(part, "w", format=tarfile.USTAR_FORMAT) as archive,
    ):
        for each in frames:
            for name, content in _files(each):
                entry = tarfile.TarInfo(name)
                entry.size, entry.mode = len(content), _MODE
                archive.addfile(entry, io.BytesIO(content))
    return len(frames)


def _files(each: FrameFiles) -> Iterator[tuple[str, bytes]]:
    """Name and content of the files of a sample."""
    key = sample_key(each)
    for kind, suffix in SUFFIXES.items():
        path = each.root / each.frame.file(kind)
        if path.is_file():
            yield f"{key}.{kind}.{suffix}", path.read_bytes()
    pose = {"camera_to_world": each.pose_row["camera_to_world"]}
    record = asdict(each.frame) | {"intrinsics": each.cameras["camera"]} | pose
    yield f"{key}.json", (json.dumps(record) + "\n").encode()
