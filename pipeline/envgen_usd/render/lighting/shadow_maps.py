"""Draws the sun's shadow maps: of the casters that can reach what the camera sees."""

from collections.abc import Mapping

import numpy as np
from OpenGL import GL as gl  # noqa: N811

from envgen_usd.models.array_types import BoolArray, FloatArray
from envgen_usd.render.lighting.sun_shadows import (
    CasterChoice,
    ShadedPlaces,
    ShadowView,
    beyond,
    cascades_for,
    shadow_view,
    window,
)
from envgen_usd.render.opengl import gpu
from envgen_usd.render.opengl.draw_list import DrawList
from envgen_usd.render.opengl.shader_looks import CutProgram, Looks
from envgen_usd.render.render_scene import Floats

_LOWEST_SUN = 0.03
"""Least sine of the sun's elevation in the shadow maps."""


class SunDepth:
    """Draws depth along the rays of the sun."""

    def __init__(self, draws: DrawList, looks: Looks) -> None:
        """Compiles the programs."""
        self._draws, self._looks = draws, looks
        self._programs = CutProgram("mesh.vert", "depth.frag")

    def draw(
        self,
        target: gpu.Target,
        view: ShadowView,
        chosen: BoolArray,
        pixels: tuple[int, int, int, int],
    ) -> None:
        """Draws the chosen instances, with back faces; nearer ones are clamped to the front.

        Args:
            target: Square of the view.
            view: View of the target.
            chosen: N, instances.
            pixels: Left, bottom, width and height of the pixels to draw.
        """
        target.bind()
        self._draws.look_from(view.middle)
        self._programs.set(clip=view.clip, **self._looks.units, **self._draws.units)
        gl.glEnable(gl.GL_DEPTH_TEST)
        gl.glClearBufferfv(gl.GL_DEPTH, 0, np.ones(1, np.float32))
        gl.glEnable(gl.GL_SCISSOR_TEST)
        gl.glScissor(*pixels)
        gl.glDepthFunc(gl.GL_LESS)
        gl.glEnable(gl.GL_DEPTH_CLAMP)
        gl.glEnable(gl.GL_POLYGON_OFFSET_FILL)
        gl.glPolygonOffset(1.5, 2.0)
        self._draws.draw(
            chosen,
            lambda m: self._looks.set_cut(self._programs, m),
            alike=self._looks.alike,
            cull=False,
        )
        gl.glDisable(gl.GL_POLYGON_OFFSET_FILL)
        gl.glDisable(gl.GL_DEPTH_CLAMP)
        gl.glDisable(gl.GL_SCISSOR_TEST)


class ShadowMaps:
    """A shadow map for each cascade. Each frame draws its own: none depends on an earlier one."""

    def __init__(
        self, draws: DrawList, rays: SunDepth, units: dict[str, int], focal: float
    ) -> None:
        """Creates the textures.

        Args:
            draws: The scene.
            rays: Draws the maps.
            units: Texture unit by the name of each sampler.
            focal: Focal length of the camera, pixels.
        """
        self._draws, self._rays, self._units = draws, rays, units
        self._focals = (focal, 0.0)  # the far square has the far level of detail
        self._cascades = cascades_for(focal)
        self._targets = [gpu.shadow_target(cascade.side) for cascade in self._cascades]
        self._views: list[ShadowView] = []

    def draw(self, pose: FloatArray, sun: FloatArray, places: Floats) -> None:
        """Draws the shadows on places.

        Args:
            pose: 4 x 4, camera to world.
            sun: 3, towards the sun.
            places: 3 x M, what the camera sees, relative to it.
        """
        towards = np.array([sun[0], sun[1], max(float(sun[2]), _LOWEST_SUN)])
        self._views = [shadow_view(cascade, pose, towards) for cascade in self._cascades]
        eye = pose[:3, 3]
        for view, target, focal in zip(self._views, self._targets, self._focals, strict=True):
            shaded = ShadedPlaces.of(view, places, eye)
            chosen = self._casters(CasterChoice(view, shaded, eye), focal, eye)
            self._rays.draw(target, view, chosen, window(shaded.farthest, target.size[0]))
            places = beyond(view, places, eye)

    def _casters(self, choice: CasterChoice, focal: float, eye: FloatArray) -> BoolArray:
        """The instances that can cast a shadow on places."""
        draws = self._draws
        numbers = draws.of_blocks(choice.of(draws.blocks))
        numbers = numbers[draws.detailed(eye, focal, numbers)]
        chosen = np.zeros(len(draws.boxes), bool)
        chosen[numbers[choice.of(draws.boxes.take(numbers, axis=0))]] = True
        return chosen

    def bind(self, eye: FloatArray) -> Mapping[str, gpu.Value]:
        """Binds the maps, and returns uniforms for positions relative to `eye` (3, world)."""
        for unit, target in zip(self._units.values(), self._targets, strict=True):
            gpu.bind_texture(unit, target.depth)
        near, far = self._views
        return {
            **self._units,
            "shadow_clip_near": near.clip_from(eye),
            "shadow_clip_far": far.clip_from(eye),
            "shadow_texel": (near.texel, far.texel),
        }
