"""Reads an OpenDRIVE file into a road network."""

from dataclasses import dataclass
from pathlib import Path

from envgen_usd.compressed_files import content_stem
from envgen_usd.cycle_collection import paused_collection
from envgen_usd.errors import EnvgenError, Issue, Severity
from envgen_usd.models.junctions import Junction
from envgen_usd.models.road import Road, RoadNetwork
from envgen_usd.opendrive.checks.element_index import Index
from envgen_usd.opendrive.checks.figure_bounds import repair_bounds
from envgen_usd.opendrive.checks.instance_counts import repair_counts
from envgen_usd.opendrive.checks.joined_plan_views import join_plan_views
from envgen_usd.opendrive.checks.junction_connections import repair_junctions
from envgen_usd.opendrive.checks.lane_link_checks import repair_lane_links
from envgen_usd.opendrive.checks.lane_widths import repair_widths
from envgen_usd.opendrive.checks.object_references import check_references
from envgen_usd.opendrive.checks.profile_steps import check_profiles
from envgen_usd.opendrive.checks.reference_line_gaps import check_reference_lines
from envgen_usd.opendrive.checks.road_link_checks import repair_links
from envgen_usd.opendrive.document.findings import (
    Element,
    Findings,
    Hostile,
    Unusable,
    line_of,
    path_of,
    remove,
)
from envgen_usd.opendrive.document.includes import follow_includes
from envgen_usd.opendrive.document.xml_document import Document, open_document
from envgen_usd.opendrive.elements.empty_roads import bypass_empty_roads
from envgen_usd.opendrive.elements.header_element import read_header
from envgen_usd.opendrive.elements.junction_element import read_junction
from envgen_usd.opendrive.elements.kept_elements import others
from envgen_usd.opendrive.elements.road_element import read_road
from envgen_usd.opendrive.geometry.turned_network import turned

_KNOWN = frozenset({"header", "road", "junction"})


@dataclass(frozen=True)
class Reading:
    """Result of reading a file.

    Attributes:
        network: The road network.
        document: XML tree of the file, including all repairs that the issues report.
        files: The file and its included files.
    """

    network: RoadNetwork
    document: Document
    files: tuple[Path, ...]


def read_network(path: Path | str) -> RoadNetwork:
    """Reads an OpenDRIVE file (1.1 to 1.9) by its content; the declared revision has no effect.

    The reader repairs faulty elements where possible. The network's issues list all warnings and
    repairs.

    Args:
        path: The .xodr file.

    Raises:
        EnvgenError: The file is missing, not XML, not OpenDRIVE, hostile, or has no usable road.
    """
    return read(Path(path)).network


@paused_collection()
def read(path: Path) -> Reading:
    """Reads an OpenDRIVE file into a network and a repaired tree.

    Args:
        path: The .xodr file.

    Raises:
        EnvgenError: As in `read_network`.
    """
    findings = Findings()
    document = open_document(path, findings)
    try:
        included = follow_includes(document.root, path, findings)
        network = _network(document, findings)
    except Hostile as error:
        line = line_of(error.element)
        where = f"{path}: {path_of(error.element)} (line {line})"
        raise EnvgenError(f"{where}: {error.message}, refused. Correct or remove it.") from None
    return Reading(network, document, (path, *included))


def _network(document: Document, findings: Findings) -> RoadNetwork:
    root = document.root
    header = read_header(root, findings)
    bypass_empty_roads(root, findings)
    roads = _roads(root, findings)
    if not roads:
        raise EnvgenError(f"{document.path}: {_why_no_road(findings.issues)}")
    junctions = _junctions(root, roads, findings)
    roads, junctions = _check(roads, junctions, root, findings)
    network = RoadNetwork(
        content_stem(document.path),
        roads,
        junctions,
        header.revision,
        header.geo_reference,
        header.offset,
        others(root, _KNOWN),
        findings.issues,
    )
    return turned(network, header.offset[3])


def _roads(root: Element, findings: Findings) -> dict[str, Road]:
    roads: dict[str, Road] = {}
    for element in list(root.iterchildren("road")):
        _name_uniquely(element, roads, findings)
        try:
            road = read_road(element, findings)
        except Unusable as error:
            text = error.message
            findings.repaired(error.kind, error.element, text, "road left out", Severity.ERROR)
            remove(element)
        else:
            roads[road.id] = road
    return roads


def _junctions(root: Element, roads: dict[str, Road], findings: Findings) -> dict[str, Junction]:
    lengths = {road.id: road.length for road in roads.values()}
    junctions: dict[str, Junction] = {}
    for element in root.iterchildren("junction"):
        _name_uniquely(element, junctions, findings)
        junction = read_junction(element, lengths, findings)
        junctions[junction.id] = junction
    return junctions


def _check(
    roads: dict[str, Road], junctions: dict[str, Junction], root: Element, findings: Findings
) -> tuple[dict[str, Road], dict[str, Junction]]:
    """Checks and repairs the references between elements, and the bounds of their values."""
    index = Index.of(root)
    roads = repair_counts(repair_bounds(roads, index, findings), index, findings)
    in_order = list(roads.values())
    joined = join_plan_views(in_order)
    check_reference_lines(in_order, joined, index, findings)
    check_profiles(in_order, index, findings)
    named = {road.junction for road in in_order if road.junction}
    roads = repair_links(roads, named | junctions.keys(), joined, index, findings)
    roads = repair_lane_links(roads, index, findings)
    roads = repair_widths(roads, index, findings)
    check_references(roads.values(), index, findings)
    return roads, repair_junctions(junctions, roads, index, findings)


def _name_uniquely(
    element: Element, taken: dict[str, Road] | dict[str, Junction], findings: Findings
) -> None:
    name = element.get("id", "")
    if name and name not in taken:
        return
    number = 2
    while (fresh := f"{name or element.tag}_{number}") in taken:
        number += 1
    text = f"id {name!r} is taken" if name else "the id is missing"
    findings.repaired("id.not_unique", element, text, f"called {fresh}", Severity.ERROR)
    element.set("id", fresh)


def _why_no_road(issues: tuple[Issue, ...]) -> str:
    """Returns the message for a file without usable roads, with the first error."""
    fault = next((issue for issue in issues if issue.action == "road left out"), None)
    if fault is None:
        return "the file has no road. Give an OpenDRIVE file with at least one road."
    place = f"{fault.where} (line {fault.line})"
    return f"no usable road: {place}: {fault.message}. Correct it in the file."
