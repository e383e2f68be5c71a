"""The part of a road network near a place, complete enough that its surface there is the map's."""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import replace

import numpy as np

from envgen_usd.geometry.square_index import Bounds
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.junctions import Junction
from envgen_usd.models.road import Road, RoadLink, RoadNetwork


class NetworkWindows:
    """A road network of which parts are taken.

    The time follows the size of a part, but for a comparison with the boxes of all roads.
    """

    def __init__(self, network: RoadNetwork, boxes: FloatArray) -> None:
        """Finds which roads and junctions name each other.

        Args:
            network: Content of a road file.
            boxes: Boxes around its roads (`ReferenceSamples`), R x 4, metres.
        """
        self._network, self._boxes = network, boxes
        self._roads = list(network.roads.values())
        self._order = {id_: number for number, id_ in enumerate(network.roads)}
        self._places = {id_: number for number, id_ in enumerate(network.junctions)}
        self._arms = {id_: _arms(junction) for id_, junction in network.junctions.items()}
        self._named_by: dict[str, list[str]] = {}
        for id_, arms in self._arms.items():
            for arm in arms:
                self._named_by.setdefault(arm, []).append(id_)
        self._members: dict[str, list[str]] = {}
        for road in self._roads:
            self._members.setdefault(road.junction, []).append(road.id)

    def near(self, bounds: Bounds) -> RoadNetwork:
        """The roads in a rectangle, with all that their surface and their lanes depend on.

        1. Roads whose boxes touch the rectangle are kept whole.
        2. Their junctions are kept whole, with all roads that meet there.
        3. So are the roads that they are linked to. Links of further roads are dropped.

        Args:
            bounds: The rectangle, metres.

        Returns:
            Roads and junctions in the file's order, without the issues of the file; the network
            itself where all roads are kept.
        """
        low, high = self._boxes[:, :2], self._boxes[:, 2:]
        touches = np.all((low <= bounds[2:]) & (high >= bounds[:2]), axis=1)
        if touches.all():
            return self._network
        near = [self._roads[number] for number in np.flatnonzero(touches).tolist()]
        junctions = {id_ for road in near for id_ in _junctions_of(road)}
        junctions.update(*(self._named_by.get(road.id, ()) for road in near))
        kept = {road.id for road in near}
        kept |= {link.id for road in near for link in _links(road) if link.element == "road"}
        kept.update(*(self._arms.get(id_, ()) for id_ in junctions))
        kept.update(*(self._members.get(id_, ()) for id_ in junctions))
        found = sorted(kept & self._order.keys(), key=self._order.__getitem__)
        roads = {id_: self._network.roads[id_] for id_ in found}
        known = sorted(junctions & self._places.keys(), key=self._places.__getitem__)
        return replace(
            self._network,
            roads={id_: _without_links(road, roads, junctions) for id_, road in roads.items()},
            junctions={id_: self._network.junctions[id_] for id_ in known},
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
