"""The ids that classes have in trainings."""

import numpy as np

from envgen_usd.errors import EnvgenError
from envgen_usd.label_taxonomy import labels
from envgen_usd.models.array_types import ByteArray

IDS = ("cityscapes_train_id", "kitti_360_train_id", "article_train_id", "id")
"""Ids of the classes; 255 is left out in training (`ignore_index`)."""


def id_table(ids: str) -> ByteArray:
    """The id of each class id, 256 values; 255 where no class has the class id.

    Args:
        ids: One of `IDS`.

    Raises:
        EnvgenError: The name of the ids is unknown.
    """
    if ids not in IDS:
        raise EnvgenError(f"unknown ids {ids}; known: {', '.join(IDS)}")
    table = np.full(256, 255, np.uint8)
    for entry in labels():
        table[entry.id] = getattr(entry, ids)
    return table
