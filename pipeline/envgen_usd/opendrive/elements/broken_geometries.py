"""Repair of unusable geometries from their neighbours; without a repair, the road ends there."""

from dataclasses import dataclass, field

import numpy as np

from envgen_usd.errors import Severity
from envgen_usd.models.plan_view import PlanView
from envgen_usd.opendrive.document.findings import Element, Findings, Unusable, remove
from envgen_usd.opendrive.document.number_attributes import read, write
from envgen_usd.opendrive.elements.geometry_element import PARAM_NAMES, Shape, read_curve
from envgen_usd.opendrive.geometry.curve_evaluation import evaluate

FARTHEST = 1e8
"""Largest distance in metres of a road from the origin in x or y; beyond it lies off the Earth."""
_CURVES = ("line", "arc", "spiral", "poly3", "paramPoly3")
_NAMES = ("s", "x", "y", "hdg", "length")


@dataclass
class _Draft:
    """The usable values of a geometry; `None` for a value that cannot be used."""

    element: Element
    s: float | None
    x: float | None
    y: float | None
    hdg: float | None
    length: float | None
    curve: Shape | None = field(default=None, init=False)
    fault: str = field(default="", init=False)

    @property
    def pose(self) -> tuple[float, float, float] | None:
        """Returns x, y and heading at the start; `None` unless all are known."""
        if self.x is None or self.y is None or self.hdg is None:
            return None
        return self.x, self.y, self.hdg

    def read_curve(self, findings: Findings) -> None:
        """Reads the curve, which requires the length."""
        if self.curve is None and self.length is not None:
            try:
                self.curve = read_curve(self.element, self.length, findings)
            except Unusable as error:
                self.fault = self.fault or error.message

    def after(self, pose: tuple[float, float, float]) -> tuple[float, float, float]:
        """Returns the pose at the end for a given pose at the start; needs curve and length."""
        x, y, heading = evaluate(self._plan_view(pose), np.array([self.length]))
        return float(x[0]), float(y[0]), float(heading[0])

    def _plan_view(self, pose: tuple[float, float, float]) -> PlanView:
        if self.curve is None or self.length is None:
            raise ValueError("a geometry without a curve")
        kind, start, end, cubic, p_end = self.curve
        x, y, heading, length, p_range = (np.array([v]) for v in (*pose, self.length, p_end))
        bends, table = np.array([[start, end]]), np.array([cubic])
        return PlanView(
            np.zeros(1), x, y, heading, length, np.array([int(kind)]), bends, table, p_range
        )


def repair_geometries(plan: Element, error: Unusable, findings: Findings) -> None:
    """Completes unusable geometries in the tree.

    1. A geometry without a pose starts at the end of its predecessor. Without a predecessor, it
       ends at the start of its successor.
    2. A missing length extends to the s of the successor; a missing s follows the predecessor.
    3. An unusable curve becomes a cubic to the start of the successor.
    4. Without usable neighbours, the road ends; a single geometry without a heading gets 0.

    Args:
        plan: The planView; repaired in place.
        error: The first fault of the planView.
        findings: Collects the issues.

    Raises:
        Unusable: The first geometry cannot be repaired.
    """
    drafts = [draft for each in plan.iterchildren("geometry") if (draft := _draft(each, findings))]
    before: _Draft | None = None
    for place, draft in enumerate(drafts):
        after = drafts[place + 1] if place + 1 < len(drafts) else None
        if draft.fault:
            actions = _complete(draft, before, after, findings)
            if actions is None:
                if before is None:
                    raise error
                text = draft.fault
                findings.repaired(error.kind, draft.element, text, "road ends here", Severity.ERROR)
                for rest in drafts[place:]:
                    remove(rest.element)
                return
            action = ", ".join(actions)
            findings.repaired(error.kind, draft.element, draft.fault, action, Severity.ERROR)
            _write(draft)
        before = draft


def _draft(element: Element, findings: Findings) -> _Draft | None:
    """Collects the usable values of a geometry; `None` for a geometry without a length."""
    values = {name: read(element.get(name) or "nan") for name in _NAMES}
    fault = ""
    for name, value in values.items():
        if value is None:
            text = element.get(name)
            bad = (
                f"{name} is missing" if text is None else f"{name}={text!r} is not a finite number"
            )
            fault = fault or bad
    for name in ("x", "y"):
        value = values[name]
        if value is not None and abs(value) > FARTHEST:
            values[name], fault = None, fault or f"{name}={value:g} is off the Earth"
    length = values["length"]
    if length is not None and length < 1e-6:
        return None
    draft = _Draft(element, *(values[name] for name in _NAMES))
    draft.fault = fault
    draft.read_curve(findings)
    return draft


def _complete(
    draft: _Draft, before: _Draft | None, after: _Draft | None, findings: Findings
) -> list[str] | None:
    """Completes the values; returns the actions, or `None` where the neighbours do not suffice."""
    actions: list[str] = []
    if draft.s is None and (before or after):
        draft.s = (before.s or 0.0) + (before.length or 0.0) if before else 0.0
        actions.append(f"s set to {draft.s:g}")
    if draft.length is None and after and None not in (after.s, draft.s):
        draft.length = max((after.s or 0.0) - (draft.s or 0.0), 0.0) or None
        actions.append(f"length set to {draft.length or 0.0:g}")
        draft.read_curve(findings)
    if draft.pose is None:
        actions.append(_place(draft, before, after))
    if draft.curve is None and draft.pose and draft.length and after and after.pose:
        draft.curve = _join(draft, draft.pose, after.pose, findings)
        actions.append("joined to the next geometry")
    known = None not in (draft.s, draft.length, draft.pose, draft.curve)
    return actions if known else None


def _place(draft: _Draft, before: _Draft | None, after: _Draft | None) -> str:
    """Takes the pose of a geometry from its neighbours, if possible; returns the action."""
    start = before.pose if before else None
    if before and start:
        x, y, heading = before.after(start)
        if draft.x is None or draft.y is None:
            draft.x, draft.y = x, y
        draft.hdg = heading if draft.hdg is None else draft.hdg
        return "starts at the end of the previous geometry"
    if after and after.pose and draft.curve:
        u, v, turn = draft.after((0.0, 0.0, 0.0))
        x, y, end = after.pose
        heading = end - turn if draft.hdg is None else draft.hdg
        draft.hdg = heading
        draft.x = x - u * np.cos(heading) + v * np.sin(heading)
        draft.y = y - u * np.sin(heading) - v * np.cos(heading)
        return "ends at the start of the next geometry"
    if draft.element.get("hdg") is None and None not in (draft.x, draft.y):
        draft.hdg = 0.0
        return "hdg set to 0"
    return ""


def _join(
    draft: _Draft,
    start: tuple[float, float, float],
    end: tuple[float, float, float],
    findings: Findings,
) -> Shape | None:
    """Returns the Hermite cubic between two poses."""
    dx, dy, heading = end[0] - start[0], end[1] - start[1], start[2]
    u = dx * np.cos(heading) + dy * np.sin(heading)
    v = dy * np.cos(heading) - dx * np.sin(heading)
    m, turn = float(np.hypot(u, v)), end[2] - heading
    across, along = m * np.sin(turn), m * np.cos(turn)
    cubic = (0.0, m, 3 * u - 2 * m - along, m + along - 2 * u)
    values = (*cubic, 0.0, 0.0, 3 * v - across, across - 2 * v)
    for child in list(draft.element.iterchildren(*_CURVES)):
        remove(child)
    attributes = dict(zip(PARAM_NAMES, map(write, values), strict=True))
    attributes["pRange"] = "normalized"
    draft.element.insert(0, draft.element.makeelement("paramPoly3", attributes))
    draft.read_curve(findings)
    return draft.curve


def _write(draft: _Draft) -> None:
    for name in _NAMES:
        value = getattr(draft, name)
        if read(draft.element.get(name) or "nan") != value:
            draft.element.set(name, write(value))
