"""The scans of a lidar or of a data set, as a sequence for trainings."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import overload

from envgen_usd.datasets.class_ids import id_table
from envgen_usd.datasets.dataset_index import INDEX, read_index
from envgen_usd.datasets.frame_files import FrameFiles
from envgen_usd.datasets.frame_scans import LidarFiles, Scan, lidar_files, lidars_of
from envgen_usd.errors import EnvgenError
from envgen_usd.models.array_types import ByteArray
from envgen_usd.render.frames.scan_folder import SCANS


@dataclass(frozen=True, eq=False)
class ScanSet(Sequence[Scan]):
    """Scans in the order of the frames; each is read anew whenever it is asked for.

    PyTorch's `DataLoader` takes it as a data set, with a `collate_fn` for scans of unlike sizes.

    Attributes:
        scans: Lidar and number of the frame of each scan.
        table: Id of each class id.
    """

    scans: tuple[tuple[LidarFiles, int], ...]
    table: ByteArray

    def __repr__(self) -> str:
        """Number of scans and of lidars' folders."""
        folders = len({lidar.folder for lidar, _ in self.scans})
        return f"ScanSet({len(self.scans)} scans in {folders} folders)"

    def __len__(self) -> int:
        """Number of scans."""
        return len(self.scans)

    @overload
    def __getitem__(self, index: int) -> Scan: ...

    @overload
    def __getitem__(self, index: slice) -> "ScanSet": ...

    def __getitem__(self, index: int | slice) -> "Scan | ScanSet":
        """A scan, or a slice of the scans."""
        if isinstance(index, slice):
            return replace(self, scans=self.scans[index])
        lidar, number = self.scans[index]
        scan = lidar.read(number)
        return replace(scan, classes=self.table[scan.classes])


def read_scans(folder: Path | str, split: str = "", *, ids: str = "id") -> ScanSet:
    """Reads the scans of a lidar, or those of all lidars of a data set.

    ```python
    for scan in read_scans("town/frames/velodyne"):
        ground = scan.points[scan.classes == 7]
    ```

    Args:
        folder: Folder of a lidar, with ``lidar.json``, or of a data set, with ``index.jsonl``.
        split: Name of a split of the data set; empty for all frames.
        ids: Which ids the classes have: one of `class_ids.IDS`; 255 is void.

    Raises:
        EnvgenError: The folder holds no scans, they are LAS files, or split or ids are unknown.
    """
    folder, table = Path(folder), id_table(ids)
    if (folder / INDEX).is_file():
        scans = _of_dataset(folder, split)
    elif split:
        raise EnvgenError(f"{folder}: split {split}: only a data set ({INDEX}) has splits")
    elif (folder / SCANS).is_file():
        lidar = lidar_files(folder / SCANS)
        numbers = [int(row["frame"]) for row in lidar.record["frames"]]
        scans = [(lidar, number) for number in numbers if lidar.has(number)]
    else:
        known = ", ".join(path.parent.name for path in sorted(folder.glob(f"*/{SCANS}")))
        remedy = f"read the folder of a lidar: {known}" if known else "scan with --outputs lidar"
        raise EnvgenError(f"{folder}: holds neither {SCANS} nor {INDEX}; {remedy}")
    if not scans:
        raise EnvgenError(f"{folder}: holds no scans; add lidar to the outputs")
    return ScanSet(tuple(scans), table)


def _of_dataset(folder: Path, split: str) -> list[tuple[LidarFiles, int]]:
    rows = read_index(folder)
    known = sorted({row.split for row in rows})
    if split and split not in known:
        raise EnvgenError(f"{folder}: unknown split {split}; known: {', '.join(known)}")
    scans: dict[tuple[Path, int], LidarFiles] = {}
    for row in rows:
        if split in {"", row.split}:
            for lidar in lidars_of(FrameFiles(folder, row)):
                scans[lidar.folder, row.frame] = lidar
    return [(lidar, number) for (_, number), lidar in scans.items()]
