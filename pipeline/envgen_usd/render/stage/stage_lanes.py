"""Reads the driving lanes of a stage and their direction of travel."""

from collections.abc import Iterable

import numpy as np
from pxr import Usd, UsdGeom

from envgen_usd.models.array_types import FloatArray
from envgen_usd.render.render_scene import Lane
from envgen_usd.render.stage.typed_values import BadValueError, rows

LANE_ID = "userProperties:lane_id"
SUCCESSORS = "userProperties:successors"


def read_lane(curves: UsdGeom.Curves, matrix: FloatArray, time: Usd.TimeCode) -> Lane | None:
    """Reads a curve with a ``userProperties:lane_id`` as a lane; `None` for other curves.

    Raises:
        BadValueError: Its points are no finite numbers.
    """
    prim = curves.GetPrim()
    name = prim.GetAttribute(LANE_ID)
    if not name:
        return None
    local = rows(curves.GetPointsAttr(), time, 3)
    if len(local) < 2:
        return None
    if not np.isfinite(local).all():
        raise BadValueError("points are not finite")
    points = local @ matrix[:3, :3].T + matrix[:3, 3]
    moved = np.linalg.norm(np.diff(points, axis=0), axis=1) > 1e-6
    points = points[np.concatenate(([True], moved))]
    listed = prim.GetAttribute(SUCCESSORS)
    following = listed.Get(time) if listed else None
    if len(points) < 2:
        return None
    after = [str(item) for item in following] if isinstance(following, Iterable) else []
    return Lane(str(name.Get(time)), points, tuple(after))
