"""The layouts of other data sets that a data set can be written in."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

from envgen_usd.datasets.dataset_index import IndexedFrame
from envgen_usd.datasets.formats.cityscapes_format import write_cityscapes
from envgen_usd.datasets.formats.coco_format import write_coco
from envgen_usd.datasets.formats.kitti360.kitti360_format import write_kitti360
from envgen_usd.datasets.formats.nuscenes.nuscenes_format import write_nuscenes
from envgen_usd.datasets.formats.rerun_recording import write_rerun
from envgen_usd.datasets.formats.webdataset_format import write_webdataset
from envgen_usd.datasets.formats.yolo_format import write_yolo
from envgen_usd.datasets.frame_files import FrameFiles
from envgen_usd.datasets.frame_scans import check_scan_format
from envgen_usd.errors import EnvgenError
from envgen_usd.render.frames.frame_folder import LIDAR, SUFFIXES
from envgen_usd.render.lidar.scan_files import KITTI

Writer: TypeAlias = Callable[[Sequence[FrameFiles], Path, Callable[[int, int], None]], None]


@dataclass(frozen=True)
class Format:
    """A layout.

    Attributes:
        write: Writes it.
        outputs: Kinds of images that it is made from.
        scans: True if it has a place for scans of lidars.
    """

    write: Writer
    outputs: tuple[str, ...]
    scans: bool = False


FORMATS: Mapping[str, Format] = {
    "cityscapes": Format(write_cityscapes, ("rgb", "semantic")),
    "coco": Format(write_coco, ("rgb", "instance")),
    "kitti360": Format(write_kitti360, ("rgb", "semantic", "instance"), scans=True),
    "nuscenes": Format(write_nuscenes, ("rgb", "boxes"), scans=True),
    "webdataset": Format(write_webdataset, ("rgb",), scans=True),
    "yolo": Format(write_yolo, ("rgb", "instance")),
}


def check_formats(
    names: Collection[str], outputs: Collection[str], lidar_format: str = KITTI
) -> None:
    """Checks the names of formats, and that the outputs are enough for them.

    Args:
        names: Names of the formats.
        outputs: Outputs that there are, or will be.
        lidar_format: Files of the output ``lidar``.

    Raises:
        EnvgenError: A format is unknown, needs another output, or cannot read the scans.
    """
    for name in names:
        if name not in FORMATS:
            raise EnvgenError(f"unknown format {name}; known: {', '.join(FORMATS)}")
        missing = [each for each in FORMATS[name].outputs if each not in outputs]
        if missing:
            text = f"{name} needs the outputs {', '.join(missing)}"
            raise EnvgenError(f"{text}; add them to `outputs` of the recipe")
        if FORMATS[name].scans and LIDAR in outputs:
            check_scan_format(lidar_format)


def write_formats(
    folder: Path,
    frames: Sequence[IndexedFrame],
    names: Collection[str],
    progress: Callable[[str, int, int], None] = lambda *_: None,
) -> None:
    """Writes formats into folders of their names in the folder of a data set.

    Args:
        folder: Folder of the data set.
        frames: Its frames.
        names: Names of the formats.
        progress: Called with the step's name, the parts done and the total.

    Raises:
        EnvgenError: The data set lacks an output, or a file cannot be written.
    """
    kinds = [kind for kind in SUFFIXES if _has(folder, frames, kind)]
    check_formats(names, kinds)
    files = [FrameFiles(folder, frame) for frame in frames]
    for name in dict.fromkeys(names):

        def told(done: int, total: int, step: str = f"write {name}") -> None:
            progress(step, done, total)

        FORMATS[name].write(files, folder / name, told)


def write_recording(
    folder: Path,
    frames: Sequence[IndexedFrame],
    out: Path,
    progress: Callable[[str, int, int], None] = lambda *_: None,
) -> None:
    """Writes a recording for the Rerun viewer.

    Args:
        folder: Folder of the data set.
        frames: Its frames.
        out: The recording, an .rrd file.
        progress: Called with the step's name, the parts done and the total.

    Raises:
        EnvgenError: rerun-sdk or a town is missing, or the file cannot be written.
    """
    files = [FrameFiles(folder, frame) for frame in frames]
    write_rerun(files, out, lambda done, total: progress("write recording", done, total))


def _has(folder: Path, frames: Sequence[IndexedFrame], kind: str) -> bool:
    return bool(frames) and (folder / frames[0].file(kind)).is_file()
