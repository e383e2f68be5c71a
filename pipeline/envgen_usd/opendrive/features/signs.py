"""Signals as features: signs and lights with their posts (chapter 14)."""

import math
from collections.abc import Iterator, Mapping

import numpy as np

from envgen_usd.chunks import snap
from envgen_usd.models.arrays import FloatArray
from envgen_usd.models.city import Attribute, CityObject, Placement
from envgen_usd.models.records import Record
from envgen_usd.models.road import Road
from envgen_usd.models.signals import Signal
from envgen_usd.opendrive.elements.numbers import read
from envgen_usd.opendrive.features.facing import Facing, face_angle
from envgen_usd.opendrive.features.poses import heading_at, points_beside
from envgen_usd.opendrive.features.sign_shapes import FLAT, LIGHT, Look, look_of

MOUNTING = 2.1
"""Height in metres of a sign's lower edge where the file gives none."""
WHOLE = 2.0
"""Height in metres from which a signal's own height counts its post, too."""
_FUNCTIONS = {LIGHT: "1080"}


def sign(
    name: str, road: Road, signal: Signal, roads: Mapping[str, Road], facing: Facing
) -> CityObject | None:
    """Feature of a signal, none for what lies on the road or only refers to another signal.

    Its template's +x, the face, looks at the traffic for which it holds: against the road for
    orientation ``+`` and ``none``, along it for ``-``; ``hOffset`` turns it further (14.1).

    Args:
        name: Id of the feature.
        road: The signal's road.
        signal: The signal.
        roads: All roads by id, for signals that stand at another road (positionRoad).
        facing: From what the file counts hOffset.
    """
    look = look_of(signal)
    if signal.reference or look.template == FLAT:
        return None
    foot, heading = _pose(road, signal, roads, facing)
    width = signal.width or look.size[0]
    height = signal.height or look.size[1]
    lower = _lower_edge(signal)
    top = lower + height
    placement = Placement(
        snap(foot),
        round(math.remainder(heading, 2 * math.pi), 6),
        np.array([0.0, width, top]),
        look.template,
        round(-signal.pitch, 6),
        round(signal.roll, 6),
    )
    return CityObject(
        name,
        "CityFurniture",
        _attributes(signal, look, (width, height, lower)),
        placement=placement,
    )


def _pose(
    road: Road, signal: Signal, roads: Mapping[str, Road], facing: Facing
) -> tuple[FloatArray, float]:
    """Foot (3) and direction in which the face looks."""
    if signal.position is not None:
        # Its heading is that of the signal, not of the road (14.1.2).
        foot = np.array(signal.position) - (0.0, 0.0, max(signal.z_offset, 0.0))
        return foot, signal.heading + math.pi
    s, t, angle = signal.s, signal.t, face_angle(facing, signal)
    for record in signal.extra:
        if record.tag == "positionRoad" and record.attributes.get("roadId") in roads:
            road = roads[record.attributes["roadId"]]
            s, t, offset = _values(record, ("s", "t", "hOffset"))
            angle += offset - signal.heading
    (foot,) = points_beside(road, np.array([s]), np.array([t]), np.zeros(1))
    return foot, float(heading_at(road, np.array([s]))[0]) + angle


def _lower_edge(signal: Signal) -> float:
    """Height of the face's lower edge; below the ground only where it is that of a model."""
    if signal.z_offset > 0:
        return signal.z_offset
    return 0.0 if signal.height > WHOLE else MOUNTING


def _values(record: Record, names: tuple[str, ...]) -> Iterator[float]:
    return (read(record.attributes.get(name, "0")) or 0.0 for name in names)


def _attributes(
    signal: Signal, look: Look, face: tuple[float, float, float]
) -> dict[str, Attribute]:
    width, height, lower = face
    found: dict[str, Attribute] = {
        "class": "1000",
        "function": _FUNCTIONS.get(look.template, "1070"),
        "face_width": round(width, 3),
        "face_height": round(height, 3),
        "face_lower_edge": round(lower, 3),
        "opendrive_id": signal.id,
        "opendrive_orientation": signal.orientation,
        "opendrive_dynamic": "yes" if signal.dynamic else "no",
    }
    if look.shape:
        found["shape"] = look.variant
        found["sign_shape"] = look.shape
    texts = {
        "opendrive_name": signal.name,
        "opendrive_type": signal.type,
        "opendrive_subtype": signal.subtype,
        "opendrive_country": signal.country,
        "opendrive_text": signal.text,
        "opendrive_unit": signal.unit,
    }
    found.update((key, text) for key, text in texts.items() if text)
    if math.isfinite(signal.value):
        found["opendrive_value"] = signal.value
    return found
