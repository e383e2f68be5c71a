"""Reads the driving lanes of a stage and their direction of travel."""

import numpy as np
from pxr import Usd, UsdGeom

from envgen_usd.models.array_types import FloatArray
from envgen_usd.render.render_scene import Lane

LANE_ID = "userProperties:lane_id"
SUCCESSORS = "userProperties:successors"


def read_lane(curves: UsdGeom.Curves, matrix: FloatArray, time: Usd.TimeCode) -> Lane | None:
    """Reads a curve with a ``userProperties:lane_id`` as a lane; `None` for other curves."""
    prim = curves.GetPrim()
    name = prim.GetAttribute(LANE_ID)
    raw = curves.GetPointsAttr().Get(time)
    if not name or not raw or len(raw) < 2:
        return None
    local = np.array(raw, np.float64)
    points = local @ matrix[:3, :3].T + matrix[:3, 3]
    moved = np.linalg.norm(np.diff(points, axis=0), axis=1) > 1e-6
    points = points[np.concatenate(([True], moved))]
    listed = prim.GetAttribute(SUCCESSORS)
    following = listed.Get(time) if listed else None
    if len(points) < 2:
        return None
    return Lane(str(name.Get(time)), points, tuple(str(item) for item in following or ()))
