"""Path-traced images of a scene with Mitsuba 3: the judge of the drawn light.

W. Jakob et al., "Mitsuba 3 renderer" (2022). Geometry, textures, cut-outs, camera and light are
those of the drawn images. Left out are normal maps, haze, wet ground, all lamps, and the sun's
disc in the sky; the sun is a point.
"""

from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np

from envgen_usd.errors import EnvgenError
from envgen_usd.models.atmosphere import Atmosphere
from envgen_usd.render.cameras.camera_pose import Pose
from envgen_usd.render.cameras.camera_rig import Camera
from envgen_usd.render.drawing.drawn_frame import Frame, FrameRequest
from envgen_usd.render.drawing.render_passes import FrameRenderer
from envgen_usd.render.lighting.sky_texture import exposed, white_level
from envgen_usd.render.moving_parts import frozen_scene
from envgen_usd.render.opengl.scene_tiles import Packed
from envgen_usd.render.path_tracing.mitsuba_variants import open_mitsuba
from envgen_usd.render.path_tracing.tracer_geometry import JoinedMesh, meshes_near
from envgen_usd.render.path_tracing.tracer_materials import COLOURS, TracerMaterials, linear
from envgen_usd.render.render_scene import Floats, Moment, Scene

REACH = 200.0
"""Distance in metres within which objects are traced; a larger value uses more memory."""
SAMPLES = 64
"""Light paths of a pixel; a larger value has less noise and takes longer."""
_BOUNCES = 6
"""Largest number of bounces of a path."""
_SQUARE = 0.01
"""Largest relative difference of a camera's two focal lengths."""


class PathTracer:
    """A scene before a camera, traced in the light of each frame."""

    def __init__(self, scene: Scene, camera: Camera, samples: int = SAMPLES) -> None:
        """Chooses the kind of Mitsuba that runs here.

        Raises:
            EnvgenError: Mitsuba is missing, no kind of it runs, or the pixels are not square.
        """
        if abs(camera.fx / camera.fy - 1.0) > _SQUARE:
            raise EnvgenError("render: --engine mitsuba needs a rig with equal fx and fy")
        self._mitsuba = open_mitsuba()
        self._scene, self._camera, self._samples = scene, camera, samples
        self._materials = TracerMaterials(self._mitsuba)
        self._bsdf = lru_cache(maxsize=None)(
            lambda index: self._materials.bsdf(scene.materials[index])
        )

    def radiance(
        self, pose: Pose, atmosphere: Atmosphere | None = None, moment: Moment | None = None
    ) -> Floats:
        """Traces a frame; linear RGB, H x W x 3, in which white, open ground has 1."""
        light = exposed(atmosphere or self._scene.light)
        near = meshes_near(frozen_scene(self._scene, moment), pose.matrix[:3, 3], REACH)
        content = {
            f"mesh_{index}": self._mesh(index, mesh, light.lamp_unit)
            for index, mesh in near.items()
        }
        content |= {"sky": self._sky(light), "integrator": self._integrator()}
        if light.sun.max() > 0.0 and light.sun_direction[2] > 0.0:
            content["sun"] = self._sun(light)
        content["sensor"] = self._sensor(pose)
        loaded = self._mitsuba.load_dict({"type": "scene", **content})
        image = self._mitsuba.render(loaded, spp=self._samples)
        traced: Floats = np.array(image, np.float32)[..., :3]
        return traced

    def _integrator(self) -> dict[str, Any]:
        # Unlike `path`, this integrator lets the sun through the cut-outs of leaves.
        return {"type": "volpath", "max_depth": _BOUNCES + 1}

    def _mesh(self, index: int, joined: JoinedMesh, lamp_unit: float) -> Any:  # noqa: ANN401
        mitsuba = self._mitsuba
        properties = mitsuba.Properties()
        properties["mesh_bsdf"] = self._bsdf(index)
        radiance = self._materials.radiance(self._scene.materials[index], lamp_unit)
        if radiance is not None:
            properties["mesh_emitter"] = mitsuba.load_dict({"type": "area", "radiance": radiance})
        mesh = mitsuba.Mesh(
            f"mesh_{index}", len(joined.points), len(joined.triangles), properties, True, True
        )
        if self._scene.materials[index].vertex_colour:
            mesh.add_attribute(COLOURS, 3, linear(joined.colours).ravel())
        arrays = mitsuba.traverse(mesh)
        arrays["vertex_positions"] = joined.points.ravel()
        arrays["vertex_normals"] = joined.normals.ravel()
        arrays["vertex_texcoords"] = joined.uvs.astype(np.float32).ravel()
        arrays["faces"] = joined.triangles.ravel()
        arrays.update()
        return mesh

    def _sky(self, light: Atmosphere) -> dict[str, Any]:
        # Mitsuba's map is y-up and has -z at its left edge; a sky map has its north there.
        turn = self._mitsuba.ScalarTransform4f().rotate([1, 0, 0], 90)
        bitmap = self._mitsuba.Bitmap(np.array(light.sky, np.float32))
        return {"type": "envmap", "bitmap": bitmap, "to_world": turn}

    def _sun(self, light: Atmosphere) -> dict[str, Any]:
        power = {"type": "rgb", "value": light.sun.tolist()}
        return {
            "type": "directional",
            "direction": (-light.sun_direction).tolist(),
            "irradiance": power,
        }

    def _sensor(self, pose: Pose) -> dict[str, Any]:
        """The camera at the origin; its x grows to the left and its y upwards in Mitsuba."""
        camera, axes = self._camera, np.eye(4)
        axes[:3, :3] = pose.matrix[:3, :3] * (-1.0, -1.0, 1.0)
        return {
            "type": "perspective",
            "fov": float(np.degrees(2.0 * np.arctan(camera.width / (2.0 * camera.fx)))),
            "fov_axis": "x",
            "principal_point_offset_x": 0.5 - (camera.cx + 0.5) / camera.width,
            "principal_point_offset_y": 0.5 - (camera.cy + 0.5) / camera.height,
            "near_clip": camera.near,
            "far_clip": 1e5,
            "to_world": self._mitsuba.ScalarTransform4f(axes.tolist()),
            "film": {
                "type": "hdrfilm",
                "width": camera.width,
                "height": camera.height,
                "pixel_format": "rgb",
                "component_format": "float32",
                "rfilter": {"type": "box"},
            },
            "sampler": {"type": "independent"},
        }


class TracedFrames:
    """Frames with drawn labels and depth, and traced pictures. Needs a current context."""

    def __init__(self, scene: Scene, packed: Packed, camera: Camera) -> None:
        """Uploads the scene; see `PathTracer` for errors."""
        self._scene = scene
        self._tracer = PathTracer(scene, camera)
        self._renderer = FrameRenderer(scene, packed, camera)
        self.silhouettes = self._renderer.silhouettes

    def draw(self, request: FrameRequest) -> Frame:
        """Makes the images of a pose; no lamps are traced."""
        frame = self._renderer.draw(replace(request, colour=False))
        if not request.colour:
            return frame
        light = request.atmosphere or self._scene.light
        radiance = self._tracer.radiance(request.pose, light, request.moment)
        return replace(frame, radiance=radiance, white=white_level(light), rain=light.rain)
