"""Instances of an object: one, or those of its repeats (13.2)."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from envgen_usd.models.arrays import FloatArray
from envgen_usd.models.road import Road
from envgen_usd.models.road_objects import Repeat, RoadObject
from envgen_usd.opendrive.features.poses import Stand, heading_at, points_beside
from envgen_usd.opendrive.road_frame import tilt

_BEYOND = 0.01
"""Metres beyond the road's ends up to which an instance is placed."""


@dataclass(frozen=True)
class Instance:
    """One instance of an object.

    Attributes:
        thing: The object, with the sizes of this instance.
        stand: Where it stands.
    """

    thing: RoadObject
    stand: Stand


def instances(road: Road, thing: RoadObject) -> Iterator[Instance]:
    """The instances of an object that are not extruded.

    An object without repeats is one instance; with repeats only those count. ``orientation`` says
    for which traffic the object holds and turns nothing.
    """
    if not thing.repeats:
        place = (np.array([value]) for value in (thing.s, thing.t, thing.z_offset))
        yield Instance(thing, _stands(road, thing, *place)[0])
    for repeat in thing.repeats:
        if repeat.distance > 0:
            yield from _repeated(road, thing, repeat)


def _stands(
    road: Road, thing: RoadObject, s: FloatArray, t: FloatArray, z_offset: FloatArray
) -> list[Stand]:
    """Poses of N instances at s, t and a height above the road."""
    positions = points_beside(road, s, t, z_offset)
    headings = heading_at(road, s) + thing.heading
    pitch, roll = np.full(len(s), thing.pitch), np.full(len(s), thing.roll)
    if _leans(thing):
        pitch = pitch - np.arctan(road.elevation.derivative(s))
        roll = roll + tilt(road, s)
    rows = zip(positions, headings.tolist(), pitch.tolist(), roll.tolist(), strict=True)
    return [Stand(*row) for row in rows]


def _leans(thing: RoadObject) -> bool:
    """Whether an object stands perpendicular to the road and not upright (perpToRoad, 1.8)."""
    named = (record.attributes.get("perpToRoad", "") for record in thing.extra)
    return any(value in {"true", "1"} for value in named)


def _repeated(road: Road, thing: RoadObject, repeat: Repeat) -> Iterator[Instance]:
    count = int(repeat.length / repeat.distance + 1e-9) + 1
    along = np.arange(count, dtype=np.float64) * repeat.distance
    along = along[np.abs(repeat.s + along - road.length / 2) <= road.length / 2 + _BEYOND]
    share = along / repeat.length if repeat.length > 0 else along
    first, last = at(thing, repeat, 0.0), at(thing, repeat, 1.0)
    values = {name: first[name] + (last[name] - first[name]) * share for name in first}
    stands = _stands(road, thing, repeat.s + along, values["t"], values["z_offset"])
    if repeat.detach_from_reference_line:
        stands = _on_chord(road, thing, repeat, share, stands)
    table = {name: column.tolist() for name, column in values.items()}
    for place, stand in enumerate(stands):
        each = replace(
            thing,
            s=repeat.s + float(along[place]),
            t=table["t"][place],
            z_offset=table["z_offset"][place],
            width=table["width"][place],
            height=table["height"][place],
            length=table["length"][place],
            radius=table["radius"][place],
            repeats=(),
        )
        yield Instance(each, stand)


def _on_chord(
    road: Road, thing: RoadObject, repeat: Repeat, share: FloatArray, stands: list[Stand]
) -> list[Stand]:
    """Instances on the straight line between the repeat's ends (detachFromReferenceLine)."""
    s = np.array([repeat.s, repeat.s + repeat.length])
    start, end = points_beside(road, s, np.nan_to_num(np.array(repeat.t)), np.zeros(2))[:, :2]
    heading = float(np.arctan2(*(end - start)[::-1])) + thing.heading
    return [
        replace(
            stand,
            position=np.append(start + part * (end - start), stand.position[2]),
            heading=heading,
        )
        for stand, part in zip(stands, share.tolist(), strict=True)
    ]


def at(thing: RoadObject, repeat: Repeat, share: float) -> dict[str, float]:
    """Values of the object's attributes at a share (0 to 1) of a repeat, which override its own."""
    pairs = {
        "t": (repeat.t, thing.t),
        "z_offset": (repeat.z_offset, thing.z_offset),
        "width": (repeat.width, thing.width),
        "height": (repeat.height, thing.height),
        "length": (repeat.extent, thing.length),
        "radius": (repeat.radius, thing.radius),
    }
    return {
        name: own if math.isnan(start) else start + (end - start) * share
        for name, ((start, end), own) in pairs.items()
    }
