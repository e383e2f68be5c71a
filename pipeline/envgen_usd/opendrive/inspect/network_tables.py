"""Content of a road file as tables for the terminal."""

from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from envgen_usd.errors import Issue, Severity
from envgen_usd.models.lanes import Lane, LaneSection
from envgen_usd.models.plan_view import Curve
from envgen_usd.models.road import Road, RoadNetwork
from envgen_usd.opendrive.document.write import write_document
from envgen_usd.opendrive.features.road_features import road_features
from envgen_usd.opendrive.geometry.section_grids import section_grids
from envgen_usd.opendrive.inspect.map_drawing import write_map
from envgen_usd.opendrive.object_issues import object_issues
from envgen_usd.opendrive.reader import read
from envgen_usd.opendrive.strips.lane_transitions import transitions
from envgen_usd.opendrive.strips.road_overlays import overlay_strips
from envgen_usd.whole_files import refuse_own_input, write_whole

_STYLES = {Severity.INFO: "cyan", Severity.WARNING: "yellow", Severity.ERROR: "bold red"}
_ORDER = (Severity.ERROR, Severity.WARNING, Severity.INFO)
_TOLERANCE = 0.1
"""Chord error of lanes in metres; a larger value is faster."""
_MOST_ISSUES = 100
"""Issues in the terminal; the others are only counted."""
_MOST_KINDS = 12
"""Kinds of objects or signals in a list; further kinds are only counted."""


def inspect_file(
    road: Path,
    image: Path | None = None,
    fixed: Path | None = None,
    listed: Path | None = None,
) -> list[RenderableType]:
    """Reads a road file and summarises its content, warnings and repairs.

    Args:
        road: The OpenDRIVE file.
        image: Map to draw (.svg or .png); `None` for no map.
        fixed: Repaired OpenDRIVE file to write; `None` for no file.
        listed: List of all issues to write, one per line; `None` for no list.

    Returns:
        Tables and texts to print.

    Raises:
        EnvgenError: The file cannot be used, or an output cannot be written or is the file.
    """
    for target in (image, fixed, listed):
        if target is not None:
            refuse_own_input(target, road)
    reading = read(road)
    network = _with_issues(reading.network)
    if image is not None:
        write_map(network, image)
    if fixed is not None:
        write_document(reading.document, fixed)
    if listed is not None:
        _write_list(network.issues, listed)
    return [*summary(network), closing(network.issues, image, fixed, listed)]


def _with_issues(network: RoadNetwork) -> RoadNetwork:
    """Adds the issues of gaps between linked lane ends, and those of objects and signals."""
    roads = network.roads.values()
    grids = section_grids(roads, _TOLERANCE)
    paint = (strip.patch for road in roads for _, strip in overlay_strips(road))
    objects = object_issues(network, road_features(network), paint)
    return replace(network, issues=(*network.issues, *transitions(network, grids)[1], *objects))


def summary(network: RoadNetwork) -> list[RenderableType]:
    """Returns tables of the network's content, and its issues line by line."""
    tables = [_overview(network), _lanes(network.roads.values()), _objects(network)]
    if not network.issues:
        return [*tables, "No issues."]
    worst = sorted(network.issues, key=lambda issue: _ORDER.index(issue.severity))
    lines = [_line(issue) for issue in worst[:_MOST_ISSUES]]
    rest = len(worst) - len(lines)
    more = [Text(f"... and {rest} more")] if rest else []
    return [*tables, _issue_kinds(network.issues), *lines, *more]


def closing(
    issues: Iterable[Issue], image: Path | None, fixed: Path | None, listed: Path | None
) -> Text:
    """Returns the last lines: issues by severity, and the paths of map, list and repaired file."""
    counts = Counter(issue.severity for issue in issues)
    numbers = ", ".join(f"{counts[severity]} {severity.value}" for severity in _ORDER)
    places = (
        ("map:     ", image, "--image FILE.svg"),
        ("list:    ", listed, "--list FILE.txt"),
        ("repaired:", fixed, "--fixed FILE.xodr"),
    )
    lines = [f"{name} {path or f'none; {option} writes one'}" for name, path, option in places]
    return Text("\n".join([f"issues: {numbers}", *lines]))


def _write_list(issues: Iterable[Issue], path: Path) -> None:
    worst = sorted(issues, key=lambda issue: _ORDER.index(issue.severity))
    write_whole(path, "".join(f"{_line(issue).plain}\n" for issue in worst))


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
    table.add_row("Traffic", Text(_counts(Counter(road.rule for road in roads))))
    others = Counter(each.tag for each in network.controllers)
    table.add_row("Controllers, ...", Text(_counts(others)))
    table.add_row("geoReference", Text(network.geo_reference or "none"))
    table.add_row("Offset", ", ".join(f"{value:g}" for value in network.offset))
    return table


def _profiles(roads: Iterable[Road]) -> dict[str, int]:
    """Counts the roads with each kind of profile."""
    roads_with: Counter[str] = Counter()
    for road in roads:
        roads_with["elevation"] += bool(road.elevation.coefficients.any())
        roads_with["superelevation"] += bool(road.superelevation.coefficients.any())
        roads_with["shape"] += road.shapes is not None
        roads_with["crossSectionSurface"] += road.cross_section is not None
        roads_with["laneOffset"] += bool(road.lane_offset.coefficients.any())
        roads_with["lane layers"] += bool(road.layers)
    return {name: count for name, count in roads_with.items() if count}


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


def _objects(network: RoadNetwork) -> RenderableType:
    objects = Counter(
        " ".join(filter(None, (road_object.type, road_object.subtype)))
        for road in network.roads.values()
        for road_object in road.objects
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
    table = Table("Issue", "Severity", "Count", "Repaired", title="Issues", title_justify="left")
    groups: defaultdict[tuple[str, Severity], list[Issue]] = defaultdict(list)
    for issue in issues:
        groups[issue.kind, issue.severity].append(issue)
    keys = sorted(groups, key=lambda key: (_ORDER.index(key[1]), key))
    for kind, severity in keys:
        group = groups[kind, severity]
        repaired = sum(1 for issue in group if issue.action)
        name = Text(severity.value, style=_STYLES[severity])
        table.add_row(kind, name, str(len(group)), str(repaired))
    return table


def _line(issue: Issue) -> Text:
    place = f"line {issue.line}, " if issue.line else ""
    action = f"; {issue.action}" if issue.action else ""
    return Text.assemble(
        (f"{issue.severity.value}: ", _STYLES[issue.severity]),
        f"{place}{issue.where}: {issue.message}{action}",
    )


def _counts(counts: Mapping[str, int], most: int | None = None) -> str:
    listed = Counter(counts).most_common(most)
    rest = sum(counts.values()) - sum(count for _, count in listed)
    texts = [f"{name} {count}" for name, count in listed]
    return ", ".join([*texts, *([f"others {rest}"] if rest else [])]) or "none"
