"""The task of filling holes of class maps."""

from collections.abc import Sequence

import numpy as np
import torch
from torch import Tensor

from envgen_usd.landuse.network.data.class_channels import INPUTS, OUTPUTS, ROAD
from envgen_usd.landuse.network.data.known_fields import expand
from envgen_usd.landuse.network.data.landuse_scenes import LanduseSample
from envgen_usd.landuse.network.tasks.class_task import ClassTask

COLOURS = np.array(
    [
        (80, 80, 84),
        (124, 172, 86),
        (66, 122, 46),
        (176, 222, 136),
        (184, 156, 118),
        (236, 214, 130),
        (24, 74, 34),
        (206, 44, 40),
        (20, 20, 20),
    ],
    dtype=np.uint8,
)
"""Colour of each input channel; the last colour is for the hole."""


class LanduseTask(ClassTask[LanduseSample]):
    """Inputs are one-hot classes, outputs are logits of all classes except road."""

    inputs, outputs, given = INPUTS, OUTPUTS, ROAD + 1
    colours = COLOURS

    def fields(self, windows: Sequence[LanduseSample]) -> Tensor:
        """B x `FIELDS` x H / 2 x W / 2."""
        return expand(torch.from_numpy(np.stack([window.raw for window in windows])))
