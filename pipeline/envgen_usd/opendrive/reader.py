"""OpenDRIVE file to road network."""

from dataclasses import dataclass
from pathlib import Path

from envgen_usd.errors import EnvgenError, Issue, Severity
from envgen_usd.models.junctions import Junction
from envgen_usd.models.road import Road, RoadNetwork
from envgen_usd.opendrive.checks.bounds import mend_bounds
from envgen_usd.opendrive.checks.counts import mend_counts
from envgen_usd.opendrive.checks.index import Index
from envgen_usd.opendrive.checks.joined import join_plan_views
from envgen_usd.opendrive.checks.junctions import mend_junctions
from envgen_usd.opendrive.checks.lane_links import mend_lane_links
from envgen_usd.opendrive.checks.links import mend_links
from envgen_usd.opendrive.checks.profiles import check_profiles
from envgen_usd.opendrive.checks.reference_lines import check_reference_lines
from envgen_usd.opendrive.checks.references import check_references
from envgen_usd.opendrive.checks.widths import mend_widths
from envgen_usd.opendrive.document import Document, open_document
from envgen_usd.opendrive.elements.empty_roads import bypass_empty_roads
from envgen_usd.opendrive.elements.header import read_header
from envgen_usd.opendrive.elements.junctions import read_junction
from envgen_usd.opendrive.elements.records import others
from envgen_usd.opendrive.elements.roads import read_road
from envgen_usd.opendrive.findings import (
    Element,
    Findings,
    Hostile,
    Unusable,
    line_of,
    path_of,
    remove,
)
from envgen_usd.opendrive.includes import follow_includes
from envgen_usd.opendrive.turned import turned

_KNOWN = frozenset({"header", "road", "junction"})


@dataclass(frozen=True)
class Reading:
    """A file as it was understood.

    Attributes:
        network: The road network.
        document: Its tree, with everything mended that an issue says was mended.
    """

    network: RoadNetwork
    document: Document


def read_network(path: Path) -> RoadNetwork:
    """Reads an OpenDRIVE file (1.1 to 1.9), by its content and not by its declared revision.

    What is odd is mended where that is possible and reported in the network's issues.

    Args:
        path: The .xodr file.

    Raises:
        EnvgenError: The file is missing, no XML, no OpenDRIVE, hostile, or has no usable road.
    """
    return read(path).network


def read(path: Path) -> Reading:
    """Reads an OpenDRIVE file and keeps its mended tree.

    Args:
        path: The .xodr file.

    Raises:
        EnvgenError: As `read_network`.
    """
    findings = Findings()
    document = open_document(path, findings)
    try:
        follow_includes(document.root, path, findings)
        network = _network(document, findings)
    except Hostile as error:
        line = line_of(error.element)
        where = f"{path}: {path_of(error.element)} (line {line})"
        raise EnvgenError(f"{where}: {error.message}, refused. Correct or remove it.") from None
    return Reading(network, document)


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
        document.path.stem,
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
            findings.mended(error.kind, error.element, text, "road left out", Severity.ERROR)
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
    """Checks and mends what the elements say about each other."""
    index = Index.of(root)
    roads = mend_counts(mend_bounds(roads, index, findings), index, findings)
    in_order = list(roads.values())
    joined = join_plan_views(in_order)
    check_reference_lines(in_order, joined, index, findings)
    check_profiles(in_order, index, findings)
    named = {road.junction for road in in_order if road.junction}
    roads = mend_links(roads, named | junctions.keys(), joined, index, findings)
    roads = mend_lane_links(roads, index, findings)
    roads = mend_widths(roads, index, findings)
    check_references(roads.values(), index, findings)
    return roads, mend_junctions(junctions, roads, index, findings)


def _name_uniquely(
    element: Element, taken: dict[str, Road] | dict[str, Junction], findings: Findings
) -> None:
    name = element.get("id", "")
    if name and name not in taken:
        return
    number = 2
    while (fresh := f"{name or element.tag}_{number}") in taken:
        number += 1
    text = f"id {name!r} is taken" if name else "no id"
    findings.mended("id.not_unique", element, text, f"called {fresh}", Severity.ERROR)
    element.set("id", fresh)


def _why_no_road(issues: tuple[Issue, ...]) -> str:
    """Message for a file without usable roads, with the first reason."""
    fault = next((issue for issue in issues if issue.action == "road left out"), None)
    if fault is None:
        return "no road in it. Give an OpenDRIVE file with at least one road."
    place = f"{fault.where} (line {fault.line})"
    return f"no usable road: {place}: {fault.message}. Correct it in the file."
