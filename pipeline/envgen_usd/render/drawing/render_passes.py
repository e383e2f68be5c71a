"""Renders a packed scene: labels with depth, shadow maps, occlusion, and colour."""

import numpy as np
from numpy.typing import NDArray
from OpenGL import GL as gl  # noqa: N811
from OpenGL.GL.ARB.clip_control import glClipControl  # OSMesa lacks the core name

from envgen_usd.models.array_types import BoolArray, FloatArray
from envgen_usd.render.cameras.camera_pose import Pose
from envgen_usd.render.cameras.camera_rig import Camera
from envgen_usd.render.drawing.drawn_frame import Frame, FrameRequest
from envgen_usd.render.drawing.edge_samples import EdgeInput, EdgeSamples
from envgen_usd.render.drawing.label_pass import LabelledPixels, LabelPass
from envgen_usd.render.drawing.lane_map import LaneMap
from envgen_usd.render.drawing.normal_pass import NormalPass
from envgen_usd.render.drawing.partial_cover import PartialCover
from envgen_usd.render.drawing.silhouettes import Silhouettes
from envgen_usd.render.lighting.ambient_occlusion import Occlusion
from envgen_usd.render.lighting.headlamps import headlamp_uniforms
from envgen_usd.render.lighting.height_map import HeightMap
from envgen_usd.render.lighting.lamp_uniforms import lamp_uniforms
from envgen_usd.render.lighting.shadow_maps import ShadowMaps, SunDepth
from envgen_usd.render.lighting.sky_texture import SkyTexture
from envgen_usd.render.lighting.wet_mirror import WetMirror
from envgen_usd.render.moving_parts import lamps_at
from envgen_usd.render.opengl import gpu
from envgen_usd.render.opengl.draw_list import DrawList
from envgen_usd.render.opengl.scene_tiles import Packed
from envgen_usd.render.opengl.shader_looks import ColourPrograms, Looks
from envgen_usd.render.render_scene import Floats, Scene

_SHADOW_UNITS = {"shadow_near": 2, "shadow_far": 3}
_OCCLUSION_UNIT = 4
_ORIGINS_UNIT = 5
_SKY_UNIT = 6
_LANES_UNIT = 7
_SQUARE = 512.0
"""Side in metres of the squares in which puddles repeat; keeps single precision exact."""


class FrameRenderer:
    """A scene on the GPU. Needs a current context for its whole life."""

    def __init__(self, scene: Scene, packed: Packed, camera: Camera) -> None:
        """Uploads all geometry and textures."""
        self._scene, self._camera = scene, camera
        glClipControl(gl.GL_LOWER_LEFT, gl.GL_ZERO_TO_ONE)
        self._colours = ColourPrograms(scene.materials)
        self._skies = gpu.Program("screen.vert", "sky.frag")
        self._looks = Looks(scene.materials, scene.textures)
        self._draws = DrawList(packed, _ORIGINS_UNIT, self._looks.cut_out)
        size = camera.width, camera.height
        self._cover = PartialCover(size, self._draws, self._looks, scene.scene_objects)
        self._labels = LabelPass(camera, self._draws, self._looks, self._cover)
        depth = self._labels.target.depth
        self._pixels = gpu.render_target(size, (gl.GL_RGBA16F,), depth)
        self._edges = EdgeSamples(camera, self._draws, self._looks)
        rays = SunDepth(self._draws, self._looks)
        self._shadows = ShadowMaps(self._draws, rays, _SHADOW_UNITS, max(camera.fx, camera.fy))
        self._heights = HeightMap(self._draws, self._looks)
        self._occlusion = Occlusion(camera)
        self._sky = SkyTexture(_SKY_UNIT)
        self._lanes = LaneMap(scene.lanes)
        self._normals: NormalPass | None = None
        self._mirror: WetMirror | None = None
        self._silhouettes: Silhouettes | None = None

    def draw(self, request: FrameRequest) -> Frame:
        """Renders the images of a pose."""
        pose = request.pose
        eye = pose.matrix[:3, 3]
        self._draws.place(request.moment)
        self._draws.look_from(eye)
        clip = _clip_matrix(self._camera, pose)
        pixels = self._labels.draw(pose, clip)
        if not request.colour:
            nothing = np.empty((0, 0, 3), np.float32)
            pixels = self._labels.outlined(pixels, clip)
            surfaces = self._draw_normals(pose, pixels) if request.normals else None
            labelled = pixels.scene_objects, pixels.depth
            return Frame(nothing, *labelled, normals=surfaces, bodies=pixels.bodies)
        light = request.atmosphere or self._scene.light
        self._sky.show(light)
        places = self._places(pixels.depth, pose)
        if self._sky.has_sun:
            self._shadows.draw(pose.matrix, light.sun_direction, places)
        self._heights.draw(pose.matrix, places)
        self._occlusion.draw(self._labels.target.colours[1], self._heights, pose)
        self._lanes.draw(pose)
        self._draws.look_from(eye)
        self._draw_colour(request, pixels.seen)
        centres = self._mirrored(pose) if light.wetness > 0.0 else self._pixels
        self._cover.draw(self._labels.target, clip, pixels.seen)
        smoothed = self._smooth_edges(pose, pixels.seen, centres)
        pixels = self._labels.outlined(pixels, clip)
        radiance = gpu.read_pixels(smoothed, 0, gl.GL_RGB, gl.GL_FLOAT)
        surfaces = self._draw_normals(pose, pixels) if request.normals else None
        drawn = self._sky.white, light.rain, surfaces
        return Frame(radiance, pixels.scene_objects, pixels.depth, *drawn, pixels.bodies)

    def silhouettes(self, pose: Pose, slots: NDArray[np.uint32]) -> NDArray[np.uint32]:
        """Masks of the pixels that objects would cover alone; see `Silhouettes.masks`."""
        if self._silhouettes is None:
            self._silhouettes = Silhouettes(self._camera, self._draws, self._looks)
        eye, clip = pose.matrix[:3, 3], _clip_matrix(self._camera, pose)
        self._draws.look_from(eye)
        level = self._draws.detailed(eye, max(self._camera.fx, self._camera.fy))
        return self._silhouettes.masks(clip, self._draws.inside(clip, eye) & level, slots)

    def _draw_normals(self, pose: Pose, pixels: LabelledPixels) -> Floats:
        if self._normals is None:
            self._normals = NormalPass(self._camera, self._draws)
        return self._normals.draw(pose, _clip_matrix(self._camera, pose), pixels)

    def _places(self, depth: Floats, pose: Pose) -> Floats:
        """Places that every fourth column of an image shows, relative to the camera: 3 x M."""
        camera, axes = self._camera, pose.matrix[:3, :3].astype(np.float32)
        columns = (np.arange(0, camera.width, 4) - camera.cx) / camera.fx
        rows = (np.arange(camera.height) - camera.cy) / camera.fy
        depth = depth[:, ::4]
        ahead = np.empty((3, *depth.shape), np.float32)
        ahead[0] = depth * columns.astype(np.float32)
        ahead[1] = depth * rows.astype(np.float32)[:, None]
        ahead[2] = depth
        seen = ahead.reshape(3, -1)[:, depth.reshape(-1) > 0.0]
        places: Floats = np.einsum("ij,jm->im", axes, seen)
        return places

    def _smooth_edges(self, pose: Pose, seen: BoolArray, centres: gpu.Target) -> gpu.Target:
        """Mixes the colours of pixels that surfaces share."""
        clip = _clip_matrix(self._edges.camera, pose)
        shown = EdgeInput(self._labels.target, centres.colours[0], self._cover.openness)
        return self._edges.smooth(shown, clip, seen)

    def _mirrored(self, pose: Pose) -> gpu.Target:
        if self._mirror is None:
            self._mirror = WetMirror(self._camera)
        return self._mirror.draw(self._pixels, self._labels.target.colours[1], self._sky, pose)

    def _draw_colour(self, request: FrameRequest, shown: BoolArray) -> None:
        """Shades the centre of each pixel once: the labels' depth buffer tells the nearest."""
        self._pixels.bind()
        pose = request.pose
        eye, ahead = pose.matrix[:3, 3], pose.matrix[:3, 2]
        gl.glEnable(gl.GL_DEPTH_TEST)
        gl.glDepthMask(False)
        gl.glDepthFunc(gl.GL_EQUAL)
        unit = self._sky.lamp_unit
        lamps = lamp_uniforms(lamps_at(self._scene, request.moment), eye, ahead, unit)
        own = headlamp_uniforms(request.headlamps, eye, unit, self._sky.white)
        are_lit = lamps["lamp_count"] != 0 or own["headlamp_count"] != 0
        gpu.bind_texture(_OCCLUSION_UNIT, self._occlusion.result)
        wet, sun = self._sky.wetness > 0.0, self._sky.has_sun
        light = self._sky.bind()
        uniforms = {
            **light,
            **(self._shadows.bind(eye) if sun else {}),
            **self._lanes.bind(_LANES_UNIT),
            "clip": _clip_matrix(self._camera, pose),
            **self._looks.units,
            **self._draws.units,
            "occlusion_map": _OCCLUSION_UNIT,
            "eye_place": np.mod(eye[:2], _SQUARE),
            **lamps,
            **own,
        }
        self._colours.choose(gpu.encoded(uniforms), wet=wet, lamps=are_lit, sun=sun)
        self._draws.draw(shown, lambda m: self._looks.set_look(self._colours, m))
        self._skies.use()
        lens = self._camera.lens_uniforms()
        self._skies.set(**light, **lens, camera_axes=pose.matrix[:3, :3])
        gl.glDrawArrays(gl.GL_TRIANGLES, 0, 3)
        gl.glDepthMask(True)


def _clip_matrix(camera: Camera, pose: Pose) -> FloatArray:
    """From positions relative to the camera to clip space: 4 x 4."""
    turn = np.eye(4)
    turn[:3, :3] = pose.matrix[:3, :3].T
    return camera.clip_matrix() @ turn
