"""Draws the scene object and the depth of each pixel, nearest first, without what is hidden."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from OpenGL import GL as gl  # noqa: N811
from scipy.ndimage import uniform_filter

from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray
from envgen_usd.render.cameras.camera_pose import Pose
from envgen_usd.render.cameras.camera_rig import Camera
from envgen_usd.render.opengl import gpu
from envgen_usd.render.opengl.depth_pyramid import DepthPyramid, Rectangles, camera_rectangles
from envgen_usd.render.opengl.draw_list import DrawList
from envgen_usd.render.opengl.shader_looks import CutProgram, Looks
from envgen_usd.render.render_scene import Floats

_BANDS = (30.0, 75.0, 150.0, 300.0, np.inf)
"""Depths in metres up to which parts are drawn before the next are tested; more bands read more."""

_WINDOW = 5
"""Side of the square around a gap in a crown that decides whether people count it to the crown."""
_DENSE = 0.5
"""Least share of that square that shows crowns, see docs/render.md; larger: fewer gaps close."""
_BLOCK = 4
"""Columns of the narrowest blocks of depths; a larger value tests faster and draws more parts."""


@dataclass(frozen=True)
class LabelledPixels:
    """What a camera sees.

    Attributes:
        scene_objects: H x W, index of the scene object at each pixel's centre; 0 is the sky.
        depth: H x W, metres along the optical axis; 0 in the sky.
        seen: N, instances at a pixel's centre.
        bodies: H x W, number of the moving body at each pixel's centre, -1 for what stands still;
            `None` if nothing moves.
    """

    scene_objects: NDArray[np.uint32]
    depth: Floats
    seen: BoolArray
    bodies: IntArray | None = None


class LabelTarget:
    """A render target for labels and depth. Its depth buffer serves later passes of the frame."""

    def __init__(
        self, size: tuple[int, int], draws: DrawList, looks: Looks, *, with_planes: bool = False
    ) -> None:
        """Creates textures: scene object and instance, depth in metres.

        Args:
            size: Width and height, pixels.
            draws: The scene.
            looks: Its materials.
            with_planes: The second texture holds the inverse depth and its change by a pixel in x
                and y (upwards), instead of the depth.
        """
        self._draws, self._looks = draws, looks
        bodies = draws.bodies
        self._bodies = None if bodies is None else np.concatenate(([-1], bodies))
        self._programs = CutProgram("mesh.vert", "labels.frag", *["PLANES"] * with_planes)
        kind = gl.GL_RGBA32F if with_planes else gl.GL_R32F
        self.target = gpu.render_target(size, (gl.GL_RG32UI, kind))

    def clear(self) -> None:
        """Fills the target with sky."""
        self.target.bind()
        gl.glClearBufferuiv(gl.GL_COLOR, 0, np.zeros(4, np.uint32))
        gl.glClearBufferfv(gl.GL_COLOR, 1, np.zeros(4, np.float32))
        gl.glClearBufferfv(gl.GL_DEPTH, 0, np.zeros(1, np.float32))

    def draw(self, clip: FloatArray, chosen: BoolArray, programs: CutProgram | None = None) -> None:
        """Draws instances; `clip` is 4 x 4, from positions relative to the camera."""
        programs = programs or self._programs
        self.target.bind()
        gl.glEnable(gl.GL_DEPTH_TEST)
        gl.glDepthFunc(gl.GL_GREATER)
        programs.set(clip=clip, **self._looks.units, **self._draws.units)
        self._draws.draw(
            chosen, lambda m: self._looks.set_cut(programs, m), alike=self._looks.alike
        )

    def depth(self) -> Floats:
        """Depth of each pixel, H x W."""
        metres: Floats = gpu.read_pixels(self.target, 1, gl.GL_RED, gl.GL_FLOAT)
        return metres

    def labels(self) -> tuple[NDArray[np.uint32], BoolArray, IntArray | None]:
        """The scene object of each pixel (H x W), which instances they show (N), and bodies."""
        both = gpu.read_pixels(self.target, 0, gl.GL_RG_INTEGER, gl.GL_UNSIGNED_INT)
        seen = np.zeros(len(self._draws.boxes) + 1, bool)
        seen[both[..., 1]] = True
        bodies = None if self._bodies is None else self._bodies[both[..., 1]]
        return np.ascontiguousarray(both[..., 0]), seen[1:], bodies


class Openness:
    """The share of each pixel that surfaces with gaps leave open: leaves, twigs, wire mesh."""

    def __init__(self, size: tuple[int, int], draws: DrawList, looks: Looks) -> None:
        """Creates a texture of a width and a height in pixels."""
        self._draws, self._looks = draws, looks
        self._programs = CutProgram("mesh.vert", "openness.frag")
        self.target = gpu.render_target(size, (gl.GL_R16F,))

    def take_depth(self, target: gpu.Target) -> None:
        """Copies the depth of the surfaces without gaps."""
        kind = gl.GL_TEXTURE_2D
        start, size = (0, 0, 0, 0), (*target.size, 1)
        gl.glCopyImageSubData(target.depth, kind, *start, self.target.depth, kind, *start, *size)

    def draw(self, clip: FloatArray, chosen: BoolArray) -> None:
        """Draws instances that have gaps; `clip` is 4 x 4, from positions beside the camera."""
        self.target.bind()
        gl.glClearBufferfv(gl.GL_COLOR, 0, np.ones(4, np.float32))
        if not chosen.any():
            return
        gl.glEnable(gl.GL_DEPTH_TEST)
        gl.glDepthFunc(gl.GL_GREATER)
        gl.glDepthMask(False)
        gl.glEnable(gl.GL_BLEND)
        gl.glBlendFunc(gl.GL_ZERO, gl.GL_ONE_MINUS_SRC_COLOR)
        self._programs.set(clip=clip, **self._looks.units, **self._draws.units)
        self._draws.draw(chosen, lambda m: self._looks.set_cut(self._programs, m))
        gl.glDisable(gl.GL_BLEND)
        gl.glDepthMask(True)


class _Waiting:
    """The parts in a view that are not drawn yet; blocks of neighbours are hidden as a whole."""

    def __init__(self, camera: Camera, draws: DrawList, pose: Pose, clip: FloatArray) -> None:
        """Takes all parts in the view, whose clip matrix leads from the camera to clip space."""
        self._camera, self._draws, self._pose = camera, draws, pose.matrix
        inside = np.flatnonzero(draws.blocks_inside(clip, self._eye))
        blocks = camera_rectangles(draws.blocks[inside], camera, pose.matrix)
        held = blocks.hold_pixels
        self._closed, self._blocks = inside[held], blocks.of(held)
        self._numbers: IntArray = np.empty(0, np.int64)
        self._boxes = self._blocks.of(np.zeros(len(self._closed), bool))

    def take(self, far: float, depth: Floats | None) -> BoolArray:
        """Takes out the parts that begin before a depth.

        Args:
            far: Depth, metres.
            depth: What is drawn, H x W; `None` before anything is.

        Returns:
            N, True for those of them that what is drawn leaves visible.
        """
        pyramid = None
        if depth is not None:
            pyramid = DepthPyramid(np.where(depth > 0.0, depth, np.float32(np.inf)), _BLOCK)
        self._open(far, pyramid)
        near = self._boxes.nearest < far
        numbers, boxes = self._numbers[near], self._boxes.of(near)
        self._numbers, self._boxes = self._numbers[~near], self._boxes.of(~near)
        if pyramid is not None:
            numbers = numbers[pyramid.leaves_visible(boxes)]
        chosen = np.zeros(len(self._draws.boxes), bool)
        chosen[numbers] = True
        return chosen

    @property
    def _eye(self) -> FloatArray:
        return self._pose[:3, 3]

    def _open(self, far: float, pyramid: DepthPyramid | None) -> None:
        """Adds the parts of the blocks that begin before a depth, if they are visible."""
        begun = self._blocks.nearest < far
        blocks, reached = self._blocks.of(begun), self._closed[begun]
        self._blocks, self._closed = self._blocks.of(~begun), self._closed[~begun]
        if pyramid is not None:
            reached = reached[pyramid.leaves_visible(blocks)]
        opened = np.zeros(len(self._draws.blocks), bool)
        opened[reached] = True
        numbers = self._draws.of_blocks(opened)
        focal = max(self._camera.fx, self._camera.fy)
        numbers = numbers[self._draws.detailed(self._eye, focal, numbers)]
        corners = self._draws.boxes.take(numbers, axis=0)
        boxes = camera_rectangles(corners, self._camera, self._pose)
        shown = boxes.hold_pixels & self._draws.within_reach(corners, self._eye)
        numbers, boxes = numbers[shown], boxes.of(shown)
        self._numbers = np.concatenate((self._numbers, numbers))
        self._boxes = Rectangles(
            np.concatenate((self._boxes.low, boxes.low)),
            np.concatenate((self._boxes.high, boxes.high)),
            np.concatenate((self._boxes.nearest, boxes.nearest)),
        )


class LabelPass:
    """Labels and depth at the centres of a camera's pixels."""

    def __init__(self, camera: Camera, draws: DrawList, looks: Looks) -> None:
        """Creates textures of the camera's size."""
        self._camera, self._draws = camera, draws
        self._outlines = CutProgram("mesh.vert", "labels.frag", "OUTLINES")
        self._gappy = looks.cut_out[draws.materials]
        size = camera.width, camera.height
        self._pixels = LabelTarget(size, draws, looks)
        self._openness = Openness(size, draws, looks)

    @property
    def target(self) -> gpu.Target:
        """Labels and depth of the last frame."""
        return self._pixels.target

    @property
    def openness(self) -> int:
        """Texture: the share of each pixel that surfaces with gaps leave open, by `draw_open`."""
        return self._openness.target.colours[0]

    def draw(self, pose: Pose, clip: FloatArray) -> LabelledPixels:
        """Draws near parts first, and of farther parts those that the nearer leave visible.

        Parts with gaps come after all others, whose depth `draw_open` needs alone.

        Args:
            pose: Pose of the camera; the draw list already looks from there.
            clip: 4 x 4, from positions relative to the camera to clip space.
        """
        parts = _Waiting(self._camera, self._draws, pose, clip)
        self._pixels.clear()
        depth = None
        gappy = []
        for far in _BANDS:
            chosen = parts.take(far, depth)
            gappy.append(chosen & self._gappy)
            chosen &= ~self._gappy
            if chosen.any():
                self._pixels.draw(clip, chosen)
                depth = self._pixels.depth()
        self._openness.take_depth(self._pixels.target)
        for chosen in gappy:
            if chosen.any():
                self._pixels.draw(clip, chosen)
        scene_objects, seen, bodies = self._pixels.labels()
        return LabelledPixels(scene_objects, self._pixels.depth(), seen, bodies)

    def draw_open(self, pixels: LabelledPixels, clip: FloatArray) -> None:
        """Finds what surfaces with gaps leave open of each pixel, with `clip` as of `draw`."""
        self._openness.draw(clip, pixels.seen & self._gappy)

    def outlined(self, pixels: LabelledPixels, clip: FloatArray) -> LabelledPixels:
        """Closes narrow gaps in crowns, in the labels and the depth.

        People who label photographs outline dense crowns, and leave out where the sky shines
        through few twigs. Near and far levels of a tree differ in their surfaces, but hide as much:
        so pixels decide.

        Args:
            pixels: What `draw` returned.
            clip: As of `draw`; the draw list looks from there again.
        """
        gappy = pixels.seen & self._gappy
        if not gappy.any():
            return pixels
        self._pixels.draw(clip, gappy, self._outlines)
        objects, _, bodies = self._pixels.labels()
        depth = self._pixels.depth()
        gaps = depth != pixels.depth
        crowns = np.zeros(int(max(objects.max(), pixels.scene_objects.max())) + 1, bool)
        crowns[objects[gaps]] = True
        shown = crowns[pixels.scene_objects].astype(np.float32)
        closed = gaps & (uniform_filter(shown, _WINDOW, mode="nearest") >= _DENSE)
        if bodies is not None and pixels.bodies is not None:
            bodies = np.where(closed, bodies, pixels.bodies)
        return replace(
            pixels,
            scene_objects=np.where(closed, objects, pixels.scene_objects),
            depth=np.where(closed, depth, pixels.depth),
            bodies=bodies,
        )
