"""Renders a stage with a grey plane in Cycles. Runs with the Python that has the module `bpy`.

    python benchmarks/cycles_plane.py STAGE

Prints linear RGB as JSON: the plane in the whole light and in that of the sky alone, and the sky in
four directions. `benchmarks/grey_plane.py` writes the stages and compares.
"""

import json
import math
import sys
import tempfile
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector

SIDE = 16
"""Pixels along each side of an image."""
FIELD = 50.0
"""Field of view of the images of the sky, degrees."""
ELEVATION = 28.0
"""Elevation of their middles, degrees."""


def import_stage(path: str):
    """Imports a stage into an empty scene; returns its camera."""
    bpy.ops.wm.read_factory_settings()
    for thing in list(bpy.data.objects):
        bpy.data.objects.remove(thing)
    bpy.ops.wm.usd_import(filepath=path)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.device, scene.cycles.samples = "CPU", 64
    scene.cycles.use_denoising = False
    scene.render.threads_mode, scene.render.threads = "FIXED", 1
    scene.render.resolution_x = scene.render.resolution_y = SIDE
    scene.render.resolution_percentage = 100
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    scene.camera = next(thing for thing in bpy.data.objects if thing.type == "CAMERA")
    return scene.camera


def shot() -> list[float]:
    """Mean linear RGB of an image."""
    with tempfile.TemporaryDirectory() as folder:
        bpy.context.scene.render.filepath = str(Path(folder) / "image.exr")
        bpy.ops.render.render(write_still=True)
        image = bpy.data.images.load(bpy.context.scene.render.filepath)
        pixels = np.array(image.pixels[:]).reshape(-1, 4)
        bpy.data.images.remove(image)
    return pixels[:, :3].mean(axis=0).tolist()


def main() -> None:
    camera = import_stage(sys.argv[1])
    result = {"plane": shot()}
    for thing in bpy.data.objects:
        thing.hide_render = thing.hide_render or thing.type == "LIGHT"
    result["sky alone"] = shot()
    camera.data.angle = math.radians(FIELD)
    camera.location = (0, 0, 50)
    for azimuth in (0, 90, 180, 270):
        turn = math.radians(azimuth)
        ahead = Vector((math.sin(turn), math.cos(turn), math.tan(math.radians(ELEVATION))))
        camera.rotation_euler = ahead.to_track_quat("-Z", "Y").to_euler()
        result[f"sky at {azimuth}"] = shot()
    print("RESULT", json.dumps(result))


if __name__ == "__main__":
    main()
