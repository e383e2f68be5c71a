"""Checks polygons and solids after ISO 19107, thousands of bodies at a time."""

from dataclasses import dataclass, replace

import numpy as np

from envgen_usd.geometry.collections import take
from envgen_usd.geometry.iso19107.bodies import cavity_faults
from envgen_usd.geometry.iso19107.crossings import crossing_pairs
from envgen_usd.geometry.iso19107.faults import Fault
from envgen_usd.geometry.iso19107.polygons import polygon_faults
from envgen_usd.geometry.iso19107.rings import ring_faults
from envgen_usd.geometry.iso19107.shells import shell_faults
from envgen_usd.geometry.planes import polygon_of_point
from envgen_usd.models.arrays import BoolArray, IntArray
from envgen_usd.models.polygons import Polygons


@dataclass(frozen=True)
class Bodies:
    """Polygons, some of which form the shells of solids.

    Attributes:
        polygons: P polygons of all bodies.
        shell: P, the shell that each helps to form, -1 for a polygon that stands for itself.
        solid: S, the solid that each shell bounds; the first shell of a solid is the outer one.
    """

    polygons: Polygons
    shell: IntArray
    solid: IntArray

    @staticmethod
    def of_solid(polygons: Polygons) -> "Bodies":
        """All polygons as the one shell of one solid."""
        return Bodies(polygons, np.zeros(len(polygons), dtype=np.int64), np.zeros(1, np.int64))

    @staticmethod
    def of_surfaces(polygons: Polygons) -> "Bodies":
        """Every polygon for itself."""
        return Bodies(
            polygons, np.full(len(polygons), -1, dtype=np.int64), np.empty(0, dtype=np.int64)
        )


def find_faults(bodies: Bodies) -> list[Fault]:
    """Returns what is wrong with polygons and solids, by increasing code.

    As in val3dity, what rests on an invalid part is not looked at: polygons only where their rings
    are valid, shells only where their polygons are, self-intersections of a shell and cavities of
    a solid only where their shells are.
    """
    every = np.arange(len(bodies.polygons))
    wild = ~np.isfinite(bodies.polygons.points).all(axis=1)
    lost = np.unique(polygon_of_point(bodies.polygons)[wild]).tolist()
    found = [Fault(901, polygon, detail="coordinates are not finite") for polygon in lost]
    sound = _without(every, lost)
    found += _at(sound, ring_faults(take(bodies.polygons, sound)))
    sound = _without(every, [fault.polygon for fault in found])
    found += _at(sound, polygon_faults(take(bodies.polygons, sound)))
    broken = bodies.shell[np.array([fault.polygon for fault in found], dtype=np.int64)]
    found = [replace(fault, shell=int(bodies.shell[fault.polygon])) for fault in found]
    found += _shells(bodies, broken)
    return sorted(found, key=lambda fault: fault.code)


def _without(every: IntArray, left_out: list[int]) -> IntArray:
    return np.setdiff1d(every, np.array(left_out, dtype=np.int64))


def _at(index: IntArray, faults: list[Fault]) -> list[Fault]:
    """Faults of chosen polygons as faults of all."""
    return [
        replace(fault, polygon=int(index[fault.polygon])) if fault.polygon >= 0 else fault
        for fault in faults
    ]


def _shells(bodies: Bodies, broken: IntArray) -> list[Fault]:
    chosen = np.flatnonzero((bodies.shell >= 0) & ~np.isin(bodies.shell, broken))
    if not len(chosen):
        return []
    polygons, shell = take(bodies.polygons, chosen), bodies.shell[chosen]
    inner = np.zeros(len(bodies.solid), dtype=bool)
    inner[1:] = bodies.solid[1:] == bodies.solid[:-1]
    found = shell_faults(polygons, shell, inner)
    whole = np.flatnonzero(~np.isin(shell, [fault.shell for fault in found]))
    found += _at(whole, _crossings(take(polygons, whole), shell[whole]))
    wrong = np.concatenate([broken, np.array([fault.shell for fault in found], dtype=np.int64)])
    return _at(chosen, found) + _cavities(bodies, inner, wrong)


def _crossings(polygons: Polygons, shell: IntArray) -> list[Fault]:
    pairs = crossing_pairs(polygons, shell)
    shells, first, counts = np.unique(shell[pairs[:, 0]], return_index=True, return_counts=True)
    return [
        Fault(306, int(pairs[f, 0]), int(s), f"{n} pairs of polygons, {_near(polygons, pairs[f])}")
        for s, f, n in zip(shells, first, counts, strict=True)
    ]


def _near(polygons: Polygons, pair: IntArray) -> str:
    """Where two polygons lie, in words."""
    starts = polygons.ring_offsets[polygons.polygon_offsets[pair]]
    places = (" ".join(f"{value:.3f}" for value in polygons.points[start]) for start in starts)
    return "the first from {} and from {}".format(*places)


def _cavities(bodies: Bodies, inner: BoolArray, wrong: IntArray) -> list[Fault]:
    """Faults between the shells of solids that have cavities."""
    found = []
    for solid in np.unique(bodies.solid[inner]):
        shells = np.flatnonzero(bodies.solid == solid)
        if np.isin(shells, wrong).any():
            continue
        exterior, *cavities = (
            take(bodies.polygons, np.flatnonzero(bodies.shell == shell)) for shell in shells
        )
        found += [Fault(code, -1, int(shells[0])) for code in cavity_faults(exterior, cavities)]
    return found
