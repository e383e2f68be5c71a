"""Draws the scene object and the depth of each pixel, nearest first, without what is hidden."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from OpenGL import GL as gl  # noqa: N811

from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray
from envgen_usd.render.cameras.camera_pose import Pose
from envgen_usd.render.cameras.camera_rig import Camera
from envgen_usd.render.drawing.partial_cover import PartialCover
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

    def labels(self) -> tuple[NDArray[np.uint32], NDArray[np.uint32], IntArray | None]:
        """The scene object, the instance from 1 (0: sky) and the body of each pixel, H x W."""
        both = gpu.read_pixels(self.target, 0, gl.GL_RG_INTEGER, gl.GL_UNSIGNED_INT)
        objects, instances = (np.ascontiguousarray(both[..., n]) for n in range(2))
        bodies = None if self._bodies is None else self._bodies.take(instances)
        return objects, instances, bodies


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

    def __init__(self, camera: Camera, draws: DrawList, looks: Looks, cover: PartialCover) -> None:
        """Creates textures of the camera's size.

        Args:
            camera: The camera.
            draws: The scene.
            looks: Its materials.
            cover: What covers pixels in part; it learns the depths of all else.
        """
        self._camera, self._draws = camera, draws
        self._outlines = CutProgram("mesh.vert", "labels.frag", "OUTLINES")
        self._cover = cover
        self._pixels = LabelTarget((camera.width, camera.height), draws, looks)

    @property
    def target(self) -> gpu.Target:
        """Labels and depth of the last frame."""
        return self._pixels.target

    def draw(self, pose: Pose, clip: FloatArray) -> LabelledPixels:
        """Draws near parts first, and of farther parts those that the nearer leave visible.

        Args:
            pose: Pose of the camera; the draw list already looks from there.
            clip: 4 x 4, from positions relative to the camera to clip space.
        """
        parts = _Waiting(self._camera, self._draws, pose, clip)
        self._pixels.clear()
        depth = None
        slender, gappy = self._cover.slender, self._cover.gappy
        partial = []
        for far in _BANDS:
            chosen = parts.take(far, depth)
            partial.append(chosen & (slender | gappy))
            chosen &= ~partial[-1]
            if chosen.any():
                self._pixels.draw(clip, chosen)
                depth = self._pixels.depth()
        self._cover.keep_whole(self._pixels.target)
        self._draw_bands(clip, [chosen & slender for chosen in partial])
        self._cover.keep_slender(self._pixels.target)
        self._draw_bands(clip, [chosen & gappy for chosen in partial])
        scene_objects, instances, bodies = self._pixels.labels()
        seen = np.zeros(len(self._draws.boxes) + 1, bool)
        seen[instances] = True
        return LabelledPixels(scene_objects, self._pixels.depth(), seen[1:], bodies)

    def _draw_bands(self, clip: FloatArray, bands: Sequence[BoolArray]) -> None:
        """Draws parts, the nearest band first."""
        for chosen in bands:
            if chosen.any():
                self._pixels.draw(clip, chosen)

    def outlined(self, pixels: LabelledPixels, clip: FloatArray) -> LabelledPixels:
        """Closes narrow gaps in crowns, in the labels and the depth.

        People who label photographs outline dense crowns, and leave out where the sky shines
        through few twigs. Near and far levels of a tree differ in their surfaces, but hide as much:
        so pixels decide.

        Args:
            pixels: What `draw` returned.
            clip: As of `draw`; the draw list looks from there again.
        """
        gappy = pixels.seen & self._cover.gappy
        if not gappy.any():
            return pixels
        self._pixels.draw(clip, gappy, self._outlines)
        objects, _, bodies = self._pixels.labels()
        depth = self._pixels.depth()
        gaps = depth != pixels.depth
        crowns = np.zeros(int(max(objects.max(), pixels.scene_objects.max())) + 1, np.uint8)
        crowns[objects[gaps]] = 1
        closed = gaps & (_around(crowns.take(pixels.scene_objects)) >= _DENSE * _WINDOW**2)
        if bodies is not None and pixels.bodies is not None:
            bodies = np.where(closed, bodies, pixels.bodies)
        return replace(
            pixels,
            scene_objects=np.where(closed, objects, pixels.scene_objects),
            depth=np.where(closed, depth, pixels.depth),
            bodies=bodies,
        )


def _around(marks: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Sums 0 and 1 (H x W) over the square around each pixel; borders go on outside."""
    reach = _WINDOW // 2
    padded = np.pad(marks, reach, mode="edge")
    height, width = marks.shape
    rows = sum((padded[n : n + height] for n in range(1, _WINDOW)), padded[:height])
    return sum((rows[:, n : n + width] for n in range(1, _WINDOW)), rows[:, :width])
