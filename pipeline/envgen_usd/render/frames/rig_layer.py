"""The rig of a run as a USD layer over the stage: a moving vehicle with its cameras and lidars."""

import os
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux

from envgen_usd.errors import EnvgenError
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.atmosphere import STAGE_UNIT
from envgen_usd.render.cameras.lens_models import BrownConrady, KannalaBrandt
from envgen_usd.render.cameras.sensor_rig import Lidar, MountedCamera, Position, Rig
from envgen_usd.render.stage.stage_traversal import world_matrix
from envgen_usd.whole_files import write_whole

_APERTURE = 36.0
"""Width of the sensor, tenths of a scene unit; only its ratio to the focal length matters."""
_FAR = 1e5
"""Far clipping distance for other programs, metres."""
_LENS, _HOT_SPOT = 0.08, 15.0
"""Radius in metres of a headlamp and its greatest intensity in kcd (`lamps.glsl`)."""
_TILT, _CONE = 2.0, 12.0
"""Angle of a headlamp's axis below the horizon, and half the opening of its cone, degrees."""
RUN = Sdf.Path("/Rig")
"""The vehicle of a run."""
_USD_FROM_OPENCV = np.diag((1.0, -1.0, -1.0, 1.0))
"""USD cameras look along -z, with y up."""
_OMNIVERSE = {
    BrownConrady: ("OmniLensDistortionOpenCvPinholeAPI", "opencvPinhole"),
    KannalaBrandt: ("OmniLensDistortionOpenCvFisheyeAPI", "opencvFisheye"),
}
"""Schema and prefix of the lenses that Omniverse's renderer knows."""


def write_rig_layer(
    path: Path,
    stage: Usd.Stage,
    rig: Rig,
    poses: Sequence[FloatArray],
    codes: Sequence[float] = (),
) -> None:
    """Writes the sensors of a run over the stage: open the file to look through its cameras.

    `/Rig` is the vehicle, with a transformation at the time code of each frame. Below it are its
    cameras, lidars and headlamps.

    Args:
        path: USD file to write.
        stage: Stage of the run; becomes a sublayer.
        rig: Sensors.
        poses: Matrices (4 x 4) from the vehicle frame to the world, metres, z up.
        codes: Time code of each frame on the stage; empty for the numbers of the frames.

    Raises:
        EnvgenError: The file is the stage itself.
    """
    beneath = stage.GetRootLayer().realPath
    if Path(beneath).resolve() == path.resolve():
        raise EnvgenError(f"render: {path} is the stage that is rendered; choose another --out")
    layer = Sdf.Layer.CreateAnonymous(".usda")
    top = Usd.Stage.Open(layer, Usd.Stage.LoadNone)
    UsdGeom.SetStageUpAxis(top, UsdGeom.GetStageUpAxis(stage))
    UsdGeom.SetStageMetersPerUnit(top, UsdGeom.GetStageMetersPerUnit(stage))
    times = list(codes) or [float(number) for number in range(len(poses))]
    if codes:
        top.SetTimeCodesPerSecond(stage.GetTimeCodesPerSecond())
    top.SetStartTimeCode(min(times, default=0.0))
    top.SetEndTimeCode(max(times, default=0.0))
    vehicle = UsdGeom.Xform.Define(top, RUN)
    top.SetDefaultPrim(vehicle.GetPrim())
    moves = vehicle.AddTransformOp()
    for time, pose in zip(times, poses, strict=True):
        moves.Set(usd_matrix(_on_stage(pose, stage)), time)
    metres = UsdGeom.GetStageMetersPerUnit(stage)
    write_sensors(vehicle.GetPrim(), rig, metres)
    for number, place in enumerate(rig.headlamps):
        _write_headlamp(top, number, place, metres)
    # The stage is added last, so that it is not opened again.
    del top
    layer.subLayerPaths.append(Path(os.path.relpath(beneath, path.parent)).as_posix())
    write_whole(path, layer.ExportToString())


def write_sensors(vehicle: Usd.Prim, rig: Rig, metres: float) -> None:
    """Writes cameras and lidars below the prim of their vehicle.

    Args:
        vehicle: The vehicle frame.
        rig: Sensors.
        metres: Length of a scene unit.
    """
    for camera in rig.camera:
        _write_camera(vehicle, camera, metres)
    for lidar in rig.lidar:
        _write_lidar(vehicle, lidar, metres)


def _on_stage(matrix: FloatArray, stage: Usd.Stage) -> FloatArray:
    """A pose in metres, z up, in the units and axes of the stage; without a scale."""
    from_world = np.linalg.inv(world_matrix(stage))
    placed = from_world @ matrix
    placed[:3, :3] *= UsdGeom.GetStageMetersPerUnit(stage)
    return placed


def usd_matrix(matrix: FloatArray) -> Gf.Matrix4d:
    """A matrix (4 x 4) for column vectors as USD has it, for row vectors."""
    return Gf.Matrix4d(*matrix.T.ravel().tolist())


def _below_rig(matrix: FloatArray, metres: float) -> Gf.Matrix4d:
    placed = matrix.copy()
    placed[:3, 3] /= metres
    return usd_matrix(placed)


def _write_camera(vehicle: Usd.Prim, camera: MountedCamera, metres: float) -> None:
    path = vehicle.GetPath().AppendChild(camera.name)
    prim = UsdGeom.Camera.Define(vehicle.GetStage(), path)
    matrix = camera.vehicle_from_camera @ _USD_FROM_OPENCV
    prim.AddTransformOp().Set(_below_rig(matrix, metres))
    fx, fy = camera.central_focal
    pitch = _APERTURE / camera.width
    tall = pitch * fx / fy
    prim.CreateFocalLengthAttr(fx * pitch)
    prim.CreateHorizontalApertureAttr(_APERTURE)
    prim.CreateVerticalApertureAttr(camera.height * tall)
    prim.CreateHorizontalApertureOffsetAttr((camera.width / 2 - 0.5 - camera.cx) * pitch)
    prim.CreateVerticalApertureOffsetAttr((camera.cy + 0.5 - camera.height / 2) * tall)
    prim.CreateClippingRangeAttr(Gf.Vec2f(camera.near / metres, _FAR / metres))
    _write_lens(prim.GetPrim(), camera)


def _write_lens(prim: Usd.Prim, camera: MountedCamera) -> None:
    """Writes the intrinsics and the lens as properties, and as those that Omniverse reads."""
    figures = {name: getattr(camera, name) for name in ("fx", "fy", "cx", "cy")}
    coefficients = asdict(camera.lens)
    _set(prim, "userProperties:lens:model", Sdf.ValueTypeNames.Token, coefficients.pop("model"))
    size = Gf.Vec2i(camera.width, camera.height)
    _set(prim, "userProperties:lens:imageSize", Sdf.ValueTypeNames.Int2, size)
    for name, value in (figures | coefficients).items():
        _set(prim, f"userProperties:lens:{name}", Sdf.ValueTypeNames.Double, value)
    if type(camera.lens) not in _OMNIVERSE:
        return
    schema, prefix = _OMNIVERSE[type(camera.lens)]
    prim.AddAppliedSchema(schema)
    _set(prim, "omni:lensdistortion:model", Sdf.ValueTypeNames.Token, prefix)
    _set(prim, f"omni:lensdistortion:{prefix}:imageSize", Sdf.ValueTypeNames.Int2, size)
    # Omniverse counts from the corner of the first pixel, OpenCV from its centre.
    corner = {name: figures[name] + 0.5 for name in ("cx", "cy")}
    coefficients.pop("field", None)
    for name, value in (figures | corner | coefficients).items():
        _set(prim, f"omni:lensdistortion:{prefix}:{name}", Sdf.ValueTypeNames.Float, value)


def _write_lidar(vehicle: Usd.Prim, lidar: Lidar, metres: float) -> None:
    path = vehicle.GetPath().AppendChild(lidar.name)
    prim = UsdGeom.Xform.Define(vehicle.GetStage(), path)
    prim.AddTransformOp().Set(_below_rig(lidar.vehicle_from_lidar, metres))
    for name, value in (("sensor", "lidar"), ("model", lidar.device)):
        _set(prim.GetPrim(), f"userProperties:{name}", Sdf.ValueTypeNames.String, value)


def _write_headlamp(top: Usd.Stage, number: int, place: Position, metres: float) -> None:
    """Writes a lamp with about the hot spot of a low beam, which UsdLux can tell without files."""
    lamp = UsdLux.DiskLight.Define(top, RUN.AppendChild(f"headlamp_{number}"))
    down = np.radians(_TILT)
    # The beam of a disk points along -z: ahead, and down by the tilt.
    back = np.array((-np.cos(down), 0.0, np.sin(down)))
    right = np.array((0.0, -1.0, 0.0))
    turned = np.eye(4)
    turned[:3, :3] = np.stack((right, np.cross(back, right), back), axis=1)
    turned[:3, 3] = place
    lamp.AddTransformOp().Set(_below_rig(turned, metres))
    lamp.CreateRadiusAttr(_LENS / metres)
    lamp.CreateIntensityAttr(_HOT_SPOT / (np.pi * _LENS**2) / STAGE_UNIT)
    shaping = UsdLux.ShapingAPI.Apply(lamp.GetPrim())
    shaping.CreateShapingConeAngleAttr(_CONE)
    shaping.CreateShapingConeSoftnessAttr(1.0)


def _set(prim: Usd.Prim, name: str, kind: Sdf.ValueTypeName, value: object) -> None:
    prim.CreateAttribute(name, kind, custom=True).Set(value)
