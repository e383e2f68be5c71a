"""Checks objects, signals and references to them (chapters 13 and 14)."""

from collections.abc import Iterable

from envgen_usd.errors import Severity
from envgen_usd.models.road import Road
from envgen_usd.opendrive.checks.element_index import Index
from envgen_usd.opendrive.document.findings import Element, Findings

BEYOND = 0.01
"""Tolerated excess in metres of an object's s over the road's length."""


def check_references(roads: Iterable[Road], index: Index, findings: Findings) -> None:
    """Reports positions beyond a road's ends, and references to missing elements."""
    objects = set(_ids(index, "objects/object"))
    signals = set(_ids(index, "signals/signal"))
    for road in roads:
        element = index.roads[road.id]
        if road.objects:
            for each in element.iterfind("objects/*"):
                _check(each, "objectReference", objects, road.length, findings)
        if road.signals:
            for each in element.iterfind("signals/*"):
                _check(each, "signalReference", signals, road.length, findings)
    for control in index.root.iterfind("controller/control"):
        if control.get("signalId") not in signals:
            text = f"there is no signal {control.get('signalId')}"
            findings.noted("controller.unknown_signal", control, text, Severity.INFO)


def _check(
    element: Element, reference: str, known: set[str], length: float, findings: Findings
) -> None:
    if element.tag == reference and element.get("id", "") not in known:
        what = reference.removesuffix("Reference")
        text = f"there is no {what} {element.get('id')}"
        findings.noted("reference.unknown", element, text)
    s = element.get("s")
    if s is not None and not -BEYOND <= float(s) <= length + BEYOND:
        text = f"s={float(s):g} is not on the road, which is {length:g} m long"
        findings.noted("object.beyond_road", element, text)


def _ids(index: Index, path: str) -> list[str]:
    return [each.get("id", "") for road in index.roads.values() for each in road.iterfind(path)]
