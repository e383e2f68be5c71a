"""All tasks of the network."""

from collections.abc import Mapping
from typing import Any

from envgen_usd.landuse.network.data.environment_conditions import CONDITIONS
from envgen_usd.landuse.network.data.height_sample import HEIGHT_CONDITIONS
from envgen_usd.landuse.network.data.known_fields import FIELDS
from envgen_usd.landuse.network.data.place_sample import PLACE_CONDITIONS
from envgen_usd.landuse.network.tasks.height_task import HEIGHT_FIELDS, HeightTask
from envgen_usd.landuse.network.tasks.landuse_task import LanduseTask
from envgen_usd.landuse.network.tasks.network_task import Target, Task
from envgen_usd.landuse.network.tasks.place_task import PLACE_FIELDS, PlaceTask

_TASKS: Mapping[Target, Task[Any]] = {
    "landuse": LanduseTask(),
    "height": HeightTask(),
    "place": PlaceTask(),
}

_INPUTS: Mapping[Target, tuple[int, int]] = {
    "landuse": (FIELDS, CONDITIONS),
    "height": (HEIGHT_FIELDS, HEIGHT_CONDITIONS),
    "place": (PLACE_FIELDS, PLACE_CONDITIONS),
}


def inputs_of(target: Target) -> tuple[int, int]:
    """Number of the fields, and length of the condition, that networks of a target are given."""
    return _INPUTS[target]


def task_of(target: Target) -> Task[Any]:
    """Returns the task of a target."""
    return _TASKS[target]
