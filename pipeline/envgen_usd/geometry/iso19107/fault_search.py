"""Checks polygons and solids after ISO 19107, thousands of bodies at a time."""

from dataclasses import dataclass, replace

import numpy as np

from envgen_usd.geometry.flat_arrays import take
from envgen_usd.geometry.iso19107.body_faults import cavity_faults
from envgen_usd.geometry.iso19107.fault_codes import Fault, check_order
from envgen_usd.geometry.iso19107.polygon_crossings import crossing_pairs
from envgen_usd.geometry.iso19107.polygon_faults import polygon_faults
from envgen_usd.geometry.iso19107.ring_faults import ring_faults
from envgen_usd.geometry.iso19107.shell_faults import shell_faults
from envgen_usd.geometry.polygon_planes import polygon_of_point
from envgen_usd.models.array_types import BoolArray, IntArray
from envgen_usd.models.polygon_arrays import Polygons

FARTHEST = 1e9
"""Largest coordinate of a polygon, metres, many times the Earth; squares of larger ones overflow.

A larger value tolerates larger coordinates.
"""


@dataclass(frozen=True)
class Bodies:
    """Polygons, some of which form the shells of solids.

    Attributes:
        polygons: P polygons of all bodies.
        shell: P, shell of each polygon; -1 for a polygon without a shell.
        solid: S, solid of each shell; the first shell of a solid is its exterior. A composite
            surface is a shell of the solid -1; it may be open.
    """

    polygons: Polygons
    shell: IntArray
    solid: IntArray

    @staticmethod
    def of_solid(polygons: Polygons) -> "Bodies":
        """Creates a single solid with a single shell of all polygons."""
        return Bodies(polygons, np.zeros(len(polygons), dtype=np.int64), np.zeros(1, np.int64))


def find_faults(bodies: Bodies) -> list[Fault]:
    """Returns the faults of polygons and solids, in the order of val3dity's checks.

    As in val3dity, parts that depend on an invalid part are not checked. Polygons require valid
    rings, and shells require valid polygons. Self-intersections and cavities require valid shells.
    """
    every = np.arange(len(bodies.polygons))
    wild = ~(np.abs(bodies.polygons.points) <= FARTHEST).all(axis=1)
    lost = np.unique(polygon_of_point(bodies.polygons)[wild]).tolist()
    detail = f"coordinates are not finite or beyond {FARTHEST:g} m"
    faults = [Fault(901, polygon, detail=detail) for polygon in lost]
    sound = _without(every, lost)
    faults += _at(sound, ring_faults(take(bodies.polygons, sound)))
    sound = _without(every, [fault.polygon for fault in faults])
    faults += _at(sound, polygon_faults(take(bodies.polygons, sound)))
    broken = bodies.shell[np.array([fault.polygon for fault in faults], dtype=np.int64)]
    faults = [replace(fault, shell=int(bodies.shell[fault.polygon])) for fault in faults]
    faults += _shells(bodies, broken)
    return sorted(faults, key=lambda fault: check_order(fault.code))


def _without(every: IntArray, left_out: list[int]) -> IntArray:
    return np.setdiff1d(every, np.array(left_out, dtype=np.int64))


def _at(index: IntArray, faults: list[Fault]) -> list[Fault]:
    """Maps the polygon indices of faults from a selection to all polygons."""
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
    inner[1:] = (bodies.solid[1:] == bodies.solid[:-1]) & (bodies.solid[1:] >= 0)
    faults = shell_faults(polygons, shell, inner, bodies.solid < 0)
    whole = np.flatnonzero(~np.isin(shell, [fault.shell for fault in faults]))
    faults += _at(whole, _crossings(take(polygons, whole), shell[whole]))
    wrong = np.concatenate([broken, np.array([fault.shell for fault in faults], dtype=np.int64)])
    return _at(chosen, faults) + _cavities(bodies, inner, wrong)


def _crossings(polygons: Polygons, shell: IntArray) -> list[Fault]:
    crossing, resting = crossing_pairs(polygons, shell)
    return [
        *_fault_per_shell(303, resting, polygons, shell, "edges on the inside of polygons"),
        *_fault_per_shell(306, crossing, polygons, shell, "pairs of polygons"),
    ]


def _fault_per_shell(
    code: int, pairs: IntArray, polygons: Polygons, shell: IntArray, what: str
) -> list[Fault]:
    shells, first, counts = np.unique(shell[pairs[:, 0]], return_index=True, return_counts=True)
    return [
        Fault(code, int(pairs[f, 0]), int(s), f"{n} {what}, {_near(polygons, pairs[f])}")
        for s, f, n in zip(shells, first, counts, strict=True)
    ]


def _near(polygons: Polygons, pair: IntArray) -> str:
    """Describes the position of two polygons as text."""
    starts = polygons.ring_offsets[polygons.polygon_offsets[pair]]
    places = (" ".join(f"{value:.3f}" for value in polygons.points[start]) for start in starts)
    return "the first from {} and from {}".format(*places)


def _cavities(bodies: Bodies, inner: BoolArray, wrong: IntArray) -> list[Fault]:
    """Returns the faults between the shells of solids with cavities."""
    faults = []
    for solid in np.unique(bodies.solid[inner]):
        shells = np.flatnonzero(bodies.solid == solid)
        if np.isin(shells, wrong).any():
            continue
        exterior, *cavities = (
            take(bodies.polygons, np.flatnonzero(bodies.shell == shell)) for shell in shells
        )
        faults += [Fault(code, -1, int(shells[0])) for code in cavity_faults(exterior, cavities)]
    return faults
