"""A map of lanelets as OpenDRIVE: the table of contents of the file."""

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import count

from lxml import etree

from envgen_usd.errors import EnvgenError, Issue, Severity
from envgen_usd.models.lanelet_map import LaneletMap
from envgen_usd.streets import road_elements as elements
from envgen_usd.streets.lanelets.lane_groups import LaneGroups, lane_groups
from envgen_usd.streets.lanelets.lanelet_furniture import LaneletFurniture
from envgen_usd.streets.lanelets.lanelet_road_elements import LaneletRoad, road_element
from envgen_usd.streets.lanelets.road_links import RoadLinks
from envgen_usd.streets.lanelets.road_strips import RoadPlan, road_plan
from envgen_usd.streets.lanelets.strip_shapes import section_ends, strip_shapes

_FAR = 0.05
"""Distance of a border from its linestring that is reported, metres."""


@dataclass(frozen=True, eq=False)
class LaneletRoads:
    """The file, and what was decided.

    Attributes:
        xml: OpenDRIVE 1.8.
        issues: What was left out or decided.
        counts: What was read and made, by name.
    """

    xml: bytes
    issues: tuple[Issue, ...]
    counts: Mapping[str, int]


def lanelet_roads(source: LaneletMap, name: str) -> LaneletRoads:
    """OpenDRIVE of the lanelets of a map: a road for each group of lanelets side by side.

    Args:
        source: The map.
        name: Name of the map, for the header.

    Raises:
        EnvgenError: No lanelet is a lane of a road.
    """
    groups = lane_groups(source)
    if not groups.groups:
        raise EnvgenError(
            f"{source.source}: none of its {len(source.lanelets)} lanelets is a lane of a road"
            " (subtype road, highway, walkway, ...)"
        )
    plan = road_plan(groups.groups, source)
    root = etree.Element("OpenDRIVE")
    _add_header(root, source, name)
    ids = map(str, count(1))
    roads = list(_roads(plan, groups, source, ids))
    links = RoadLinks(plan, roads, {j: next(ids) for j in _junctions(plan)}, source, ids)
    links.write()
    furniture = LaneletFurniture(roads, source)
    furniture.add()
    root.extend([*(road.element for road in roads), *links.junctions])
    counts = {
        **source.counts,
        "roads": sum(strip.junction < 0 for strip in plan.strips),
        "connecting": sum(strip.junction >= 0 for strip in plan.strips),
        "junctions": len(links.junctions),
        **furniture.counts,
    }
    xml = etree.tostring(root, xml_declaration=True, encoding="UTF-8", pretty_print=True)
    issues = (*source.issues, *_issues(source, groups, roads, links), *furniture.issues())
    return LaneletRoads(xml, issues, counts)


def _add_header(root: etree._Element, source: LaneletMap, name: str) -> None:
    header = etree.SubElement(root, "header", revMajor="1", revMinor="8", name=name, version="1.0")
    if source.crs:
        etree.SubElement(header, "geoReference").text = etree.CDATA(source.crs)
        x, y = (elements.text(value) for value in source.offset)
        etree.SubElement(header, "offset", x=x, y=y, z="0", hdg="0")


def _junctions(plan: RoadPlan) -> list[int]:
    return sorted({strip.junction for strip in plan.strips if strip.junction >= 0})


def _roads(
    plan: RoadPlan, groups: LaneGroups, source: LaneletMap, ids: Iterator[str]
) -> Iterator[LaneletRoad]:
    numbers = [next(ids) for _ in plan.strips]
    junctions = {number: str(len(numbers) + 1 + n) for n, number in enumerate(_junctions(plan))}
    for n, (id_, shape) in enumerate(zip(numbers, strip_shapes(plan, source), strict=True)):
        strip = plan.strips[n]
        ends = section_ends(n, plan, shape, source)
        junction = junctions.get(strip.junction, "-1")
        element = road_element(id_, junction, strip, shape, ends, source, groups.left_hand)
        yield LaneletRoad(id_, strip, shape, ends, element)


def _issues(
    source: LaneletMap, groups: LaneGroups, roads: list[LaneletRoad], links: RoadLinks
) -> Iterator[Issue]:
    where = source.source
    for subtype, number in sorted(groups.unused.items()):
        text = f"{number} lanelets of subtype {subtype} are no lanes of roads"
        yield Issue("lanelet.subtype", Severity.INFO, where, text, "not used")
    far = [road for road in roads if road.shape.error > _FAR]
    if far:
        worst = max(far, key=lambda road: road.shape.error)
        first = source.lanelets[worst.strip.groups[0].lanelets[0]].id
        text = (
            f"borders of {len(far)} roads are up to {worst.shape.error:.2f} m from the linestrings"
        )
        yield Issue("lanelet.border", Severity.WARNING, f"{where}: lanelet {first}", text)
    if links.crossing_junctions:
        text = f"{links.crossing_junctions} ends of connecting roads meet connecting roads alone"
        action = "linked as roads, without a connection"
        yield Issue("lanelet.junctions_meet", Severity.INFO, where, text, action)
    lanes = {n for road in roads for group in road.strip.groups for n in group.lanelets}
    used = Counter(source.lanelets[n].subtype for n in lanes)
    text = ", ".join(f"{number} {subtype}" for subtype, number in sorted(used.items()))
    yield Issue("lanelet.used", Severity.INFO, where, f"lanelets that are lanes of roads: {text}")
