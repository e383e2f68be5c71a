"""A data set as a PyTorch `Dataset`."""

from collections.abc import Callable
from pathlib import Path
from typing import TypeAlias

import numpy as np
import torch
from torch.utils.data import Dataset

from envgen_usd.datasets.class_ids import id_table
from envgen_usd.datasets.dataset_index import IndexedFrame, read_index
from envgen_usd.datasets.frame_files import read_image
from envgen_usd.errors import EnvgenError

Sample: TypeAlias = tuple[torch.Tensor, torch.Tensor]
"""Picture, 3 x H x W, 0 to 1; classes, H x W, whole numbers."""


class Frames(Dataset[Sample]):
    """Pictures with their classes, of a split of a data set.

    ```python
    frames = Frames("set", "train", ids="cityscapes_train_id")
    picture, classes = frames[0]
    ```

    Attributes:
        frames: What the index says of each frame.
    """

    def __init__(
        self,
        folder: Path | str,
        split: str = "",
        *,
        ids: str = "cityscapes_train_id",
        transform: Callable[[torch.Tensor, torch.Tensor], Sample] | None = None,
    ) -> None:
        """Reads the index; images are read when they are asked for.

        Args:
            folder: Folder of the data set.
            split: Name of a split; empty for all frames.
            ids: Which ids the classes have: one of `class_ids.IDS`.
            transform: Called with picture and classes.

        Raises:
            EnvgenError: The folder holds no data set, or the split or the ids are unknown.
        """
        self._folder, self._transform = Path(folder), transform
        rows = read_index(self._folder)
        known = sorted({row.split for row in rows})
        if split and split not in known:
            raise EnvgenError(f"{folder}: unknown split {split}; known: {', '.join(known)}")
        self.frames: tuple[IndexedFrame, ...] = tuple(r for r in rows if split in {"", r.split})
        self._ids = id_table(ids)

    def __len__(self) -> int:
        """Number of frames."""
        return len(self.frames)

    def __getitem__(self, index: int) -> Sample:
        """A picture and its classes."""
        row = self.frames[index]
        rgb = np.array(read_image(self._folder / row.file("rgb")))
        semantic = read_image(self._folder / row.file("semantic"))
        picture = torch.from_numpy(rgb).permute(2, 0, 1).float().div(255.0)
        classes = torch.from_numpy(self._ids[semantic]).long()
        return self._transform(picture, classes) if self._transform else (picture, classes)
