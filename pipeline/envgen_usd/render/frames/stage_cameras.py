"""The shipped rigs on a built stage: the layer `cameras.usda`, with a variant for each rig."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from pxr import Sdf, Usd, UsdGeom

from envgen_usd.models.array_types import FloatArray
from envgen_usd.render.cameras.sensor_rig import DEFAULT_RIG, shipped_rigs
from envgen_usd.render.frames.rig_layer import usd_matrix, write_sensors
from envgen_usd.whole_files import make_folder, write_whole

NAME = "cameras"
SET = "rig"
"""Variant set of the vehicle; one variant for each file in `renders/rigs`."""
VEHICLE = Sdf.Path("/World/Rig")


def write_stage_cameras(folder: Path, lanes: Sequence[FloatArray]) -> None:
    """Writes ``layers/cameras.usda``: a vehicle in the middle of the lanes, with its sensors.

    Args:
        folder: Output folder of the stage.
        lanes: Centre lines of driving lanes in the direction of travel, N_i x 3, metres, z up;
            without lanes the vehicle stands at the origin.

    Raises:
        EnvgenError: The file cannot be written.
    """
    layer = Sdf.Layer.CreateAnonymous(".usda")
    stage = Usd.Stage.Open(layer)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    vehicle = UsdGeom.Xform.Define(stage, VEHICLE)
    vehicle.AddTransformOp().Set(usd_matrix(vehicle_pose(lanes)))
    variants = vehicle.GetPrim().GetVariantSets().AddVariantSet(SET)
    for name, rig in shipped_rigs().items():
        variants.AddVariant(name)
        variants.SetVariantSelection(name)
        with variants.GetVariantEditContext():
            write_sensors(vehicle.GetPrim(), rig, 1.0)
    variants.SetVariantSelection(DEFAULT_RIG)
    world = layer.GetPrimAtPath(VEHICLE.GetParentPath())
    world.specifier = Sdf.SpecifierOver
    layer.defaultPrim = world.name
    make_folder(folder / "layers")
    write_whole(folder / "layers" / f"{NAME}.usda", layer.ExportToString())


def vehicle_pose(lanes: Sequence[FloatArray]) -> FloatArray:
    """4 x 4, vehicle to world: half along the lane whose middle is nearest to that of all lanes."""
    pose = np.eye(4)
    halves = [_half_way(lane) for lane in lanes if len(lane) > 1]
    if not halves:
        return pose
    places = np.array([place for place, _ in halves])
    away = np.linalg.norm(places[:, :2] - places[:, :2].mean(axis=0), axis=1)
    place, ahead = halves[int(away.argmin())]
    left = np.cross((0.0, 0.0, 1.0), ahead)
    left /= np.linalg.norm(left)
    pose[:3, :3] = np.stack((ahead, left, np.cross(ahead, left)), axis=1)
    pose[:3, 3] = place
    return pose


def _half_way(lane: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Place half along a line (N x 3), and the unit vector along it there."""
    steps = np.diff(lane, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    ends = np.cumsum(lengths)
    index = int(np.searchsorted(ends, ends[-1] / 2))
    back = (ends[index] - ends[-1] / 2) / max(lengths[index], 1e-9)
    return lane[index + 1] - back * steps[index], steps[index] / max(lengths[index], 1e-9)
