"""Compares a stage in Blender with the stage itself: what arrives, and a picture of each.

    python benchmarks/dcc.py demo/stage.usda --cycles .venv-cycles/bin/python

The exporter draws a frame and writes the camera as a layer over the stage. Blender opens it,
and Cycles traces the same frame. Both are developed with the same curve and stand one above the
other in the picture, ours first. The exit code is 1 if something is missing in Blender, or if a
mean differs by more than `TOLERANCE`.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import OpenEXR
from PIL import Image
from pxr import Usd, UsdGeom, UsdLux, UsdShade

from envgen_usd import read_frames, render_frames
from envgen_usd.render.cameras.camera_response import ideal_picture
from envgen_usd.render.opengl.gl_context import open_context
from envgen_usd.render.stage.stage_reader import open_stage
from envgen_usd.render.stage.sun_and_sky import read_light

BLENDER = 4.0
"""Factor of the light that Blender 5.0 imports from our stages, see `grey_plane.py`."""
GML_ID = "userProperties:gml_id"
TOLERANCE = 0.25
"""Largest difference of the mean levels of both pictures as a share; larger values accept more."""


def expected(path: Path) -> dict[str, int]:
    """What a program should find: instances, materials in use, lights, cameras."""
    stage = Usd.Stage.Open(str(path))
    prims = list(stage.Traverse())
    inside = [p for proto in stage.GetPrototypes() for p in Usd.PrimRange(proto)]
    drawn = [
        prim
        for prim in (*prims, *inside)
        if prim.IsA(UsdGeom.Mesh) and UsdGeom.Imageable(prim).ComputePurpose() != "proxy"
    ]
    bound = set()
    for prim in drawn:
        pieces = UsdShade.MaterialBindingAPI(prim).GetMaterialBindSubsets()
        for piece in [subset.GetPrim() for subset in pieces] or [prim]:
            material, _ = UsdShade.MaterialBindingAPI(piece).ComputeBoundMaterial()
            bound.add(material.GetPrim().GetName())
    lights = [p for p in (*prims, *inside) if p.HasAPI(UsdLux.LightAPI)]
    return {
        "meshes": len(drawn),
        "instances": sum(prim.IsInstance() for prim in prims),
        "materials": len(bound),
        "missing textures": 0,
        "lights": len(lights),
        "cameras": sum(prim.IsA(UsdGeom.Camera) for prim in prims),
        # Blender imports single strings.
        "properties": sum(isinstance(p.GetAttribute(GML_ID).Get(), str) for p in prims),
    }


def ours(stage: Path, out: Path, frame: int) -> np.ndarray:
    """Draws the frames up to one; returns that one as sRGB, H x W x 3."""
    render_frames(stage, out, frame + 1, response="ideal", outputs=("rgb",))
    return next(shot.rgb for shot in read_frames(out) if shot.number == frame)


def theirs(python: str, cameras: Path, frame: int) -> tuple[dict[str, int], np.ndarray]:
    """What Blender finds, and its picture as sRGB."""
    script = Path(__file__).with_name("dcc_picture.py")
    image = cameras.with_name("cycles.exr")
    command = [python, script, cameras, str(frame), image]
    # Blender imports custom attributes; those that a schema declares are none.
    plain = {name: value for name, value in os.environ.items() if name != "PXR_PLUGINPATH_NAME"}
    run = subprocess.run(command, check=True, capture_output=True, text=True, env=plain)
    line = next(line for line in run.stdout.splitlines() if line.startswith("RESULT "))
    channels = OpenEXR.File(str(image)).channels()
    pixels = next(c.pixels for name, c in channels.items() if name.rpartition(".")[2] != "A")
    light, _ = read_light(open_stage(cameras), Usd.TimeCode.EarliestTime())
    with open_context():
        from envgen_usd.render.lighting.sky_texture import open_illuminance  # noqa: PLC0415 - binds the platform

        white = open_illuminance(light) / np.pi * BLENDER
    return json.loads(line[7:]), ideal_picture((pixels[..., :3] / white).astype(np.float32))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("stage", type=Path)
    parser.add_argument("--cycles", required=True, help="Python with the module bpy")
    parser.add_argument("--out", type=Path, default=Path("dcc.png"))
    parser.add_argument("--frame", type=int, default=1)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        frames = Path(name) / "frames"
        drawn = ours(options.stage, frames, options.frame)
        found, traced = theirs(options.cycles, frames / "cameras.usda", options.frame)
        wanted = expected(frames / "cameras.usda")
    print("| | stage | Blender |\n|---|---|---|")
    for key, count in wanted.items():
        print(f"| {key} | {count} | {found[key]} |")
    size = traced.shape[1], traced.shape[0]
    small = np.asarray(Image.fromarray(drawn).resize(size, Image.Resampling.BOX))
    Image.fromarray(np.concatenate([small, traced])).save(options.out)
    means = small.mean(axis=(0, 1)), traced.mean(axis=(0, 1))
    far = float(np.abs(means[1] / means[0] - 1.0).max())
    levels = (np.round(mean).astype(int).tolist() for mean in means)
    print(f"\nmean levels: ours {next(levels)}, Cycles {next(levels)}; {options.out}")
    short = [
        key for key in ("instances", "materials", "lights", "cameras") if found[key] < wanted[key]
    ]
    return int(bool(short) or found["missing textures"] > 0 or far > TOLERANCE)


if __name__ == "__main__":
    sys.exit(main())
