"""Geometries that start kilometres away from the others of their road."""

import numpy as np

from envgen_usd.errors import Severity
from envgen_usd.models.array_types import BoolArray, FloatArray
from envgen_usd.opendrive.document.findings import Element, Findings, Unusable, remove
from envgen_usd.opendrive.elements.broken_geometries import repair_geometries

STRAY = 1000.0
"""Distance in metres from the geometry before that no gap has; a larger value lets lanes cross it.
"""
KIND = "plan_view.stray"


def place_strays(
    plan: Element, elements: list[Element], table: FloatArray, findings: Findings
) -> bool:
    """Repairs or removes geometries that would stretch lanes over kilometres.

    1. A single geometry apart from its neighbours, which belong together, is put between them.
    2. At any other distance the road ends.

    Args:
        plan: The planView; repaired in place.
        elements: Its N geometries in order of s.
        table: N x 5: s, x, y, heading, length.
        findings: Collects the issues.

    Returns:
        True if a geometry was changed, so that they have to be read again.
    """
    apart = _apart(table, 1)
    if not apart.any():
        return False
    place = int(np.flatnonzero(apart)[0]) + 1
    beyond = _apart(table, 2)
    if place == 1 and len(table) > 2 and not apart[1]:
        place = 0
    follows = place + 1 < len(table)
    if place > 0 and follows and not (apart[place] and not beyond[place - 1]):
        text = f"starts more than {STRAY:g} m from the end of the previous geometry"
        findings.repaired(KIND, elements[place], text, "road ends here", Severity.ERROR)
        for rest in elements[place:]:
            remove(rest)
        return True
    stray = elements[place]
    fault = f"x={stray.get('x')}, y={stray.get('y')} is more than {STRAY:g} m from the others"
    for name in ("x", "y"):
        stray.attrib.pop(name, "")
    repair_geometries(plan, Unusable(stray, KIND, fault), findings)
    return True


def _apart(table: FloatArray, step: int) -> BoolArray:
    """Whether geometries lie apart from those `step` places before; N - step."""
    distance = np.hypot(*(table[step:, 1:3] - table[:-step, 1:3]).T)
    ends = np.concatenate([[0.0], np.cumsum(table[:, 4])])
    far: BoolArray = distance - (ends[step:-1] - ends[: -1 - step]) > STRAY
    return far
