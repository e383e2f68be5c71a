"""Compares the light of a stage in our renderer with that in Cycles and Mitsuba 3.

    python benchmarks/grey_plane.py --cycles .venv-cycles/bin/python

A grey plane of albedo 0.18 lies in the light of three weathers of `atmosphere.usda`. The table
shows its linear radiance in the unit of the stage, in the whole light and in that of the sky alone,
the ratio of sun to sky, and the mean radiance of the sky in four directions, which shows how its
texture is turned. Blender multiplies distant lights by four, and so does the sky of our stages
there; its figures are divided by four.
"""

import argparse
import json
import subprocess
import tempfile
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade

from envgen_usd.layers.atmosphere_layer import write_atmosphere
from envgen_usd.light.daylight import LUMINANCE
from envgen_usd.light.sky_directions import sky_directions, solid_angles
from envgen_usd.models.atmosphere import Atmosphere
from envgen_usd.render.cameras.camera_pose import Pose, look_at
from envgen_usd.render.cameras.camera_rig import Camera
from envgen_usd.render.drawing.drawn_frame import FrameRequest
from envgen_usd.render.opengl.gl_context import open_context
from envgen_usd.render.opengl.scene_tiles import pack
from envgen_usd.render.stage.stage_reader import open_stage, read_scene

WEATHERS = ("clear", "overcast", "low_sun")
ALBEDO = 0.18
BLENDER = 4.0
"""Factor of the light that Blender 5.0 imports from our stages."""
DOWN = Pose(look_at(np.array([0.0, 0.0, 20.0]), np.array([0.0, 0.01, 0.0])))
CAMERA = Camera(16, 16, 24.0, 24.0, 7.5, 7.5)


def write_stage(folder: Path, weather: str) -> Path:
    """Writes a stage with a plane and a camera above it; the folder has the layer of the light."""
    path = folder / f"{weather}.usda"
    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageUpAxis(stage, "Z")
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    stage.GetRootLayer().subLayerPaths.append("layers/atmosphere.usda")
    stage.SetDefaultPrim(UsdGeom.Xform.Define(stage, "/World").GetPrim())
    environment = stage.GetPrimAtPath("/World/Environment")
    environment.GetVariantSet("weather").SetVariantSelection(weather)
    plane = UsdGeom.Mesh.Define(stage, "/World/plane")
    plane.CreatePointsAttr([(-900, -900, 0), (900, -900, 0), (900, 900, 0), (-900, 900, 0)])
    plane.CreateFaceVertexCountsAttr([4])
    plane.CreateFaceVertexIndicesAttr([0, 1, 2, 3])
    plane.CreateSubdivisionSchemeAttr("none")
    grey = UsdShade.Material.Define(stage, "/World/grey")
    surface = UsdShade.Shader.Define(stage, "/World/grey/surface")
    surface.CreateIdAttr("UsdPreviewSurface")
    surface.CreateInput("roughness", Sdf.ValueTypeNames.Float).Set(1.0)
    surface.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f).Set(Gf.Vec3f(ALBEDO))
    grey.CreateSurfaceOutput().ConnectToSource(surface.ConnectableAPI(), "surface")
    UsdShade.MaterialBindingAPI.Apply(plane.GetPrim()).Bind(grey)
    camera = UsdGeom.Camera.Define(stage, "/World/camera")
    UsdGeom.Xformable(camera).AddTranslateOp().Set((0, 0, 20))
    stage.Save()
    return path


def sky_at(light: Atmosphere, azimuth: float) -> np.ndarray:
    """Mean radiance of the map in the view of `cycles_plane.py`."""
    turn, rise, half = np.radians(azimuth), np.radians(28.0), np.tan(np.radians(25.0))
    ahead = np.array([np.sin(turn) * np.cos(rise), np.cos(turn) * np.cos(rise), np.sin(rise)])
    right = np.array([np.cos(turn), -np.sin(turn), 0.0])
    up = np.cross(right, ahead)
    directions = sky_directions(len(light.sky))
    depth = directions @ ahead
    seen = (depth > 0) & (np.abs(directions @ right) < half * depth)
    seen &= np.abs(directions @ up) < half * depth
    # Pixels of an image have equal areas on its plane, not equal solid angles.
    weight = np.where(seen, solid_angles(len(light.sky)) / np.maximum(depth, 0.1) ** 3, 0.0)
    mean: np.ndarray = np.einsum("ij,ijk->k", weight, light.sky) / weight.sum()
    return mean


def ours(path: Path) -> dict[str, np.ndarray]:
    """Radiance of the plane, drawn and, where Mitsuba is installed, traced."""
    scene = read_scene(open_stage(path))
    light = replace(scene.light, wetness=0.0)
    dark = replace(light, sun=light.sun * 0.0)
    with open_context():
        from envgen_usd.render.drawing.render_passes import FrameRenderer  # noqa: PLC0415 - binds the platform
        from envgen_usd.render.lighting.sky_texture import open_illuminance  # noqa: PLC0415

        def unexposed(radiance: np.ndarray, air: Atmosphere) -> np.ndarray:
            mean: np.ndarray = radiance.mean(axis=(0, 1)) * open_illuminance(air) / np.pi
            return mean

        renderer = FrameRenderer(scene, pack(scene), CAMERA)
        result = {
            "plane": unexposed(renderer.draw(FrameRequest(DOWN, light)).radiance, light),
            "sky alone": unexposed(renderer.draw(FrameRequest(DOWN, dark)).radiance, dark),
        }
        if find_spec("mitsuba"):
            from envgen_usd.render.path_tracing.path_tracer import PathTracer  # noqa: PLC0415

            tracer = PathTracer(scene, CAMERA)
            result["plane, traced"] = unexposed(tracer.radiance(DOWN, light), light)
            result["sky alone, traced"] = unexposed(tracer.radiance(DOWN, dark), dark)
    result |= {f"sky at {a}": sky_at(light, a) for a in (0, 90, 180, 270)}
    return result


def cycles(python: str, path: Path) -> dict[str, np.ndarray]:
    script = Path(__file__).with_name("cycles_plane.py")
    run = subprocess.run([python, script, path], check=True, capture_output=True, text=True)
    line = next(line for line in run.stdout.splitlines() if line.startswith("RESULT "))
    return {name: np.array(rgb) / BLENDER for name, rgb in json.loads(line[7:]).items()}


def row(weather: str, name: str, values: list[float]) -> None:
    cells = " | ".join(f"{value:.4f}" if np.isfinite(value) else "" for value in values)
    print(f"| {weather} | {name} | {cells} | {values[-1] / values[0]:.3f} |")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cycles", required=True, help="Python with the module bpy")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    print("| weather | | ours | Mitsuba | Cycles | Cycles / ours |\n|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_atmosphere(folder, options.seed)
        for weather in WEATHERS:
            path = write_stage(folder, weather)
            drawn, rendered = ours(path), cycles(options.cycles, path)
            grey = {key: float(rgb @ LUMINANCE) for key, rgb in drawn.items()}
            theirs = {key: float(rgb @ LUMINANCE) for key, rgb in rendered.items()}
            for key in rendered:
                traced = grey.get(f"{key}, traced", np.nan)
                row(weather, key, [grey[key], traced, theirs[key]])
            if theirs["plane"] > 1.02 * theirs["sky alone"]:
                ratios = [
                    table[f"plane{by}"] / table[f"sky alone{by}"] - 1.0
                    if f"plane{by}" in table else np.nan
                    for table, by in ((grey, ""), (grey, ", traced"), (theirs, ""))
                ]  # fmt: skip
                row(weather, "sun / sky", ratios)


if __name__ == "__main__":
    main()
