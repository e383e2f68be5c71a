"""Draws the instances of a packed scene that a view needs."""

import ctypes
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from OpenGL import GL as gl  # noqa: N811

from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray
from envgen_usd.render.opengl import gpu
from envgen_usd.render.opengl.box_blocks import BoxBlocks, within
from envgen_usd.render.opengl.moving_placements import MovingPlacements
from envgen_usd.render.opengl.scene_tiles import Packed
from envgen_usd.render.packed_layout import COMMAND, INSTANCE, VERTEX
from envgen_usd.render.render_scene import Moment

_FAR_PIXELS = 110.0
"""Size in pixels below which an object is drawn by its far level; a larger value draws fewer
triangles, and changes the level nearer to the camera."""


_THINNING = 4
"""One in so many leaves is drawn where whole cards stand for the leaves on them."""

_CHANGED = ("instances", "boxes", "origins", "places")
"""Arrays of a packed scene that a moment changes."""


class DrawList:
    """A packed scene on the GPU.

    Attributes:
        units: Texture units by the names of their uniforms.
        still: N, True for instances that never move.
    """

    def __init__(self, packed: Packed, origins_unit: int, leaves: BoolArray | None = None) -> None:
        """Uploads all arrays; the shaders read the tiles' origins from the unit in `units`.

        Args:
            packed: The scene.
            origins_unit: Texture unit of the tiles' origins.
            leaves: By material, True for those that `draw` can thin; `None` for none.
        """
        self.still: BoolArray = packed.movers < 0
        self._motion: _Motion | None = None
        groups = None
        if (moving := packed.moving) is not None:
            own = {name: getattr(packed, name).copy() for name in _CHANGED}
            packed = replace(packed, **own)  # others draw the same packed scene
            self._motion = _Motion(packed, moving)
            groups = np.where(self.still, -1, moving.groups[packed.movers])
        self._packed = packed
        self._blocks = BoxBlocks(packed.boxes, groups)
        self._states = np.array(packed.states, np.int64).reshape(-1, 3).T  # 3 x D
        self._far: BoolArray = packed.sizes <= 0.0
        self.units = {"tile_origins": origins_unit}
        leaves = np.zeros(0, bool) if leaves is None else leaves
        indices, self._thinned = _thinned(packed, np.isin(self._states[2], np.flatnonzero(leaves)))
        self._vertices = int(gl.glGenVertexArrays(1))
        gl.glBindVertexArray(self._vertices)
        gpu.buffer(gl.GL_ARRAY_BUFFER, packed.vertices)
        gpu.vertex_attribute(0, VERTEX, "position", gl.GL_FLOAT, False)
        gpu.vertex_attribute(1, VERTEX, "normal", gl.GL_SHORT, True)
        gpu.vertex_attribute(2, VERTEX, "uv", gl.GL_FLOAT, False)
        gpu.vertex_attribute(3, VERTEX, "colour", gl.GL_UNSIGNED_BYTE, True)
        gpu.vertex_attribute(4, VERTEX, "scene_object", gl.GL_UNSIGNED_INT, False)
        self._instances = gpu.buffer(gl.GL_ARRAY_BUFFER, packed.instances)
        gpu.vertex_attribute(5, INSTANCE, "rows", gl.GL_FLOAT, False, 1)
        gpu.vertex_attribute(8, INSTANCE, "scene_object", gl.GL_UNSIGNED_INT, False, 1)
        gpu.vertex_attribute(9, INSTANCE, "tile", gl.GL_UNSIGNED_INT, False, 1)
        gpu.vertex_attribute(10, INSTANCE, "number", gl.GL_UNSIGNED_INT, False, 1)
        gpu.buffer(gl.GL_ELEMENT_ARRAY_BUFFER, indices)
        self._commands = gpu.buffer(gl.GL_DRAW_INDIRECT_BUFFER, packed.commands)
        self._origins = gpu.buffer(gl.GL_TEXTURE_BUFFER, self._origins_from(np.zeros(3)))
        self._origins_texture = int(gl.glGenTextures(1))
        self._bind_origins()
        gl.glTexBuffer(gl.GL_TEXTURE_BUFFER, gl.GL_RGBA32F, self._origins)

    @property
    def bodies(self) -> IntArray | None:
        """Moving body of each instance, N; -1 for what stands still. `None` if nothing moves."""
        moving, movers = self._packed.moving, self._packed.movers
        return None if moving is None else np.where(movers < 0, -1, moving.bodies[movers])

    def place(self, moment: Moment | None) -> None:
        """Moves what moves to a moment; `None` is the start of the stage."""
        if self._motion and (outlines := self._motion.to(moment)) is not None:
            self._blocks.move(outlines)

    @property
    def boxes(self) -> FloatArray:
        """N x 2 x 3, minimum and maximum corner of each instance, world.

        Of what moves, those hold that `inside` or `of_blocks` found since the last `place`.
        """
        return self._packed.boxes

    def look_from(self, eye: FloatArray) -> None:
        """Makes positions relative to a point (3, world): subtracted in double precision."""
        self._bind_origins()
        origins = self._origins_from(eye)
        gl.glBindBuffer(gl.GL_TEXTURE_BUFFER, self._origins)
        gl.glBufferSubData(gl.GL_TEXTURE_BUFFER, 0, origins.nbytes, origins)

    def inside(self, clip: FloatArray, eye: FloatArray) -> BoolArray:
        """Instances within reach whose bounding box intersects a frustum without a far plane.

        Args:
            clip: 4 x 4, from positions relative to `eye` to clip space.
            eye: 3, world, metres.
        """
        found = self._blocks.touching(_planes(clip), eye, self._packed.reach)
        if self._motion:
            self._motion.settle(np.flatnonzero(found & ~self.still))
        return found

    def blocks_inside(self, clip: FloatArray, eye: FloatArray) -> BoolArray:
        """Blocks within reach whose outline intersects a frustum, as `inside`: B."""
        return self._blocks.blocks_touching(_planes(clip), eye, self._packed.reach)

    def moving_inside(self, clip: FloatArray, eye: FloatArray) -> BoolArray:
        """Instances that move, of bodies whose outline intersects a frustum, as `inside`: N."""
        found = np.zeros(len(self.still), bool)
        found[self.of_blocks(self.blocks_inside(clip, eye) & self._blocks.is_group)] = True
        return found

    def within_reach(self, boxes: FloatArray, eye: FloatArray) -> BoolArray:
        """Tells which boxes (N x 2 x 3, world) have a point within reach of `eye` (3, world)."""
        return within(boxes, eye, self._packed.reach)

    @property
    def blocks(self) -> FloatArray:
        """B x 2 x 3, minimum and maximum corner of blocks of neighbouring instances, world."""
        return self._blocks.outlines

    def of_blocks(self, blocks: BoolArray) -> IntArray:
        """Numbers of the instances of chosen blocks (B), block by block."""
        numbers = self._blocks.members(blocks)
        if self._motion:
            self._motion.settle(numbers[~self.still[numbers]])
        return numbers

    def broad(self, area: float) -> BoolArray:
        """Instances that cover an area in plan at least, square metres: N."""
        broad: BoolArray = self._packed.footprints >= area
        return broad

    @property
    def materials(self) -> IntArray:
        """Material of each instance, N."""
        return np.repeat(self._states[2], self._packed.commands["instances"])

    def of_objects(self, chosen: BoolArray) -> BoolArray:
        """Instances that show chosen scene objects alone: N.

        Args:
            chosen: True for the chosen ones of all scene objects.
        """
        packed, commands = self._packed, self._packed.commands
        owners = packed.instances["scene_object"]
        if not len(commands):
            return np.zeros(len(owners), bool)
        # Corners of merged meshes know their object, which is the instance's elsewhere.
        order = np.argsort(commands["first_index"])
        firsts = commands["first_index"][order].astype(np.int64)
        ends = firsts + commands["count"][order]
        bases = np.repeat(commands["base_vertex"][order], np.diff(firsts, append=ends[-1]))
        corners = packed.indices[firsts[0] : ends[-1]].astype(np.int64) + bases
        shown = chosen[packed.vertices["scene_object"][corners]]
        alone = np.zeros(len(commands), bool)
        alone[order] = np.logical_and.reduceat(shown, firsts - firsts[0])
        merged = np.repeat(alone, commands["instances"])
        found: BoolArray = np.where(np.isfinite(packed.footprints), chosen[owners], merged)
        return found

    def detailed(self, eye: FloatArray, focal: float, numbers: IntArray | None = None) -> BoolArray:
        """Tells which instances have the level of detail that a camera needs.

        Args:
            eye: 3, world, metres.
            focal: Focal length, pixels; 0 chooses the far level everywhere.
            numbers: Numbers of the instances in question; `None` for all.
        """
        if focal == 0.0:
            return self._far if numbers is None else self._far[numbers]
        sizes = self._packed.sizes if numbers is None else self._packed.sizes[numbers]
        levelled = np.flatnonzero(sizes)
        places = self._packed.places.take(
            levelled if numbers is None else numbers[levelled], axis=0
        )
        chosen = np.ones(len(sizes), bool)
        away = places - eye
        sizes = sizes[levelled]
        near = (focal * sizes) ** 2 > _FAR_PIXELS**2 * np.einsum("ni,ni->n", away, away)
        chosen[levelled] = near == (sizes > 0.0)
        return chosen

    def draw(
        self,
        chosen: BoolArray,
        set_material: Callable[[int], None],
        *,
        alike: IntArray | None = None,
        cull: bool = True,
        thin: bool = False,
    ) -> None:
        """Draws the chosen instances, with a call for each run of equal states.

        Args:
            chosen: N, indices of the instances.
            set_material: Called with the material's index before each draw of that material.
            alike: By material, the one that stands for it; `None` if all differ.
            cull: False also draws back faces of single-sided meshes.
            thin: True draws every fourth leaf of detailed crowns.
        """
        instances, commands, order = self._packed.chosen(chosen)
        if thin:
            commands["first_index"], commands["count"] = self._thinned[:, order]
        # The context may hold several scenes.
        gl.glBindVertexArray(self._vertices)
        gl.glBindBuffer(gl.GL_DRAW_INDIRECT_BUFFER, self._commands)
        gl.glBindBuffer(gl.GL_ARRAY_BUFFER, self._instances)
        gl.glBufferData(gl.GL_ARRAY_BUFFER, instances.nbytes, instances, gl.GL_STREAM_DRAW)
        gl.glBufferData(gl.GL_DRAW_INDIRECT_BUFFER, commands.nbytes, commands, gl.GL_STREAM_DRAW)
        double_sided, mirrored, materials = self._states[:, order]
        if alike is not None:
            materials = alike[materials]
        states = np.stack((double_sided | (not cull), mirrored, materials))
        changes = np.flatnonzero((states[:, 1:] != states[:, :-1]).any(axis=0)) + 1
        starts = [0, *changes.tolist()] if len(order) else []
        faces: tuple[int, int] | None = None
        for start, end in pairwise([*starts, len(order)]):
            double_sided, mirrored, material = states[:, start].tolist()
            if faces != (double_sided, mirrored):
                faces = double_sided, mirrored
                _set_faces(*faces)
            set_material(material)
            offset = ctypes.c_void_p(start * COMMAND.itemsize)
            gl.glMultiDrawElementsIndirect(
                gl.GL_TRIANGLES, gl.GL_UNSIGNED_INT, offset, end - start, COMMAND.itemsize
            )
        gl.glDisable(gl.GL_CULL_FACE)

    def _bind_origins(self) -> None:
        gl.glActiveTexture(gl.GL_TEXTURE0 + self.units["tile_origins"])
        gl.glBindTexture(gl.GL_TEXTURE_BUFFER, self._origins_texture)

    def _origins_from(self, eye: FloatArray) -> gpu.Matrix:
        origins = np.zeros((len(self._packed.origins), 4), np.float32)
        origins[:, :3] = self._packed.origins - eye
        return origins


class _Motion:
    """Moves the instances of a packed scene: groups at once, parts when they are looked at."""

    def __init__(self, packed: Packed, moving: MovingPlacements) -> None:
        """Takes a packed scene whose arrays it may change."""
        self._packed, self._moving = packed, moving
        self._moment: Moment | None = None
        moved = np.flatnonzero(packed.movers >= 0)
        self._tiles = np.empty(len(moving.group_bodies), np.int64)
        self._tiles[moving.groups[packed.movers[moved]]] = packed.instances["tile"][moved]
        self._settled = np.ones(len(packed.movers), bool)

    def to(self, moment: Moment | None) -> FloatArray | None:
        """Outlines of the groups at a moment, or `None` if they are there; `None` is the start."""
        moment = moment or self._moving.parts.start
        if moment is self._moment:
            return None
        self._moment, self._settled = moment, self._packed.movers < 0
        outlines = self._moving.outlines(moment)
        self._packed.origins[self._tiles] = self._moving.origins(outlines)
        return outlines

    def settle(self, numbers: IntArray) -> None:
        """Moves instances (their numbers) to where they are at the moment."""
        numbers = numbers[~self._settled[numbers]]
        if self._moment is None or not len(numbers):
            return
        self._settled[numbers] = True
        packed = self._packed
        placed = self._moving.at(self._moment, packed.movers[numbers])
        rows, tiles = packed.instances["rows"], packed.instances["tile"][numbers]
        rows[numbers, :, :3] = placed.axes
        rows[numbers, :, 3] = placed.shifts - packed.origins[tiles]
        packed.boxes[numbers], packed.places[numbers] = placed.boxes, placed.places


def _thinned(packed: Packed, leaves: BoolArray) -> tuple[NDArray[np.uint32], IntArray]:
    """Every fourth pair of triangles, which is a leaf or a card of twigs, of detailed meshes.

    Args:
        packed: The scene.
        leaves: D, True for the commands that draw leaves.

    Returns:
        The indices of the scene and of the thinned meshes, and the first index and the count of
        each command, 2 x D.
    """
    commands = packed.commands
    ranges = np.stack((commands["first_index"], commands["count"])).astype(np.int64)
    detailed = packed.sizes[commands["base_instance"]] > 0.0 if len(commands) else leaves
    known: dict[tuple[int, int], tuple[int, int]] = {}
    parts, end = [packed.indices], len(packed.indices)
    for command in np.flatnonzero(leaves & detailed).tolist():
        first, count = ranges[:, command].tolist()
        if (first, count) not in known:
            pairs = np.arange(count) // 6
            part = packed.indices[first : first + count][pairs % _THINNING == 0]
            known[first, count] = end, len(part)
            parts.append(part)
            end += len(part)
        ranges[:, command] = known[first, count]
    return np.concatenate(parts), ranges


def _planes(clip: FloatArray) -> FloatArray:
    """Sides of a frustum without a far plane, 5 x 4; inside is positive."""
    x, y, z, w = clip
    return np.stack((w + x, w - x, w + y, w - y, w - z))


def _set_faces(double_sided: int, mirrored: int) -> None:
    gl.glFrontFace(gl.GL_CW if mirrored else gl.GL_CCW)
    (gl.glDisable if double_sided else gl.glEnable)(gl.GL_CULL_FACE)
