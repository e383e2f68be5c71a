"""Authors the centre lines of lanes; the renderer drives the camera along them."""

import numpy as np
from pxr import Sdf, Vt

from envgen_usd.assets.prim_authoring import add_prim, apply_schemas, prim_names, set_attribute
from envgen_usd.assets.stage_schemas import LANE
from envgen_usd.assets.usd_values import to_ints, to_points
from envgen_usd.chunks import Chunk
from envgen_usd.layers.payload_files import local
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.attribute_values import as_number
from envgen_usd.models.city_model import City, CityObject

CURVE = "lod2MultiCurve"
LANE_TYPES = {"driving", "entry", "exit", "onRamp", "offRamp", "connectingRamp", "bidirectional"}
"""OpenDRIVE lane types for cars."""


def add_lanes(roads: Sdf.PrimSpec, city: City, chunk: Chunk) -> None:
    """Adds ``Lanes`` with a linear curve for each driving lane, in the direction of travel.

    The `userProperties` of a curve hold ``lane_id``, ``lane_type``, and the ``speed`` in m/s.
    ``predecessors`` and ``successors`` hold the ids of the connected lanes.
    """
    lanes = {space.id: space for space in city.of_kind("TrafficSpace") if _is_lane(space)}
    if not lanes:
        return
    scope = add_prim(roads, "Lanes", "Scope")
    for lane_id, name in prim_names(lanes).items():
        _add_lane(scope, name, lanes[lane_id], chunk)


def _is_lane(space: CityObject) -> bool:
    lane_type = str(space.attributes.get("opendrive_lane_type", "driving"))
    return lane_type in LANE_TYPES and any(len(line) > 1 for line in space.curves.get(CURVE, ()))


def _add_lane(scope: Sdf.PrimSpec, name: str, lane: CityObject, chunk: Chunk) -> None:
    types = Sdf.ValueTypeNames
    lines = [line for line in lane.curves[CURVE] if len(line) > 1]
    points = local(np.concatenate(lines), chunk)
    prim = add_prim(scope, name, "BasisCurves")
    set_attribute(prim, "type", types.Token, "linear", uniform=True)
    set_attribute(prim, "wrap", types.Token, "nonperiodic", uniform=True)
    set_attribute(prim, "purpose", types.Token, "guide", uniform=True)
    set_attribute(prim, "points", types.Point3fArray, to_points(points))
    counts = np.array([len(line) for line in lines])
    set_attribute(prim, "curveVertexCounts", types.IntArray, to_ints(counts))
    widths = set_attribute(prim, "widths", types.FloatArray, Vt.FloatArray([WIDTH]))
    widths.SetInfo("interpolation", "constant")
    set_attribute(prim, "extent", types.Float3Array, to_points(_extent(points)))
    _add_facts(prim, lane)


WIDTH = 0.1
"""Display width of a lane's line, metres; a larger value draws thicker lines."""


def _extent(points: FloatArray) -> FloatArray:
    """2 x 3 bounding box in single precision, as UsdGeom computes it, so that validators agree."""
    single = points.astype(np.float32)
    half = np.float32(WIDTH) * np.float32(0.5)
    return np.stack([single.min(axis=0) - half, single.max(axis=0) + half]).astype(np.float64)


def _add_facts(prim: Sdf.PrimSpec, lane: CityObject) -> None:
    types = Sdf.ValueTypeNames
    apply_schemas(prim, LANE)
    lane_type = str(lane.attributes.get("opendrive_lane_type", "driving"))
    speed = as_number(lane.attributes.get("speed"))
    strings = {"lane_id": lane.id, "lane_type": lane_type}
    for key, value in strings.items():
        set_attribute(prim, f"userProperties:{key}", types.String, value, custom=True)
    for role, key in (("predecessor", "predecessors"), ("successor", "successors")):
        # Lanes of all chunks share a stage, so references to other files reduce to ids.
        names = [target.rpartition("#")[2] for target in lane.relations.get(role, ())]
        ids = Vt.StringArray(names)
        set_attribute(prim, f"userProperties:{key}", types.StringArray, ids, custom=True)
    set_attribute(prim, "userProperties:speed", types.Float, speed, custom=True)
