"""Index from ids to XML elements."""

from collections.abc import Iterator
from dataclasses import dataclass

from envgen_usd.models.lanes import LaneSection
from envgen_usd.opendrive.document.findings import Element
from envgen_usd.opendrive.elements.lane_element import lane_id


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
        """Creates the index of a file with unique road and junction ids."""
        return Index(
            root,
            {road.get("id", ""): road for road in root.iterchildren("road")},
            {junction.get("id", ""): junction for junction in root.iterchildren("junction")},
        )

    def geometry(self, road: str, number: int) -> Element:
        """Returns a geometry of a road's plan view, counted from 0."""
        return next(_skip(self.roads[road].iterfind("planView/geometry"), number))

    def section(self, road: str, number: int) -> Element:
        """Returns a lane section of a road's permanent layer, counted from 0."""
        lanes = self.roads[road].iterchildren("lanes")
        permanent = next(each for each in lanes if each.get("layer", "permanent") == "permanent")
        return next(_skip(permanent.iterchildren("laneSection"), number))

    def lane(self, road: str, section: int, id_: int) -> Element:
        """Returns a lane of a road's permanent layer, also if it continues a previous section.

        Raises:
            LookupError: Neither the section nor a previous one has the lane.
        """
        for number in range(section, -1, -1):
            element = self.lane_in_section(road, number, id_)
            if element is not None:
                return element
        raise LookupError(f"road {road}: no lane {id_} up to lane section {section}")

    def lane_in_section(self, road: str, section: int, id_: int) -> Element | None:
        """Returns a lane in its section; `None` for a lane that continues the previous section."""
        for side in self.section(road, section).iterchildren("left", "center", "right"):
            for lane in side.iterchildren("lane"):
                if lane_id(lane.get("id", "")) == id_:
                    return lane
        return None


def lane_ids(section: LaneSection) -> set[int]:
    """Returns the ids of all lanes of a section."""
    return {lane.id for lane in (*section.left, section.centre, *section.right)}


def _skip(elements: Iterator[Element], number: int) -> Iterator[Element]:
    for _ in range(number):
        next(elements)
    return elements
