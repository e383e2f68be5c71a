"""Draws a packed scene: shadow maps, labels with depth, and colour."""

import ctypes
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np
from numpy.typing import NDArray
from OpenGL import GL as gl  # noqa: N811
from OpenGL.GL.ARB.clip_control import glClipControl  # the core name lacks on OSMesa

from envgen_usd.models.arrays import BoolArray, ByteArray, FloatArray
from envgen_usd.render import gpu
from envgen_usd.render.rig import Camera, Pose
from envgen_usd.render.scene import Floats, Material, Scene
from envgen_usd.render.shadows import CASCADES, SIDE, ShadowView, shadow_view
from envgen_usd.render.textures import TextureTable
from envgen_usd.render.tiles import COMMAND, INSTANCE, VERTEX, Packed, State

EXPOSURE = 1.25
HAZE = 0.0006
"""Share of light that the air takes and replaces, a metre."""
_FINER = 2
"""Colours are drawn with so many samples along each side of a pixel and then averaged."""
_UNITS = {"colour_map": 0, "surface_map": 1, "shadow_near": 2, "shadow_far": 3, "tile_origins": 4}


@dataclass(frozen=True)
class Frame:
    """Images of one pose, first row at the top.

    Attributes:
        rgb: H x W x 3, sRGB.
        things: H x W, index into `Scene.things` of what each pixel's centre shows.
        depth: H x W, metres along the optical axis; 0 where the sky is seen.
    """

    rgb: ByteArray
    things: NDArray[np.uint32]
    depth: Floats


class FrameRenderer:
    """A scene on the graphics card. Needs a current context for its whole life."""

    def __init__(self, scene: Scene, packed: Packed, camera: Camera) -> None:
        """Uploads everything."""
        self._scene, self._packed, self._camera = scene, packed, camera
        glClipControl(gl.GL_LOWER_LEFT, gl.GL_ZERO_TO_ONE)
        self._programs = {
            "labels": gpu.Program("mesh.vert", "labels.frag"),
            "depth": gpu.Program("mesh.vert", "depth.frag"),
            "colour": gpu.Program("mesh.vert", "colour.frag"),
            "sky": gpu.Program("sky.vert", "sky.frag"),
        }
        self._textures = TextureTable()
        self._upload(packed)
        size = camera.width, camera.height
        self._labels = gpu.render_target(size, (gl.GL_R32UI, gl.GL_R32F))
        fine = size[0] * _FINER, size[1] * _FINER
        self._colour = gpu.render_target(fine, (gl.GL_SRGB8_ALPHA8,))
        self._resolved = gpu.render_target(size, (gl.GL_SRGB8_ALPHA8,))
        self._shadows = tuple(gpu.shadow_target(SIDE) for _ in CASCADES)
        self._shadow_views: list[ShadowView | None] = [None for _ in CASCADES]

    def draw(self, pose: Pose) -> Frame:
        """Draws all images of one pose."""
        sun = np.array(self._scene.light.sun_direction)
        views = [shadow_view(cascade, pose.matrix, sun) for cascade in CASCADES]
        for number, view in enumerate(views):
            self._update_shadow(number, view)
        eye = pose.matrix[:3, 3]
        turn = np.eye(4)
        turn[:3, :3] = pose.matrix[:3, :3].T
        clip = self._camera.clip_matrix() @ turn
        self._move_tiles(eye)
        inside = self._inside(clip, eye)
        self._draw_labels(clip, inside)
        things = gpu.read_pixels(self._labels, 0, gl.GL_RED_INTEGER, gl.GL_UNSIGNED_INT)
        depth = gpu.read_pixels(self._labels, 1, gl.GL_RED, gl.GL_FLOAT)
        self._draw_colour(clip, inside & self._shown(things), views, eye)
        self._draw_sky(pose)
        self._resolve()
        rgb = gpu.read_pixels(self._resolved, 0, gl.GL_RGB, gl.GL_UNSIGNED_BYTE)
        return Frame(rgb, things, depth)

    def _upload(self, packed: Packed) -> None:
        gl.glBindVertexArray(gl.glGenVertexArrays(1))
        gpu.buffer(gl.GL_ARRAY_BUFFER, packed.vertices)
        gpu.vertex_attribute(0, VERTEX, "position", gl.GL_FLOAT, False)
        gpu.vertex_attribute(1, VERTEX, "normal", gl.GL_SHORT, True)
        gpu.vertex_attribute(2, VERTEX, "uv", gl.GL_FLOAT, False)
        gpu.vertex_attribute(3, VERTEX, "colour", gl.GL_UNSIGNED_BYTE, True)
        gpu.vertex_attribute(4, VERTEX, "thing", gl.GL_UNSIGNED_INT, False)
        self._instances = gpu.buffer(gl.GL_ARRAY_BUFFER, packed.instances)
        gpu.vertex_attribute(5, INSTANCE, "rows", gl.GL_FLOAT, False, 1)
        gpu.vertex_attribute(8, INSTANCE, "thing", gl.GL_UNSIGNED_INT, False, 1)
        gpu.vertex_attribute(9, INSTANCE, "tile", gl.GL_UNSIGNED_INT, False, 1)
        gpu.buffer(gl.GL_ELEMENT_ARRAY_BUFFER, packed.indices)
        self._commands = gpu.buffer(gl.GL_DRAW_INDIRECT_BUFFER, packed.commands)
        origins = np.zeros((len(packed.origins), 4), np.float32)
        self._origins = gpu.buffer(gl.GL_TEXTURE_BUFFER, origins)
        self._origin_texture = int(gl.glGenTextures(1))
        gl.glBindTexture(gl.GL_TEXTURE_BUFFER, self._origin_texture)
        gl.glTexBuffer(gl.GL_TEXTURE_BUFFER, gl.GL_RGBA32F, self._origins)

    def _move_tiles(self, eye: FloatArray) -> None:
        origins = np.zeros((len(self._packed.origins), 4), np.float32)
        origins[:, :3] = self._packed.origins - eye
        gl.glBindBuffer(gl.GL_TEXTURE_BUFFER, self._origins)
        gl.glBufferSubData(gl.GL_TEXTURE_BUFFER, 0, origins.nbytes, origins)
        gl.glActiveTexture(gl.GL_TEXTURE0 + _UNITS["tile_origins"])
        gl.glBindTexture(gl.GL_TEXTURE_BUFFER, self._origin_texture)

    def _begin(self, name: str, clip: FloatArray, units: Sequence[str]) -> gpu.Program:
        program = self._programs[name]
        program.use()
        program.set(clip=clip, **{unit: _UNITS[unit] for unit in (*units, "tile_origins")})
        gl.glEnable(gl.GL_DEPTH_TEST)
        return program

    def _draw_labels(self, clip: FloatArray, inside: BoolArray) -> None:
        self._labels.bind()
        gl.glClearBufferuiv(gl.GL_COLOR, 0, np.zeros(4, np.uint32))
        gl.glClearBufferfv(gl.GL_COLOR, 1, np.zeros(4, np.float32))
        gl.glClearBufferfv(gl.GL_DEPTH, 0, np.zeros(1, np.float32))
        gl.glDepthFunc(gl.GL_GREATER)
        program = self._begin("labels", clip, ("colour_map",))
        self._draw_all(inside, lambda m: self._set_cut(program, m))

    def _update_shadow(self, number: int, view: ShadowView) -> None:
        """Draws a shadow map, unless it shows the same square already."""
        held = self._shadow_views[number]
        if held is not None and np.array_equal(held.middle, view.middle):
            return
        self._shadow_views[number] = view
        self._shadows[number].bind()
        self._move_tiles(view.middle)
        gl.glClearBufferfv(gl.GL_DEPTH, 0, np.ones(1, np.float32))
        gl.glDepthFunc(gl.GL_LESS)
        gl.glEnable(gl.GL_DEPTH_CLAMP)
        gl.glEnable(gl.GL_POLYGON_OFFSET_FILL)
        gl.glPolygonOffset(1.5, 2.0)
        program = self._begin("depth", view.clip, ("colour_map",))
        inside = self._inside(view.clip, view.middle)
        self._draw_all(inside, lambda m: self._set_cut(program, m), cull=False)
        gl.glDisable(gl.GL_POLYGON_OFFSET_FILL)
        gl.glDisable(gl.GL_DEPTH_CLAMP)

    def _draw_colour(
        self, clip: FloatArray, shown: BoolArray, views: Sequence[ShadowView], eye: FloatArray
    ) -> None:
        """Draws depth first, so that the costly colours are worked out once a pixel."""
        self._colour.bind()
        gl.glClearBufferfv(gl.GL_DEPTH, 0, np.zeros(1, np.float32))
        gl.glDepthFunc(gl.GL_GREATER)
        gl.glColorMask(False, False, False, False)
        depth = self._begin("depth", clip, ("colour_map",))
        self._draw_all(shown, lambda m: self._set_cut(depth, m))
        gl.glColorMask(True, True, True, True)
        gl.glDepthFunc(gl.GL_EQUAL)
        program = self._begin("colour", clip, tuple(_UNITS)[:4])
        self._set_light(program)
        program.set(
            shadow_clip_near=views[0].clip_from(eye),
            shadow_clip_far=views[1].clip_from(eye),
            shadow_texel=(views[0].texel, views[1].texel),
            haze=HAZE,
        )
        for name, target in zip(("shadow_near", "shadow_far"), self._shadows, strict=True):
            gl.glActiveTexture(gl.GL_TEXTURE0 + _UNITS[name])
            gl.glBindTexture(gl.GL_TEXTURE_2D, target.depth)
        gl.glEnable(gl.GL_FRAMEBUFFER_SRGB)
        self._draw_all(shown, lambda m: self._set_look(program, m))

    def _draw_sky(self, pose: Pose) -> None:
        camera = self._camera
        program = self._programs["sky"]
        program.use()
        self._set_light(program)
        program.set(
            lens=(camera.fx, camera.fy, camera.cx, camera.cy),
            image_size=(camera.width, camera.height),
            camera_axes=pose.matrix[:3, :3],
        )
        gl.glDepthFunc(gl.GL_EQUAL)
        gl.glDrawArrays(gl.GL_TRIANGLES, 0, 3)

    def _resolve(self) -> None:
        """Averages the samples of each pixel, in linear light: half-way between two by two."""
        gl.glBindFramebuffer(gl.GL_READ_FRAMEBUFFER, self._colour.handle)
        gl.glBindFramebuffer(gl.GL_DRAW_FRAMEBUFFER, self._resolved.handle)
        fine, whole = (0, 0, *self._colour.size), (0, 0, *self._resolved.size)
        gl.glBlitFramebuffer(*fine, *whole, gl.GL_COLOR_BUFFER_BIT, gl.GL_LINEAR)
        gl.glDisable(gl.GL_FRAMEBUFFER_SRGB)

    def _inside(self, clip: FloatArray, eye: FloatArray) -> BoolArray:
        """Instances whose box may be inside a view from `eye`; there is no far limit."""
        boxes = self._packed.boxes - eye  # N x 2 x 3
        x, y, z, w = clip
        inside = np.ones(len(boxes), bool)
        for plane in (w + x, w - x, w + y, w - y, w - z):
            corners = np.where(plane[:3] > 0, boxes[:, 1], boxes[:, 0])
            inside &= corners @ plane[:3] + plane[3] >= 0.0
        return inside

    def _shown(self, things: NDArray[np.uint32]) -> BoolArray:
        """Instances of which the label image shows a pixel, and all merged meshes."""
        shown = np.bincount(things.reshape(-1), minlength=len(self._scene.things)) > 0
        shown[0] = True
        found: BoolArray = shown[self._packed.instances["thing"]]
        return found

    def _draw_all(
        self,
        chosen: BoolArray,
        set_material: Callable[[Material], None],
        cull: bool = True,
    ) -> None:
        """Draws the chosen instances, one call for each run of equal states."""
        instances, commands, order = self._packed.chosen(chosen)
        gl.glBindBuffer(gl.GL_ARRAY_BUFFER, self._instances)
        gl.glBufferData(gl.GL_ARRAY_BUFFER, instances.nbytes, instances, gl.GL_STREAM_DRAW)
        gl.glBufferData(gl.GL_DRAW_INDIRECT_BUFFER, commands.nbytes, commands, gl.GL_STREAM_DRAW)
        start = 0
        for state, run in groupby(self._packed.states[index] for index in order.tolist()):
            count = sum(1 for _ in run)
            _set_faces(state, cull)
            set_material(self._scene.materials[state.material])
            offset = ctypes.c_void_p(start * COMMAND.itemsize)
            gl.glMultiDrawElementsIndirect(
                gl.GL_TRIANGLES, gl.GL_UNSIGNED_INT, offset, count, COMMAND.itemsize
            )
            start += count
        gl.glDisable(gl.GL_CULL_FACE)

    def _set_cut(self, program: gpu.Program, material: Material) -> None:
        """Sets what decides whether a fragment is there."""
        threshold = cut_threshold(material)
        program.set(threshold=threshold)
        if threshold > 0.0:
            gl.glActiveTexture(gl.GL_TEXTURE0 + _UNITS["colour_map"])
            gl.glBindTexture(gl.GL_TEXTURE_2D, self._textures.colour(material))

    def _set_look(self, program: gpu.Program, material: Material) -> None:
        """Sets everything that a fragment's colour follows from."""
        textures = material.textures
        coloured = "diffuse" in textures or "opacity" in textures
        rough = "normal" in textures or "roughness" in textures
        program.set(
            base_colour=(1.0, 1.0, 1.0) if "diffuse" in textures else material.diffuse,
            emissive=material.emissive,
            metallic=material.metallic,
            plain_roughness=material.roughness,
            is_foliage=int(cut_threshold(material) > 0.0),
            uses_vertex_colour=int(material.vertex_colour),
            uses_surface_map=int(rough),
        )
        maps = {
            "colour_map": self._textures.colour(material) if coloured else self._textures.white,
            "surface_map": self._textures.surface(material) if rough else self._textures.white,
        }
        for name, handle in maps.items():
            gl.glActiveTexture(gl.GL_TEXTURE0 + _UNITS[name])
            gl.glBindTexture(gl.GL_TEXTURE_2D, handle)

    def _set_light(self, program: gpu.Program) -> None:
        light = self._scene.light
        program.set(
            sun_direction=light.sun_direction,
            sun_light=light.sun,
            sky_light=light.sky,
            exposure=EXPOSURE,
        )


def cut_threshold(material: Material) -> float:
    """Least opacity at which a surface is there; 0 where it always is.

    Pixels have one label each, so nothing is see-through in part: an opacity texture without a
    threshold cuts at one half.
    """
    if "opacity" not in material.textures:
        return 0.0
    return material.opacity_threshold or 0.5


def _set_faces(state: State, cull: bool) -> None:
    gl.glFrontFace(gl.GL_CW if state.mirrored else gl.GL_CCW)
    (gl.glEnable if cull and not state.double_sided else gl.glDisable)(gl.GL_CULL_FACE)
