"""Skeletons of trees: branches grow into a crown, and get the thickness of what they carry."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from envgen_usd.assets.polygon_mesh import Mesh, merge, normalised
from envgen_usd.assets.shapes.simple_solids import tube
from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray

_TIP = 0.011
"""Radius of a branch at its tip, metres; a larger value makes the whole tree thicker."""
_PIPES = 2.1
"""Exponent by which the radii of branches add up. Leonardo's rule, that cross-sections add up, is
2; measured trees have 1.8 to 2.3 (C. Eloy, "Leonardo's rule, self-similarity, and wind-induced
stresses in trees", 2011)."""


@dataclass(frozen=True)
class Growth:
    """How branches grow; lengths in metres.

    Attributes:
        step: Length of a segment.
        sight: Distance from which free space attracts a branch.
        kill: Distance at which a branch has taken a space.
        rise: Pull upwards (below 0 downwards) against the pull of free space, 1.
        steps: Largest number of steps.
    """

    step: float = 0.38
    sight: float = 2.6
    kill: float = 0.55
    rise: float = 0.15
    steps: int = 60


@dataclass(frozen=True)
class Skeleton:
    """A tree of N nodes, each after its parent; node 0 is the foot.

    Attributes:
        points: N x 3, metres.
        parents: N; that of node 0 is -1.
        radii: N, metres.
    """

    points: FloatArray
    parents: IntArray
    radii: FloatArray

    def directions(self) -> FloatArray:
        """N x 3, unit vectors from the parents."""
        above = np.maximum(self.parents, 0)
        return normalised(self.points - self.points[above])

    def tips(self) -> BoolArray:
        """N, True for nodes without children."""
        tips = np.ones(len(self.points), bool)
        tips[self.parents[1:]] = False
        return tips


def grown(
    stem: FloatArray, space: FloatArray, growth: Growth, rng: np.random.Generator
) -> Skeleton:
    """Grows branches from a stem into free space.

    Space colonization: A. Runions, B. Lane, P. Prusinkiewicz, "Modeling trees with a space
    colonization algorithm" (2007).

    Args:
        stem: S x 3, the stem from the foot to its top, metres.
        space: A x 3, points of free space that branches grow towards.
        growth: How they grow.
        rng: Random generator.
    """
    points, parents = stem.copy(), np.arange(-1, len(stem) - 1)
    free = space
    for _ in range(growth.steps):
        away, nearest = (np.asarray(each) for each in cKDTree(points).query(free))
        pulling = away < growth.sight
        if not pulling.any():
            break
        pull = np.zeros_like(points)
        np.add.at(pull, nearest[pulling], normalised(free[pulling] - points[nearest[pulling]]))
        growing = np.flatnonzero((pull != 0.0).any(axis=1))
        heading = normalised(pull[growing]) + np.array([0.0, 0.0, growth.rise])
        heading += rng.normal(0, 0.10, heading.shape)
        fresh = points[growing] + growth.step * normalised(heading)
        apart = np.asarray(cKDTree(points).query(fresh)[0]) > 0.45 * growth.step
        points = np.concatenate([points, fresh[apart]])
        parents = np.concatenate([parents, growing[apart]])
        taken = np.asarray(cKDTree(points).query(free)[0]) < growth.kill
        if not apart.any() and not taken.any():
            break
        free = free[~taken]
        if not len(free):
            break
    return Skeleton(points, parents, _radii(parents))


def _radii(parents: IntArray) -> FloatArray:
    """Radii by the sum of what each node carries; children come after their parents."""
    load = np.zeros(len(parents))
    for node in range(len(parents) - 1, 0, -1):
        load[node] = max(load[node], _TIP**_PIPES)
        load[parents[node]] += load[node]
    return np.asarray(np.maximum(load, _TIP**_PIPES) ** (1.0 / _PIPES))


def branches(skeleton: Skeleton) -> list[IntArray]:
    """Lines of nodes: each follows the thickest child, from the node that it leaves to a tip."""
    children: list[list[int]] = [[] for _ in skeleton.parents]
    for node, parent in enumerate(skeleton.parents.tolist()):
        if parent >= 0:
            children[parent].append(node)
    lines, starts = [], [(0, -1)]
    while starts:
        node, parent = starts.pop()
        line = [parent, node] if parent >= 0 else [node]
        while children[node]:
            order = sorted(children[node], key=lambda child: -skeleton.radii[child])
            starts += [(child, node) for child in order[1:]]
            node = order[0]
            line.append(node)
        lines.append(np.array(line))
    return lines


def wood(skeleton: Skeleton, sides: int) -> Mesh:
    """Surfaces of all branches; thin ones have three sides, and fewer joints.

    Args:
        skeleton: The tree.
        sides: Sides of the stem.
    """
    pieces = []
    for line in branches(skeleton):
        thin = skeleton.radii[line[-2 if len(line) > 2 else -1]] < 0.03 and line[0] != 0
        kept = _thinned(line, 3) if thin else _thinned(line, 2)
        radii = skeleton.radii[kept].copy()
        if line[0] != 0:
            # A branch starts inside of what it leaves, with a thickness of its own.
            radii[0] = radii[1]
        else:
            radii[0] *= 1.35
        count = sides if line[0] == 0 else (3 if radii[0] < 0.035 else 5)
        pieces.append(tube(skeleton.points[kept], radii, count, caps=False))
    return merge(pieces)


def _thinned(line: IntArray, every: int) -> IntArray:
    """Every so many nodes of a line, with both ends."""
    inner = line[1:-1]
    return np.concatenate([line[:1], inner[every - 1 :: every], line[-1:]])
