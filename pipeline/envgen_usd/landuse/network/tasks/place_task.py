"""The task of filling real places: classes and buildings on land between given streets."""

from collections.abc import Sequence

import numpy as np
import torch
from torch import Tensor

from envgen_usd.landuse.landuse_preview import COLOURS
from envgen_usd.landuse.network.data.place_channels import (
    GIVEN,
    PLACE_CLASSES,
    PLACE_INPUTS,
    PLACE_OUTPUTS,
)
from envgen_usd.landuse.network.data.place_sample import PLACE_RAW, PlaceSample
from envgen_usd.landuse.network.tasks.class_task import ClassTask
from envgen_usd.models.array_types import BoolArray

PLACE_FIELDS = 8
"""Number of channels of `place_field_channels`."""
PLACE_RATE = 1e-2
"""Learning rate of the generator; a larger value takes larger steps."""
_BUILDINGS, _HOLE = ((176, 62, 48), (120, 60, 70), (90, 20, 20)), (20, 20, 20)


class PlaceTask(ClassTask[PlaceSample]):
    """Road, water and railway are given; classes of the other land and buildings are generated."""

    inputs, outputs, given = PLACE_INPUTS, PLACE_OUTPUTS, len(GIVEN)
    colours = np.array([*(COLOURS[kind] for kind in PLACE_CLASSES), *_BUILDINGS, _HOLE], np.uint8)

    def road(self, window: PlaceSample) -> BoolArray:
        """Cells that are given; quicker than by channels, which need the cores of buildings."""
        given: BoolArray = np.isin(window.classes, GIVEN)
        return given

    def fields(self, windows: Sequence[PlaceSample]) -> Tensor:
        """B x `PLACE_FIELDS` x H / 2 x W / 2."""
        return place_field_channels(torch.from_numpy(np.stack([one.raw for one in windows])))


def place_field_channels(raw: Tensor) -> Tensor:
    """Converts stored fields to the network's input.

    Args:
        raw: B x `PLACE_RAW` x H x W.

    Returns:
        B x `PLACE_FIELDS` x H x W: distance to the road on five scales, direction away from it,
        and distance to water or railway.
    """
    part = dict(zip(PLACE_RAW, raw.float().unbind(1), strict=True))
    distance = part["distance"]
    fields = [
        distance / 50 - 1,
        *(torch.tanh(distance / scale) for scale in (2.0, 6.0, 15.0, 40.0)),
        part["normal_x"],
        part["normal_y"],
        torch.tanh(part["barrier"] / 15),
    ]
    return torch.stack(fields, dim=1)
