"""Boxes that a view touches, found block by block: most blocks lie outside of it, or within."""

import numpy as np

from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray

_SIDE = 32.0
"""Side in plan of the blocks, metres; smaller ones are more, and test fewer boxes one by one."""


class BoxBlocks:
    """Axis-aligned boxes in blocks of neighbours."""

    def __init__(self, boxes: FloatArray, groups: IntArray | None = None) -> None:
        """Sorts boxes into blocks; those much larger than a block are one by themselves.

        Args:
            boxes: N x 2 x 3, minimum and maximum corner, world.
            groups: N, 0, 1, ... for boxes that are a block together, since they move together; -1
                for others. `None` for none.
        """
        if groups is None:
            groups = np.full(len(boxes), -1)
        # A row of memory for each coordinate: four times as fast as a row for each box.
        low, high = np.ascontiguousarray(boxes.transpose(1, 2, 0))
        middles = (low + high) / 2.0
        halves = high - middles
        grouped, count = groups >= 0, int(groups.max(initial=-1)) + 1
        large = ~grouped & (halves[:2].max(axis=0) > _SIDE)
        own = np.where(large, count + np.arange(1, len(boxes) + 1), groups + 1)
        cells = np.where(own > 0, 0.0, np.floor(middles[:2] / _SIDE))
        self._order = np.lexsort((cells[0], cells[1], own))
        keys = np.stack((own, *cells))[:, self._order]
        starts = np.flatnonzero((np.diff(keys, prepend=np.nan) != 0.0).any(axis=0))
        self._starts, self._counts = starts, np.diff(starts, append=len(boxes))
        self._middles, self._halves = middles[:, self._order], halves[:, self._order]
        low = np.minimum.reduceat(low[:, self._order], starts, axis=1)
        high = np.maximum.reduceat(high[:, self._order], starts, axis=1)
        self._block_middles = (low + high) / 2.0
        self._block_halves = high - self._block_middles
        self._groups = np.flatnonzero((keys[0, starts] > 0) & (keys[0, starts] <= count))
        self.is_group: BoolArray = np.zeros(len(starts), bool)
        """B, True for the groups."""
        self.is_group[self._groups] = True
        self.outlines: FloatArray = np.stack((low, high)).transpose(2, 0, 1)
        """B x 2 x 3, minimum and maximum corner of each block, world."""

    def members(self, blocks: BoolArray) -> IntArray:
        """Numbers of the boxes of chosen blocks (B), block by block."""
        return self._order[self._rows(blocks)]

    def _rows(self, blocks: BoolArray) -> IntArray:
        starts, counts = self._starts[blocks], self._counts[blocks]
        ends = np.cumsum(counts)
        total = int(ends[-1]) if len(ends) else 0
        rows: IntArray = np.repeat(starts - (ends - counts), counts) + np.arange(total)
        return rows

    def move(self, outlines: FloatArray) -> None:
        """Gives each group another outline.

        Args:
            outlines: G x 2 x 3, minimum and maximum corner; one that is not a number is touched by
                nothing.
        """
        low, high = outlines.transpose(1, 2, 0)
        middles = (low + high) / 2.0
        self._block_middles[:, self._groups] = middles
        self._block_halves[:, self._groups] = high - middles
        self.outlines[self._groups] = outlines

    def touching(self, planes: FloatArray, point: FloatArray, reach: float = np.inf) -> BoolArray:
        """Boxes with a point on the inner side of each plane, within reach: N.

        A group is taken as a whole if its outline is touched.

        Args:
            planes: K x 4, normals and offsets of planes relative to `point`; inside is positive.
            point: 3, world.
            reach: Distance from `point`, metres.
        """
        touched, whole = self._blocks_touching(planes, point, reach)
        rows = self._rows(touched & ~whole)
        middles, halves = self._middles[:, rows] - point[:, None], self._halves[:, rows]
        depths, radii = _depths(planes, middles, halves)
        found = (depths >= -radii).all(axis=0)
        if np.isfinite(reach):
            found &= _gaps(middles, halves) <= reach**2
        result = np.zeros(len(self._order), bool)
        result[self.members(touched & whole)] = True
        result[self._order[rows[found]]] = True
        return result

    def blocks_touching(
        self, planes: FloatArray, point: FloatArray, reach: float = np.inf
    ) -> BoolArray:
        """Blocks with a point on the inner side of each plane, within reach, as `touching`: B."""
        return self._blocks_touching(planes, point, reach)[0]

    def _blocks_touching(
        self, planes: FloatArray, point: FloatArray, reach: float
    ) -> tuple[BoolArray, BoolArray]:
        """Blocks of which a part is inside, and those of which all boxes are taken."""
        middles = self._block_middles - point[:, None]
        depths, radii = _depths(planes, middles, self._block_halves)
        touched: BoolArray = np.logical_and.reduce(depths >= -radii)
        whole: BoolArray = np.logical_and.reduce(depths >= radii)
        if np.isfinite(reach):
            touched &= _gaps(middles, self._block_halves) <= reach**2
            whole &= _gaps(middles, -self._block_halves) <= reach**2
        return touched, whole | self.is_group


def within(boxes: FloatArray, point: FloatArray, reach: float) -> BoolArray:
    """Tells which boxes (N x 2 x 3, world) have a point within reach (metres) of a point (3)."""
    if not np.isfinite(reach):
        return np.ones(len(boxes), bool)
    low, high = np.ascontiguousarray(boxes.transpose(1, 2, 0))
    near: BoolArray = _gaps((low + high) / 2.0 - point[:, None], (high - low) / 2.0) <= reach**2
    return near


def _depths(
    planes: FloatArray, middles: FloatArray, halves: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Distances of boxes' middles (3 x N) behind planes, and how far boxes reach there: K x N."""
    normals = planes[:, :3]
    return normals @ middles + planes[:, 3:], np.abs(normals) @ halves


def _gaps(middles: FloatArray, halves: FloatArray) -> FloatArray:
    """Square of the distance of boxes from the origin; with negative sizes, of their far corner."""
    gaps = np.maximum(np.abs(middles) - halves, 0.0)
    squares: FloatArray = np.einsum("ij,ij->j", gaps, gaps)
    return squares
