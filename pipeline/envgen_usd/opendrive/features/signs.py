"""Signals as features: signs and lights with their posts (chapter 14)."""

import math
from collections.abc import Iterator, Mapping

import numpy as np

from envgen_usd.chunks import snap
from envgen_usd.models.arrays import FloatArray
from envgen_usd.models.city import Attribute, CityObject, Placement
from envgen_usd.models.road import Record, Road, Signal
from envgen_usd.opendrive.elements.numbers import read
from envgen_usd.opendrive.features.poses import heading_at, points_beside
from envgen_usd.opendrive.features.sign_shapes import FLAT, LIGHT, Look, look_of

MOUNTING = 2.1
"""Height in metres of a sign's lower edge where the file gives none."""
_FUNCTIONS = {LIGHT: "1080"}


def sign(name: str, road: Road, signal: Signal, roads: Mapping[str, Road]) -> CityObject | None:
    """Feature of a signal, none for what lies on the road or only refers to another signal.

    Its template's +x, the face, looks at the traffic for which it holds: against the road for
    orientation ``+`` and ``none``, along it for ``-``; ``hOffset`` turns it further (14.1).

    Args:
        name: Id of the feature.
        road: The signal's road.
        signal: The signal.
        roads: All roads by id, for signals that stand at another road (positionRoad).
    """
    look = look_of(signal)
    if signal.reference or look.template == FLAT:
        return None
    foot, heading, lower = _pose(road, signal, roads)
    width = signal.width or look.size[0]
    height = signal.height or look.size[1]
    top = lower + height
    placement = Placement(
        snap(foot),
        round(math.remainder(heading + math.pi, 2 * math.pi), 6),
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
        relations=_relations(signal),
    )


def _pose(road: Road, signal: Signal, roads: Mapping[str, Road]) -> tuple[FloatArray, float, float]:
    """Foot (3), direction of the traffic that it holds for, and height of the face's lower edge."""
    turned = math.pi if signal.orientation == "-" else 0.0
    lower = signal.z_offset if signal.z_offset > 0 else MOUNTING
    if signal.position is not None:
        # Its heading is that of the signal, not of the road (14.1.2).
        foot = np.array(signal.position) - (0.0, 0.0, max(signal.z_offset, 0.0))
        return foot, signal.heading, lower
    s, t, z, offset = signal.s, signal.t, min(signal.z_offset, 0.0), signal.heading
    for record in signal.extra:
        if record.tag == "positionRoad" and record.attributes.get("roadId") in roads:
            road = roads[record.attributes["roadId"]]
            s, t, z, offset = _values(record, ("s", "t", "zOffset", "hOffset"))
            lower, z = (z, 0.0) if z > 0 else (lower, z)
    (foot,) = points_beside(road, np.array([s]), np.array([t]), np.array([z]))
    return foot, float(heading_at(road, np.array([s]))[0]) + offset + turned, lower


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


def _relations(signal: Signal) -> dict[str, tuple[str, ...]]:
    """Other signals that this one depends on, by their ids in the file."""
    needed = tuple(
        record.attributes.get("id", "") for record in signal.extra if record.tag == "dependency"
    )
    return {"dependsOn": needed} if needed else {}
