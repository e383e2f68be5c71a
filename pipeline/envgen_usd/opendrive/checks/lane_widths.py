"""Clips negative lane widths at 0 (11.6.1)."""

from dataclasses import replace
from itertools import pairwise

import numpy as np

from envgen_usd.models.array_types import BoolArray, FloatArray
from envgen_usd.models.cubics import Cubics
from envgen_usd.models.lanes import Lane, LaneSection
from envgen_usd.models.road import Road
from envgen_usd.opendrive.checks.element_index import Index
from envgen_usd.opendrive.checks.lane_link_checks import with_lane
from envgen_usd.opendrive.document.findings import Element, Findings
from envgen_usd.opendrive.document.number_attributes import write

LEAST = -1e-6
"""Least width in metres; values between this and 0 are rounding errors."""
_NAMES = ("sOffset", "a", "b", "c", "d")


def repair_widths(roads: dict[str, Road], index: Index, findings: Findings) -> dict[str, Road]:
    """Replaces negative stretches of lane widths by a width of 0.

    Args:
        roads: Roads by id.
        index: XML elements; repaired in place.
        findings: Collects the issues.

    Returns:
        The roads, without lanes narrower than `LEAST`.
    """
    repaired = dict(roads)
    for road in roads.values():
        sections = list(road.sections)
        for number, section in enumerate(sections):
            narrow = [lane for lane in (*section.left, *section.right) if _narrow(lane, section)]
            for lane in narrow:
                element = index.lane_in_section(road.id, number, lane.id)
                if element is None:
                    continue  # its cubics belong to the section that it continues
                width = _repair(lane.width, section.end - section.s, element, findings)
                sections[number] = with_lane(sections[number], replace(lane, width=width))
        if any(new is not old for new, old in zip(sections, road.sections, strict=True)):
            repaired[road.id] = replace(road, sections=tuple(sections))
    return repaired


def _narrow(lane: Lane, section: LaneSection) -> bool:
    coefficients = lane.width.coefficients
    if not coefficients[:, 1:].any():
        return bool((coefficients[:, 0] < LEAST).any())
    return bool((lowest(lane.width, section.end - section.s) < LEAST).any())


def lowest(cubics: Cubics, length: float) -> FloatArray:
    """Returns the least value of each piece between 0 and the length; infinity outside."""
    extent = (np.append(cubics.start[1:], length) - cubics.start).clip(0.0, length)
    a, b, c, d = cubics.coefficients.T
    places = np.stack([np.zeros_like(extent), extent, *_turns(b, c, d)])
    places = np.clip(np.nan_to_num(places), 0.0, extent)
    least: FloatArray = (a + places * (b + places * (c + places * d))).min(axis=0)
    outside: BoolArray = (cubics.start > length) | ((extent == 0) & (cubics.start > 0))
    return np.where(outside, np.inf, least)


def _turns(b: FloatArray, c: FloatArray, d: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Returns the roots of the derivative in the form without cancellation; NaN for no root."""
    with np.errstate(divide="ignore", invalid="ignore"):
        q = -(c + np.copysign(np.sqrt(c * c - 3 * d * b), c))
        return q / (3 * d), b / q


def _repair(width: Cubics, length: float, element: Element, findings: Findings) -> Cubics:
    least = float(lowest(width, length).min())
    text = f"the width falls to {least:.4g} m"
    findings.repaired("lane.negative_width", element, text, "clipped at 0 m")
    pieces = []
    for number, start in enumerate(width.start.tolist()):
        following = width.start[number + 1] if number + 1 < len(width.start) else length
        pieces += _split(start, max(following - start, 0.0), width.coefficients[number])
    table = np.array(pieces)
    _write(element, table)
    return Cubics(table[:, 0], table[:, 1:])


def _split(start: float, extent: float, coefficients: FloatArray) -> list[list[float]]:
    """Returns pieces (start, a, b, c, d) of a cubic; 0 where the cubic is negative."""
    a, b, c, d = coefficients.tolist()
    roots = np.roots([d, c, b, a]) if any((b, c, d)) else np.empty(0)
    real = roots.real[(np.abs(roots.imag) < 1e-9) & (roots.real > 0) & (roots.real < extent)]
    cuts = [0.0, *sorted(real.tolist()), extent]
    pieces: list[list[float]] = []
    for low, high in pairwise(cuts):
        middle = (low + high) / 2
        if a + middle * (b + middle * (c + middle * d)) < 0:
            pieces.append([start + low, 0.0, 0.0, 0.0, 0.0])
            continue
        value = max(a + low * (b + low * (c + low * d)), 0.0)
        slope, bend = b + low * (2 * c + low * 3 * d), c + 3 * low * d
        pieces.append([start + low, value, slope, bend, d])
    return pieces


def _write(element: Element, table: FloatArray) -> None:
    old = list(element.iterchildren("width"))
    place = element.index(old[0])
    for each in old:
        element.remove(each)
    for row in reversed(table.tolist()):
        values = dict(zip(_NAMES, map(write, row), strict=True))
        element.insert(place, element.makeelement("width", values))
