"""The kinds of maps that a network can be trained on."""

from collections.abc import Mapping
from typing import Any

from envgen_usd.landuse.network.config import Target
from envgen_usd.landuse.network.height_task import HeightTask
from envgen_usd.landuse.network.landuse_task import LanduseTask
from envgen_usd.landuse.network.task import Task

_TASKS: Mapping[Target, Task[Any]] = {"landuse": LanduseTask(), "height": HeightTask()}


def task_of(target: Target) -> Task[Any]:
    """What a network with that target is made for."""
    return _TASKS[target]
