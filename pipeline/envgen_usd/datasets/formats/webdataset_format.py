"""The layout of WebDataset: shards that are tar files (github.com/webdataset/webdataset)."""

import hashlib
import io
import json
import tarfile
from collections.abc import Callable, Collection, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from envgen_usd.datasets.frame_files import FrameFiles
from envgen_usd.datasets.frame_scans import lidars_of
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
    the index says, with camera and pose. The samples of a rig's first camera have its scans, too:
    ``<key>.<lidar>.points.npy`` (N x 4: x ahead, y left, z up in the lidar's frame, metres;
    intensity, 0 to 1), ``.semantic.npy``, ``.instance.npy`` and ``.ring.npy`` (N each), with the
    places of the lidars in the JSON. Frames are in the order of the hash of their keys, since
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
    with_scans = set(_first_cameras(frames))
    shards: list[tuple[Path, Sequence[FrameFiles]]] = []
    for split in dict.fromkeys(each.frame.split for each in frames):
        those = sorted((each for each in frames if each.frame.split == split), key=_order)
        for number, first in enumerate(range(0, len(those), SHARD)):
            path = out / f"{split}-{number:0{_DIGITS}d}.tar"
            shards.append((path, those[first : first + SHARD]))
    done = 0
    with ThreadPoolExecutor(_THREADS) as pool:
        for count in pool.map(lambda shard: _write_shard(shard[0], shard[1], with_scans), shards):
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


def _first_cameras(frames: Sequence[FrameFiles]) -> Iterator[str]:
    """Folder of the first camera of each take; a scan is stored once for all cameras."""
    takes: set[Path] = set()
    for each in frames:
        folder = each.frame.folder
        take = Path(*Path(folder).parts[:3])
        if take not in takes:
            takes.add(take)
            yield folder


def _write_shard(path: Path, frames: Sequence[FrameFiles], with_scans: Collection[str]) -> int:
    """Writes a shard; returns the number of its frames."""
    with (
        whole_file(path) as part,
        tarfile.open(part, "w", format=tarfile.USTAR_FORMAT) as archive,
    ):
        for each in frames:
            for name, content in _files(each, scans=each.frame.folder in with_scans):
                entry = tarfile.TarInfo(name)
                entry.size, entry.mode = len(content), _MODE
                archive.addfile(entry, io.BytesIO(content))
    return len(frames)


def _files(each: FrameFiles, *, scans: bool) -> Iterator[tuple[str, bytes]]:
    """Name and content of the files of a sample."""
    key = sample_key(each)
    for kind, suffix in SUFFIXES.items():
        path = each.root / each.frame.file(kind)
        if path.is_file():
            yield f"{key}.{kind}.{suffix}", path.read_bytes()
    record = asdict(each.frame) | {
        "intrinsics": each.cameras["camera"],
        "vehicle_from_camera": each.cameras["vehicle_from_camera"],
        "camera_to_world": each.pose_row["camera_to_world"],
    }
    if scans:
        record["lidars"] = {}
        for lidar in lidars_of(each):
            scan = lidar.read(each.frame.frame)
            record["lidars"][lidar.name] = {
                "vehicle_from_lidar": lidar.vehicle_from_lidar.tolist(),
                "lidar_to_world": scan.lidar_to_world.tolist(),
            }
            arrays: dict[str, NDArray[Any]] = {
                "points": scan.points,
                "semantic": scan.classes,
                "instance": scan.instances,
                "ring": scan.rings,
            }
            name = lidar.name.replace(".", "-")
            for kind, values in arrays.items():
                yield f"{key}.{name}.{kind}.npy", _npy(values)
    yield f"{key}.json", (json.dumps(record) + "\n").encode()


def _npy(values: NDArray[Any]) -> bytes:
    stream = io.BytesIO()
    np.save(stream, values, allow_pickle=False)
    return stream.getvalue()
