"""From ids to the elements that a finding is about."""

from collections.abc import Iterator
from dataclasses import dataclass

from envgen_usd.models.lanes import LaneSection
from envgen_usd.opendrive.findings import Element


@dataclass(frozen=True)
class Index:
    """Elements of a file by id.

    Attributes:
        root: The OpenDRIVE element.
        roads: Road elements by road id.
        junctions: Junction elements by junction id.
    """

    root: Element
    roads: dict[str, Element]
    junctions: dict[str, Element]

    @staticmethod
    def of(root: Element) -> "Index":
        """Index of a file whose roads and junctions have unique ids."""
        return Index(
            root,
            {road.get("id", ""): road for road in root.iterchildren("road")},
            {junction.get("id", ""): junction for junction in root.iterchildren("junction")},
        )

    def geometry(self, road: str, number: int) -> Element:
        """Geometry of a road's plan view, counted from 0."""
        return next(_skip(self.roads[road].iterfind("planView/geometry"), number))

    def section(self, road: str, number: int) -> Element:
        """Lane section of a road's permanent layer, counted from 0."""
        lanes = self.roads[road].iterchildren("lanes")
        permanent = next(each for each in lanes if each.get("layer", "permanent") == "permanent")
        return next(_skip(permanent.iterchildren("laneSection"), number))

    def lane(self, road: str, section: int, id_: int) -> Element:
        """Lane of a road's permanent layer, also one that goes on from a section before."""
        found = self.own_lane(road, section, id_)
        return self.lane(road, section - 1, id_) if found is None else found

    def own_lane(self, road: str, section: int, id_: int) -> Element | None:
        """Lane in its own section; none where it goes on from the one before (singleSide)."""
        for side in self.section(road, section).iterchildren("left", "center", "right"):
            for lane in side.iterchildren("lane"):
                if float(lane.get("id", "0")) == id_:
                    return lane
        return None


def lane_ids(section: LaneSection) -> set[int]:
    """Ids of all lanes of a section."""
    return {lane.id for lane in (*section.left, section.centre, *section.right)}


def _skip(elements: Iterator[Element], number: int) -> Iterator[Element]:
    for _ in range(number):
        next(elements)
    return elements
