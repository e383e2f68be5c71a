"""What a road file holds, as tables for the terminal."""

from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from envgen_usd.errors import EnvgenError, Issue, Severity
from envgen_usd.models.lanes import Lane, LaneSection
from envgen_usd.models.plan_view import Curve
from envgen_usd.models.road import Road, RoadNetwork
from envgen_usd.opendrive.map_drawing import write_map
from envgen_usd.opendrive.reader import read
from envgen_usd.opendrive.strips import section_grids
from envgen_usd.opendrive.transitions import transitions
from envgen_usd.opendrive.write import write_document

_STYLES = {Severity.INFO: "cyan", Severity.WARNING: "yellow", Severity.ERROR: "bold red"}
_ORDER = (Severity.ERROR, Severity.WARNING, Severity.INFO)
_TOLERANCE = 0.1
_MOST_ISSUES = 100
_MOST_KINDS = 12
"""Kinds of objects or signals that are listed; the rest are only counted."""


def inspect_file(
    road: Path,
    image: Path | None = None,
    fixed: Path | None = None,
    listed: Path | None = None,
) -> list[RenderableType]:
    """Reads a road file and tells what it holds and what was odd in it.

    Args:
        road: The OpenDRIVE file.
        image: Where to draw a map (.svg or .png), if it is wanted.
        fixed: Where to write the mended OpenDRIVE, if it is wanted.
        listed: Where to write all issues, one a line, if that is wanted.

    Returns:
        Tables and texts to print.

    Raises:
        EnvgenError: The file cannot be used, or an output cannot be written.
    """
    reading = read(road)
    network = _with_gaps(reading.network)
    if image is not None:
        _write(image, lambda path: write_map(network, path))
    if fixed is not None:
        _write(fixed, lambda path: write_document(reading.document, path))
    if listed is not None:
        _write(listed, lambda path: _write_list(network.issues, path))
    return [*summary(network), closing(network.issues, image, fixed, listed)]


def _with_gaps(network: RoadNetwork) -> RoadNetwork:
    """Adds the issues that only the lanes' places show: linked ends that do not meet."""
    roads = network.roads.values()
    grids = [grid for road in roads for grid in section_grids(road, _TOLERANCE)]
    return replace(network, issues=(*network.issues, *transitions(network, grids)[1]))


def _write(path: Path, write: Callable[[Path], None]) -> None:
    try:
        write(path)
    except OSError as error:
        what = f"{path}: cannot be written: {error.strerror}"
        raise EnvgenError(f"{what}. Give a path in a folder that exists.") from None


def summary(network: RoadNetwork) -> list[RenderableType]:
    """Tables of what a network holds, and its issues one by one."""
    found = [_overview(network), _lanes(network.roads.values()), _things(network)]
    if not network.issues:
        return [*found, "No issues."]
    worst = sorted(network.issues, key=lambda issue: _ORDER.index(issue.severity))
    lines = [_line(issue) for issue in worst[:_MOST_ISSUES]]
    rest = len(worst) - len(lines)
    more = [Text(f"... and {rest} more")] if rest else []
    return [*found, _issue_kinds(network.issues), *lines, *more]


def closing(
    issues: Iterable[Issue], image: Path | None, fixed: Path | None, listed: Path | None
) -> Text:
    """Last lines of the command: numbers by severity, and where map, list and mended file are."""
    counts = Counter(issue.severity for issue in issues)
    numbers = ", ".join(f"{counts[severity]} {severity.value}" for severity in _ORDER)
    places = (
        ("map:   ", image, "--image FILE.svg"),
        ("list:  ", listed, "--list FILE.txt"),
        ("mended:", fixed, "--fixed FILE.xodr"),
    )
    lines = [f"{name} {path or f'none; {option} writes one'}" for name, path, option in places]
    return Text("\n".join([f"issues: {numbers}", *lines]))


def _write_list(issues: Iterable[Issue], path: Path) -> None:
    worst = sorted(issues, key=lambda issue: _ORDER.index(issue.severity))
    path.write_text("".join(f"{_line(issue).plain}\n" for issue in worst), encoding="utf-8")


def _overview(network: RoadNetwork) -> RenderableType:
    roads = list(network.roads.values())
    kinds = Counter(int(kind) for road in roads for kind in road.plan_view.kind)
    through = sum(1 for road in roads if road.junction)
    table = Table(title=Text(network.name), show_header=False, title_justify="left")
    table.add_row("OpenDRIVE", Text(network.revision or "no revision"))
    table.add_row("Roads", f"{len(roads)}, {through} of them in junctions")
    table.add_row("Length", f"{sum(road.length for road in roads) / 1000:.3f} km")
    table.add_row("Geometries", _counts({Curve(kind).name.lower(): n for kind, n in kinds.items()}))
    table.add_row("Profiles", _counts(_profiles(roads)))
    table.add_row("Height", _height(roads))
    junctions = Counter(each.type for each in network.junctions.values())
    table.add_row("Junctions", Text(_counts(junctions)))
    table.add_row("Traffic", _counts(Counter(road.rule for road in roads)))
    others = Counter(each.tag for each in network.controllers)
    table.add_row("Controllers, ...", Text(_counts(others)))
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
            table.add_row(Text(name), str(count), f"{lengths[name] / 1000:.3f}")
    return Group(table, Text(f"Road marks: {_counts(marks)}"))


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
        Text(f"Objects: {_counts(objects, _MOST_KINDS)}"),
        Text(f"Signals: {_counts(signals, _MOST_KINDS)}"),
    )


def _issue_kinds(issues: Iterable[Issue]) -> RenderableType:
    table = Table("Issue", "Severity", "Count", "Mended", title="Issues", title_justify="left")
    groups: defaultdict[tuple[str, Severity], list[Issue]] = defaultdict(list)
    for issue in issues:
        groups[issue.kind, issue.severity].append(issue)
    keys = sorted(groups, key=lambda key: (_ORDER.index(key[1]), key))
    for kind, severity in keys:
        found = groups[kind, severity]
        mended = sum(1 for issue in found if issue.action)
        name = Text(severity.value, style=_STYLES[severity])
        table.add_row(kind, name, str(len(found)), str(mended))
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
