"""Features of signals: signs and lights with their posts (chapter 14)."""

import math
from collections.abc import Iterator, Mapping

import numpy as np

from envgen_usd.chunks import snap
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.kept_records import Record
from envgen_usd.models.road import Road
from envgen_usd.models.road_feature import Pose, SignalFace, SignalFeature
from envgen_usd.models.signals import Signal
from envgen_usd.opendrive.document.number_attributes import read
from envgen_usd.opendrive.features.roadside_poses import heading_at, points_beside
from envgen_usd.opendrive.features.sign_looks import FLAT, look_of
from envgen_usd.opendrive.features.signal_facing import Facing, face_angle

MOUNTING = 2.1
"""Height in metres of a sign's lower edge, for signals without a z offset."""
WHOLE = 2.0
"""Signal height in metres above which the height includes the post."""


def signal_feature(
    id_: str, road: Road, signal: Signal, roads: Mapping[str, Road], facing: Facing
) -> SignalFeature | None:
    """Returns the feature of a signal; `None` for road marks and references.

    The template's +x is the face. It looks against the road for orientation ``+`` and ``none``,
    along the road for ``-``, rotated by ``hOffset`` (14.1).

    Args:
        id_: Id of the feature.
        road: The signal's road.
        signal: The signal.
        roads: Roads by id, for signals at another road (positionRoad).
        facing: Reference direction of hOffset in the file.
    """
    look = look_of(signal)
    if signal.reference or look.template == FLAT:
        return None
    foot, heading = _pose(road, signal, roads, facing)
    width = signal.width or look.size[0]
    height = signal.height or look.size[1]
    lower = _lower_edge(signal)
    return SignalFeature(
        id=id_,
        road=road.id,
        source=signal,
        kind=look.template,
        template=look.template,
        pose=Pose(
            snap(foot),
            round(math.remainder(heading, 2 * math.pi), 6),
            round(signal.pitch, 6),
            round(signal.roll, 6),
        ),
        size=(0.0, width, lower + height),
        face=SignalFace(look.shape, round(width, 3), round(height, 3), round(lower, 3)),
    )


def _pose(
    road: Road, signal: Signal, roads: Mapping[str, Road], facing: Facing
) -> tuple[FloatArray, float]:
    """Returns the foot (3, metres) and the direction of the face, radians."""
    if signal.position is not None:
        # A positionInertial gives the signal's heading, not the road's (14.1.2).
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
    """Returns the height of the face's lower edge; a tall signal without z offset starts at 0."""
    if signal.z_offset > 0:
        return signal.z_offset
    return 0.0 if signal.height > WHOLE else MOUNTING


def _values(record: Record, names: tuple[str, ...]) -> Iterator[float]:
    return (read(record.attributes.get(name, "0")) or 0.0 for name in names)
