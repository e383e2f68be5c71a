"""Renders a packed scene: labels with depth, shadow maps, occlusion, and colour."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from OpenGL import GL as gl  # noqa: N811
from OpenGL.GL.ARB.clip_control import glClipControl  # OSMesa lacks the core name

from envgen_usd.models.array_types import BoolArray, ByteArray, FloatArray
from envgen_usd.models.atmosphere import Atmosphere
from envgen_usd.render import gpu
from envgen_usd.render.ambient_occlusion import Occlusion
from envgen_usd.render.camera_response import ideal_picture
from envgen_usd.render.camera_rig import Camera
from envgen_usd.render.camera_route import Pose
from envgen_usd.render.draw_list import DrawList
from envgen_usd.render.lamp_uniforms import lamp_uniforms
from envgen_usd.render.render_scene import Floats, Scene
from envgen_usd.render.scene_tiles import Packed
from envgen_usd.render.shader_looks import COLOUR_UNIT, SURFACE_UNIT, Looks
from envgen_usd.render.sky_texture import SkyTexture
from envgen_usd.render.sun_shadows import CASCADES, HEIGHTS, Cascade, ShadowView, shadow_view

_LOWEST_SUN = 0.03
"""Least sine of the sun's elevation in the shadow maps."""
_FINER = 2
"""Samples along each side of a pixel that are averaged; a larger value smooths edges."""
_SHADOW_UNITS = {"shadow_near": 2, "shadow_far": 3}
_OCCLUSION_UNIT = 4
_ORIGINS_UNIT = 5
_SKY_UNIT = 6
_SQUARE = 512.0
"""Side in metres of the squares in which puddles repeat; keeps single precision exact."""


@dataclass(frozen=True)
class Frame:
    """Images of a pose, first row at the top.

    Attributes:
        radiance: H x W x 3, linear RGB; a white surface on open ground has 1. Empty if it was not
            drawn.
        scene_objects: H x W, index into `Scene.scene_objects` at each pixel's centre.
        depth: H x W, metres along the optical axis; 0 in the sky.
        white: Illuminance in klx of a white surface with a radiance of 1.
        rain: Rate of rain, mm/h.
    """

    radiance: Floats
    scene_objects: NDArray[np.uint32]
    depth: Floats
    white: float = 100.0
    rain: float = 0.0

    @property
    def rgb(self) -> ByteArray:
        """The picture of an ideal camera, H x W x 3, sRGB."""
        return ideal_picture(self.radiance)


@dataclass
class _ShadowMap:
    """A shadow map of a square, reused while the square stays in place."""

    cascade: Cascade
    target: gpu.Target
    view: ShadowView | None = None
    light: FloatArray | None = None


class FrameRenderer:
    """A scene on the GPU. Needs a current context for its whole life."""

    def __init__(self, scene: Scene, packed: Packed, camera: Camera) -> None:
        """Uploads all geometry and textures."""
        self._scene, self._camera = scene, camera
        glClipControl(gl.GL_LOWER_LEFT, gl.GL_ZERO_TO_ONE)
        self._programs = {
            "labels": gpu.Program("mesh.vert", "labels.frag"),
            "depth": gpu.Program("mesh.vert", "depth.frag"),
            "colour": gpu.Program("mesh.vert", "colour.frag"),
            "sky": gpu.Program("screen.vert", "sky.frag"),
        }
        self._looks = Looks(scene.materials)
        self._draws = DrawList(packed, _ORIGINS_UNIT)
        size = camera.width, camera.height
        self._labels = gpu.render_target(size, (gl.GL_R32UI, gl.GL_R32F))
        fine = size[0] * _FINER, size[1] * _FINER
        self._colour = gpu.render_target(fine, (gl.GL_RGBA16F,))
        self._resolved = gpu.render_target(size, (gl.GL_RGBA16F,))
        self._shadows = [_ShadowMap(c, gpu.shadow_target(c.side)) for c in CASCADES]
        side = HEIGHTS.side, HEIGHTS.side
        self._heights = _ShadowMap(HEIGHTS, gpu.render_target(side, ()))
        self._occlusion = Occlusion(camera)
        self._sky = SkyTexture(_SKY_UNIT)

    def draw(
        self, pose: Pose, atmosphere: Atmosphere | None = None, *, colour: bool = True
    ) -> Frame:
        """Renders the images of a pose, in the light of the stage or of another atmosphere.

        Without `colour`, only labels and depth are drawn.
        """
        eye = pose.matrix[:3, 3]
        turn = np.eye(4)
        turn[:3, :3] = pose.matrix[:3, :3].T
        clip = self._camera.clip_matrix() @ turn
        self._draws.look_from(eye)
        inside = self._draws.inside(clip, eye)
        self._draw_labels(clip, inside)
        scene_objects = gpu.read_pixels(self._labels, 0, gl.GL_RED_INTEGER, gl.GL_UNSIGNED_INT)
        depth = gpu.read_pixels(self._labels, 1, gl.GL_RED, gl.GL_FLOAT)
        if not colour:
            return Frame(np.empty((0, 0, 3), np.float32), scene_objects, depth)
        light = atmosphere or self._scene.light
        self._sky.show(light)
        sun = _caster(light.sun_direction)
        views = [self._updated(shadow, pose, sun) for shadow in self._shadows]
        above = self._updated(self._heights, pose, np.array([0.0, 0.0, 1.0]))
        self._draws.look_from(eye)
        self._occlusion.draw(self._labels.colours[1], self._heights.target.depth, above, pose)
        seen = np.bincount(scene_objects.reshape(-1), minlength=len(self._scene.scene_objects)) > 0
        self._draw_colour(clip, inside & self._draws.showing(seen), views, pose)
        self._draw_sky(pose)
        self._resolve()
        radiance = gpu.read_pixels(self._resolved, 0, gl.GL_RGB, gl.GL_FLOAT)
        return Frame(radiance, scene_objects, depth, self._sky.white, light.rain)

    def _begin(self, name: str, clip: FloatArray) -> gpu.Program:
        program = self._programs[name]
        program.use()
        program.set(clip=clip, colour_map=COLOUR_UNIT, tile_origins=_ORIGINS_UNIT)
        gl.glEnable(gl.GL_DEPTH_TEST)
        return program

    def _draw_labels(self, clip: FloatArray, inside: BoolArray) -> None:
        self._labels.bind()
        gl.glClearBufferuiv(gl.GL_COLOR, 0, np.zeros(4, np.uint32))
        gl.glClearBufferfv(gl.GL_COLOR, 1, np.zeros(4, np.float32))
        gl.glClearBufferfv(gl.GL_DEPTH, 0, np.zeros(1, np.float32))
        gl.glDepthFunc(gl.GL_GREATER)
        program = self._begin("labels", clip)
        self._draws.draw(inside, lambda m: self._looks.set_cut(program, m))

    def _updated(self, shadow: _ShadowMap, pose: Pose, light: FloatArray) -> ShadowView:
        """Renders a shadow map, unless it shows the right square already."""
        view = shadow_view(shadow.cascade, pose.matrix, light)
        same_light = np.array_equal(shadow.light, light) if shadow.light is not None else False
        if same_light and shadow.view and np.array_equal(shadow.view.middle, view.middle):
            return shadow.view
        shadow.view, shadow.light = view, light
        shadow.target.bind()
        self._draws.look_from(view.middle)
        gl.glClearBufferfv(gl.GL_DEPTH, 0, np.ones(1, np.float32))
        gl.glDepthFunc(gl.GL_LESS)
        gl.glEnable(gl.GL_DEPTH_CLAMP)
        gl.glEnable(gl.GL_POLYGON_OFFSET_FILL)
        gl.glPolygonOffset(1.5, 2.0)
        program = self._begin("depth", view.clip)
        inside = self._draws.inside(view.clip, view.middle)
        self._draws.draw(inside, lambda m: self._looks.set_cut(program, m), cull=False)
        gl.glDisable(gl.GL_POLYGON_OFFSET_FILL)
        gl.glDisable(gl.GL_DEPTH_CLAMP)
        return view

    def _draw_colour(
        self, clip: FloatArray, shown: BoolArray, views: Sequence[ShadowView], pose: Pose
    ) -> None:
        """Draws a depth prepass, so that each sample is shaded only once."""
        eye, ahead = pose.matrix[:3, 3], -pose.matrix[:3, 2]
        self._colour.bind()
        gl.glClearBufferfv(gl.GL_DEPTH, 0, np.zeros(1, np.float32))
        gl.glDepthFunc(gl.GL_GREATER)
        gl.glColorMask(False, False, False, False)
        depth = self._begin("depth", clip)
        self._draws.draw(shown, lambda m: self._looks.set_cut(depth, m))
        gl.glColorMask(True, True, True, True)
        gl.glDepthFunc(gl.GL_EQUAL)
        program = self._begin("colour", clip)
        self._sky.set_uniforms(program)
        for (name, unit), shadow in zip(_SHADOW_UNITS.items(), self._shadows, strict=True):
            gpu.bind_texture(unit, shadow.target.depth)
            program.set(**{name: unit})
        gpu.bind_texture(_OCCLUSION_UNIT, self._occlusion.result)
        program.set(
            surface_map=SURFACE_UNIT,
            occlusion_map=_OCCLUSION_UNIT,
            finer=_FINER,
            shadow_clip_near=views[0].clip_from(eye),
            shadow_clip_far=views[1].clip_from(eye),
            shadow_texel=(views[0].texel, views[1].texel),
            eye_place=np.mod(eye[:2], _SQUARE),
            **lamp_uniforms(self._scene.lamps, eye, ahead, self._sky.lamp_unit),
        )
        self._draws.draw(shown, lambda m: self._looks.set_look(program, m))

    def _draw_sky(self, pose: Pose) -> None:
        program = self._programs["sky"]
        program.use()
        self._sky.set_uniforms(program)
        program.set(**self._camera.lens_uniforms(), camera_axes=pose.matrix[:3, :3])
        gl.glDrawArrays(gl.GL_TRIANGLES, 0, 3)

    def _resolve(self) -> None:
        """Averages the samples of each pixel in linear light, two by two."""
        gl.glBindFramebuffer(gl.GL_READ_FRAMEBUFFER, self._colour.handle)
        gl.glBindFramebuffer(gl.GL_DRAW_FRAMEBUFFER, self._resolved.handle)
        fine, whole = (0, 0, *self._colour.size), (0, 0, *self._resolved.size)
        gl.glBlitFramebuffer(*fine, *whole, gl.GL_COLOR_BUFFER_BIT, gl.GL_LINEAR)


def _caster(direction: FloatArray) -> FloatArray:
    """Returns a direction for the shadow maps: that of the sun, above the horizon."""
    return np.array([direction[0], direction[1], max(float(direction[2]), _LOWEST_SUN)])
