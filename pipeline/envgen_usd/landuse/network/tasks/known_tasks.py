"""All tasks of the network."""

from collections.abc import Mapping
from typing import Any

from envgen_usd.landuse.network.tasks.height_task import HeightTask
from envgen_usd.landuse.network.tasks.landuse_task import LanduseTask
from envgen_usd.landuse.network.tasks.network_task import Target, Task
from envgen_usd.landuse.network.tasks.place_task import PlaceTask

_TASKS: Mapping[Target, Task[Any]] = {
    "landuse": LanduseTask(),
    "height": HeightTask(),
    "place": PlaceTask(),
}


def task_of(target: Target) -> Task[Any]:
    """Returns the task of a target."""
    return _TASKS[target]
