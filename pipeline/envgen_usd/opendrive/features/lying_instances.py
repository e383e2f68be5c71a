"""Instances of objects that lie on the road, and those of extruded repeats (13.2)."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from envgen_usd.models.road import Road
from envgen_usd.models.road_objects import Outline, Repeat, RoadObject
from envgen_usd.opendrive.features.object_instances import Instance, at, instances
from envgen_usd.opendrive.features.roadside_poses import sample


def lying_instances(road: Road, road_object: RoadObject) -> Iterator[Instance]:
    """Yields the instances of a flat object; an extruded repeat becomes an outline on the road."""
    yield from instances(road, road_object)
    for repeat in road_object.repeats:
        outline = _extruded(road, road_object, repeat) if repeat.distance == 0 else None
        if outline is not None:
            single = replace(road_object, s=repeat.s, repeats=(), outlines=(outline,))
            yield from instances(road, single)


def _extruded(road: Road, road_object: RoadObject, repeat: Repeat) -> Outline | None:
    """Returns the area below an extruded repeat; `None` without a length or a width."""
    first, last = at(road_object, repeat, 0.0), at(road_object, repeat, 1.0)
    middle = (first["t"] + last["t"]) / 2
    s = sample(road, repeat.s, repeat.s + repeat.length, middle)
    if len(s) < 2 or max(first["width"], last["width"]) <= 0:
        return None
    share = (s - repeat.s) / repeat.length
    t, width, z, height = (
        first[name] + (last[name] - first[name]) * share
        for name in ("t", "width", "z_offset", "height")
    )
    left = np.column_stack([s, t + width / 2, z])
    right = np.column_stack([s, t - width / 2, z])
    ring = np.concatenate([right, left[::-1]])
    heights = np.concatenate([height, height[::-1]])
    return Outline(ring, heights, ("",) * len(ring), in_road=True)
