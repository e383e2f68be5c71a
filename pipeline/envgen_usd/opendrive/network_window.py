"""The part of a road network near a place, complete enough that its surface there is the map's."""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import replace

import numpy as np

from envgen_usd.geometry.square_index import Bounds
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.junctions import Junction
from envgen_usd.models.road import Road, RoadLink, RoadNetwork


def network_near(network: RoadNetwork, boxes: FloatArray, bounds: Bounds) -> RoadNetwork:
    """The roads in a rectangle, with all that their surface and their lanes depend on.

    1. Roads whose boxes touch the rectangle are kept whole.
    2. Their junctions are kept whole, with all roads that meet there.
    3. So are the roads that they are linked to. Links of further roads are dropped.

    Args:
        network: Content of a road file.
        boxes: Boxes around its roads (`ReferenceSamples`), R x 4, metres.
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
