"""Points along the reference lines of a network: what is known of a map without its surface."""

from dataclasses import dataclass

import numpy as np

from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.road import RoadNetwork
from envgen_usd.opendrive.geometry.curve_evaluation import evaluate

STEP = 20.0
"""Distance between samples, metres; a smaller value follows narrow bends."""
BESIDE = 30.0
"""Width of a road beside its reference line that a box reckons with, metres."""


@dataclass(frozen=True)
class ReferenceSamples:
    """Samples of the reference lines.

    Attributes:
        boxes: R x 4, (min x, min y, max x, max y) of each road with what lies beside it, metres.
        points: N x 3, metres, of all roads.
        winding: Turning of the roads outside junctions, radians per metre; `None` without any.
    """

    boxes: FloatArray
    points: FloatArray
    winding: float | None

    @staticmethod
    def of(network: RoadNetwork) -> "ReferenceSamples":
        """Samples all roads of a network."""
        boxes, points, length, turning = [], [np.empty((0, 3))], 0.0, 0.0
        for road in network.roads.values():
            s = np.linspace(0.0, road.length, int(np.ceil(road.length / STEP)) + 1)
            x, y, heading = evaluate(road.plan_view, s)
            boxes.append([x.min() - BESIDE, y.min() - BESIDE, x.max() + BESIDE, y.max() + BESIDE])
            points.append(np.stack([x, y, road.elevation(s)], axis=1))
            if not road.junction:
                length += road.length
                turning += float(np.abs(np.diff(np.unwrap(heading))).sum())
        all_points = np.concatenate(points)
        winding = turning / length if length else None
        return ReferenceSamples(np.array(boxes).reshape(-1, 4), all_points, winding)
