"""What a road file holds, as tables for the terminal."""

from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping

import numpy as np
from rich.console import Console, Group, RenderableType
from rich.table import Table
from rich.text import Text

from envgen_usd.errors import Issue, Severity
from envgen_usd.models.road import Curve, Lane, LaneSection, Road, RoadNetwork

_STYLES = {Severity.INFO: "cyan", Severity.WARNING: "yellow", Severity.ERROR: "bold red"}
_MOST_KINDS = 12
"""Kinds of objects or signals that are listed; the rest are only counted."""


def print_summary(network: RoadNetwork, console: Console, details: bool = False) -> None:
    """Prints what a network holds and what was odd in its file.

    Args:
        network: As it was read.
        console: Where to print.
        details: Lists every issue and not only how many there are of each kind.
    """
    console.print(Group(_overview(network), _lanes(network.roads.values()), _things(network)))
    if not network.issues:
        console.print("No issues.")
        return
    console.print(_issue_kinds(network.issues))
    if details:
        for issue in network.issues:
            console.print(_line(issue), soft_wrap=True)


def _overview(network: RoadNetwork) -> RenderableType:
    roads = list(network.roads.values())
    kinds = Counter(int(kind) for road in roads for kind in road.plan_view.kind)
    through = sum(1 for road in roads if road.junction)
    table = Table(title=network.name, show_header=False, title_justify="left")
    table.add_row("OpenDRIVE", network.revision or "no revision")
    table.add_row("Roads", f"{len(roads)}, {through} of them in junctions")
    table.add_row("Length", f"{sum(road.length for road in roads) / 1000:.3f} km")
    table.add_row("Geometries", _counts({Curve(kind).name.lower(): n for kind, n in kinds.items()}))
    table.add_row("Profiles", _counts(_profiles(roads)))
    table.add_row("Height", _height(roads))
    table.add_row("Junctions", _counts(Counter(each.type for each in network.junctions.values())))
    table.add_row("Traffic", _counts(Counter(road.rule for road in roads)))
    table.add_row("Controllers, ...", _counts(Counter(each.tag for each in network.controllers)))
    table.add_row("geoReference", Text(network.geo_reference or "none"))
    table.add_row("Offset", ", ".join(f"{value:g}" for value in network.offset))
    return table


def _profiles(roads: Iterable[Road]) -> dict[str, int]:
    """Number of roads that have each kind of profile."""
    found: Counter[str] = Counter()
    for road in roads:
        found["elevation"] += bool(road.elevation.coefficients.any())
        found["superelevation"] += bool(road.superelevation.coefficients.any())
        found["shape"] += road.shapes is not None
        found["crossSectionSurface"] += road.cross_section is not None
        found["laneOffset"] += bool(road.lane_offset.coefficients.any())
        found["lane layers"] += bool(road.layers)
    return {name: count for name, count in found.items() if count}


def _height(roads: Iterable[Road]) -> str:
    heights = np.concatenate([road.elevation(np.linspace(0.0, road.length, 9)) for road in roads])
    return f"{heights.min():.2f} m to {heights.max():.2f} m"


def _lanes(roads: Iterable[Road]) -> RenderableType:
    lengths: defaultdict[str, float] = defaultdict(float)
    counts: Counter[str] = Counter()
    marks: Counter[str] = Counter()
    for road in roads:
        for section in road.sections:
            for lane in _all_lanes(section):
                counts[lane.type] += lane.id != 0
                lengths[lane.type] += (section.end - section.s) * (lane.id != 0)
                marks.update(mark.type for mark in lane.marks if mark.type != "none")
    table = Table("Lane type", "Lanes", "km", title="Lanes", title_justify="left")
    for name, count in counts.most_common():
        if count:
            table.add_row(name, str(count), f"{lengths[name] / 1000:.3f}")
    return Group(table, f"Road marks: {_counts(marks)}")


def _all_lanes(section: LaneSection) -> tuple[Lane, ...]:
    return (*section.left, section.centre, *section.right)


def _things(network: RoadNetwork) -> RenderableType:
    objects = Counter(
        " ".join(filter(None, (thing.type, thing.subtype)))
        for road in network.roads.values()
        for thing in road.objects
    )
    signals = Counter(
        "reference" if signal.reference else f"{signal.country or '?'} {signal.type or '?'}"
        for road in network.roads.values()
        for signal in road.signals
    )
    return Group(
        f"Objects: {_counts(objects, _MOST_KINDS)}", f"Signals: {_counts(signals, _MOST_KINDS)}"
    )


def _issue_kinds(issues: Iterable[Issue]) -> RenderableType:
    table = Table(
        "Issue", "Severity", "Count", "Mended", "First", title="Issues", title_justify="left"
    )
    groups: defaultdict[tuple[str, Severity], list[Issue]] = defaultdict(list)
    for issue in issues:
        groups[issue.kind, issue.severity].append(issue)
    order = list(Severity)[::-1]
    for (kind, severity), found in sorted(groups.items(), key=lambda g: (order.index(g[0][1]), g)):
        mended = sum(1 for issue in found if issue.action)
        name = Text(severity.value, style=_STYLES[severity])
        table.add_row(kind, name, str(len(found)), str(mended), _line(found[0]))
    return table


def _line(issue: Issue) -> Text:
    place = f"line {issue.line}, " if issue.line else ""
    action = f"; {issue.action}" if issue.action else ""
    return Text.assemble(
        (f"{issue.severity.value}: ", _STYLES[issue.severity]),
        f"{place}{issue.where}: {issue.message}{action}",
    )


def _counts(found: Mapping[str, int], most: int | None = None) -> str:
    listed = Counter(found).most_common(most)
    rest = sum(found.values()) - sum(count for _, count in listed)
    texts = [f"{name} {count}" for name, count in listed]
    return ", ".join([*texts, *([f"others {rest}"] if rest else [])]) or "none"
