"""Sidewalks above the carriageway, where a road file says nothing about heights of lanes."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from envgen_usd.errors import Issue, Severity
from envgen_usd.models.lanes import WALKED, Lane, LaneSection
from envgen_usd.models.road import Road, RoadNetwork

_WITH_THEM = WALKED | {"curb", "border", "none", "median", "biking"}
"""Types that rise with the sidewalk inside of them."""


def with_raised_sidewalks(network: RoadNetwork, height: float) -> RoadNetwork:
    """Raises all sidewalks of a network in which no lane has a height.

    By the standard (11.4.2) such sidewalks are level with the carriageway, as in the towns of
    CARLA; in streets they lie behind a kerb. Lanes outside of a sidewalk rise with it, and so do
    lanes of type ``curb``. Where any lane has a height, the file has said which ones.

    Args:
        network: Content of a road file.
        height: Of the sidewalks above the road, metres; 0 leaves them as they are.

    Returns:
        The network with an issue, or the network itself.
    """
    sections = [section for road in network.roads.values() for section in road.sections]
    given = any(lane.height[:, 1:].any() for one in sections for lane in (*one.left, *one.right))
    if height <= 0.0 or given:
        return network
    roads = {id_: _raised_road(road, height) for id_, road in network.roads.items()}
    count = sum(road is not network.roads[id_] for id_, road in roads.items())
    if not count:
        return network
    issue = Issue(
        "road.flat_sidewalks",
        Severity.INFO,
        "road/lanes",
        f"no lane has a height; {count} roads have sidewalks",
        f"sidewalks lie {height:g} m higher, by the environment (road.kerb_height)",
    )
    return replace(network, roads=roads, issues=(*network.issues, issue))


def _raised_road(road: Road, height: float) -> Road:
    """The road itself where it has no sidewalk."""
    sections = tuple(_raised_section(section, height) for section in road.sections)
    pairs = zip(sections, road.sections, strict=True)
    same = all(one is other for one, other in pairs)
    return road if same else replace(road, sections=sections)


def _raised_section(section: LaneSection, height: float) -> LaneSection:
    left, right = (_raised_lanes(lanes, height) for lanes in (section.left, section.right))
    if left is section.left and right is section.right:
        return section
    return replace(section, left=left, right=right)


def _raised_lanes(lanes: Sequence[Lane], height: float) -> tuple[Lane, ...]:
    """Lanes of a side from the centre outwards; they themselves where there is no sidewalk."""
    if not any(lane.type in WALKED for lane in lanes):
        return tuple(lanes)
    entry = np.array([[0.0, height, height]])
    raised, result = False, []
    for lane in lanes:
        raised = lane.type in WALKED or lane.type == "curb" or (raised and lane.type in _WITH_THEM)
        result.append(replace(lane, height=entry) if raised else lane)
    return tuple(result)
