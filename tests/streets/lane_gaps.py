"""Distances between the ends of linked lanes."""

import numpy as np


def lane_gaps(surface):
    """Metres between the end of each lane and the beginning of each of its successors."""
    lanes = {lane.id: lane for lane in surface.lanes}
    return [
        np.linalg.norm(lane.points[-1] - lanes[after].points[0])
        for lane in surface.lanes
        for after in lane.successors
        if after in lanes
    ]
