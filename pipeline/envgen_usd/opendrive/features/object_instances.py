"""Instances of an object: a single instance, or those of its repeats (13.2)."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.road import Road
from envgen_usd.models.road_feature import Pose
from envgen_usd.models.road_objects import Repeat, RoadObject
from envgen_usd.opendrive.features.roadside_poses import heading_at, points_beside
from envgen_usd.opendrive.geometry.road_frame import tilt

_BEYOND = 0.01
"""Tolerated distance in metres of an instance beyond the road's ends."""


@dataclass(frozen=True)
class Instance:
    """An instance of an object.

    Attributes:
        road_object: The object with the sizes of this instance.
        pose: Pose of the instance.
    """

    road_object: RoadObject
    pose: Pose


def instances(road: Road, road_object: RoadObject) -> Iterator[Instance]:
    """Yields the instances of an object, except extruded repeats.

    An object without repeats has a single instance; otherwise only the repeats count.
    ``orientation`` names the traffic that the object applies to and has no effect on the pose.
    """
    if not road_object.repeats:
        place = (
            np.array([value]) for value in (road_object.s, road_object.t, road_object.z_offset)
        )
        yield Instance(road_object, _poses(road, road_object, *place)[0])
    for repeat in road_object.repeats:
        if repeat.distance > 0:
            yield from _repeated(road, road_object, repeat)


def _poses(
    road: Road, road_object: RoadObject, s: FloatArray, t: FloatArray, z_offset: FloatArray
) -> list[Pose]:
    """Returns the poses of N instances at s, t and a height above the road, metres."""
    positions = points_beside(road, s, t, z_offset)
    headings = heading_at(road, s) + road_object.heading
    pitch, roll = np.full(len(s), road_object.pitch), np.full(len(s), road_object.roll)
    if _leans(road_object):
        pitch = pitch - np.arctan(road.elevation.derivative(s))
        roll = roll + tilt(road, s)
    rows = zip(positions, headings.tolist(), pitch.tolist(), roll.tolist(), strict=True)
    return [Pose(*row) for row in rows]


def _leans(road_object: RoadObject) -> bool:
    """Returns whether an object stands perpendicular to the road (perpToRoad, 1.8)."""
    named = (record.attributes.get("perpToRoad", "") for record in road_object.extra)
    return any(value in {"true", "1"} for value in named)


def _repeated(road: Road, road_object: RoadObject, repeat: Repeat) -> Iterator[Instance]:
    count = int(repeat.length / repeat.distance + 1e-9) + 1
    along = np.arange(count, dtype=np.float64) * repeat.distance
    along = along[np.abs(repeat.s + along - road.length / 2) <= road.length / 2 + _BEYOND]
    share = along / repeat.length if repeat.length > 0 else along
    first, last = at(road_object, repeat, 0.0), at(road_object, repeat, 1.0)
    values = {name: first[name] + (last[name] - first[name]) * share for name in first}
    poses = _poses(road, road_object, repeat.s + along, values["t"], values["z_offset"])
    if repeat.detach_from_reference_line:
        poses = _on_chord(road, road_object, repeat, share, poses)
    table = {name: column.tolist() for name, column in values.items()}
    for place, pose in enumerate(poses):
        each = replace(
            road_object,
            s=repeat.s + float(along[place]),
            t=table["t"][place],
            z_offset=table["z_offset"][place],
            width=table["width"][place],
            height=table["height"][place],
            length=table["length"][place],
            radius=table["radius"][place],
            repeats=(),
        )
        yield Instance(each, pose)


def _on_chord(
    road: Road, road_object: RoadObject, repeat: Repeat, share: FloatArray, poses: list[Pose]
) -> list[Pose]:
    """Returns poses on the straight line between the repeat's ends (detachFromReferenceLine)."""
    s = np.array([repeat.s, repeat.s + repeat.length])
    start, end = points_beside(road, s, np.nan_to_num(np.array(repeat.t)), np.zeros(2))[:, :2]
    heading = float(np.arctan2(*(end - start)[::-1])) + road_object.heading
    return [
        replace(
            pose,
            position=np.append(start + part * (end - start), pose.position[2]),
            heading=heading,
        )
        for pose, part in zip(poses, share.tolist(), strict=True)
    ]


def at(road_object: RoadObject, repeat: Repeat, share: float) -> dict[str, float]:
    """Returns an object's attributes at a share (0 to 1) of a repeat; the repeat has priority."""
    pairs = {
        "t": (repeat.t, road_object.t),
        "z_offset": (repeat.z_offset, road_object.z_offset),
        "width": (repeat.width, road_object.width),
        "height": (repeat.height, road_object.height),
        "length": (repeat.extent, road_object.length),
        "radius": (repeat.radius, road_object.radius),
    }
    return {
        name: default if math.isnan(start) else start + (end - start) * share
        for name, ((start, end), default) in pairs.items()
    }
