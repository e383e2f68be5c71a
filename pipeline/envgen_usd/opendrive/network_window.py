"""The part of a road network near a place, complete enough that its surface there is the map's."""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import replace

import numpy as np

from envgen_usd.geometry.square_index import Bounds
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.junctions import Junction
from envgen_usd.models.road import Road, RoadLink, RoadNetwork
from envgen_usd.opendrive.geometry.curve_evaluation import evaluate

STEP = 20.0
"""Distance between the samples of a reference line, metres; a larger value is faster."""
BESIDE = 30.0
"""Width of a road beside its reference line that a box reckons with, metres."""


def road_boxes(network: RoadNetwork) -> FloatArray:
    """Boxes around the reference lines and what lies beside them, R x 4, in the file's order.

    Returns:
        (min x, min y, max x, max y) of each road, metres.
    """
    boxes = [_box(road) for road in network.roads.values()]
    return np.array(boxes).reshape(-1, 4)


def _box(road: Road) -> FloatArray:
    count = int(np.ceil(road.length / STEP)) + 1
    x, y, _ = evaluate(road.plan_view, np.linspace(0.0, road.length, count))
    low, high = (np.array([pick(x), pick(y)]) for pick in (np.min, np.max))
    return np.concatenate([low - BESIDE, high + BESIDE])


def network_near(network: RoadNetwork, boxes: FloatArray, bounds: Bounds) -> RoadNetwork:
    """The roads in a rectangle, with all that their surface and their lanes depend on.

    1. Roads whose boxes touch the rectangle are kept whole.
    2. Their junctions are kept whole, with all roads that meet there.
    3. So are the roads that they are linked to. Links of further roads are dropped.

    Args:
        network: Content of a road file.
        boxes: As `road_boxes` returns them.
        bounds: The rectangle, metres.

    Returns:
        Roads and junctions in the file's order, without the issues of the file; the network itself
        where all roads are kept.
    """
    touches = np.all((boxes[:, :2] <= bounds[2:]) & (boxes[:, 2:] >= bounds[:2]), axis=1)
    ids = np.array(list(network.roads), dtype=object)
    near = set(ids[touches].tolist())
    if len(near) == len(ids):
        return network
    junctions = {id_ for road in near for id_ in _junctions_of(network.roads[road])}
    junctions |= {
        id_ for id_, each in network.junctions.items() if not near.isdisjoint(_arms(each))
    }
    kept = near | {
        linked.id
        for road in near
        for linked in _links(network.roads[road])
        if linked.element == "road"
    }
    kept |= {
        arm for id_ in junctions & network.junctions.keys() for arm in _arms(network.junctions[id_])
    }
    kept |= {road.id for road in network.roads.values() if road.junction in junctions}
    roads = {id_: road for id_, road in network.roads.items() if id_ in kept}
    return replace(
        network,
        roads={id_: _without_links(road, roads, junctions) for id_, road in roads.items()},
        junctions={id_: each for id_, each in network.junctions.items() if id_ in junctions},
        issues=(),
    )


def _links(road: Road) -> Iterator[RoadLink]:
    yield from (link for link in (road.predecessor, road.successor) if link is not None)


def _junctions_of(road: Road) -> Iterator[str]:
    if road.junction:
        yield road.junction
    yield from (link.id for link in _links(road) if link.element == "junction")


def _arms(junction: Junction) -> set[str]:
    """Ids of the roads that a junction names."""
    named = {junction.main_road, *(segment.road for segment in junction.boundary)}
    for each in junction.connections:
        named |= {each.incoming_road, each.connecting_road}
    return named - {""}


def _without_links(road: Road, roads: Mapping[str, Road], junctions: Collection[str]) -> Road:
    """A road without links to what is not kept."""

    def kept(link: RoadLink | None) -> RoadLink | None:
        known = link is not None and link.id in (roads if link.element == "road" else junctions)
        return link if known else None

    ends = kept(road.predecessor), kept(road.successor)
    if ends == (road.predecessor, road.successor):
        return road
    return replace(road, predecessor=ends[0], successor=ends[1])
