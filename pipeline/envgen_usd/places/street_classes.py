"""What a street is like where its tags do not say: figures by class of street and by country."""

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class StreetClass:
    """Figures of a value of the tag ``highway``.

    Attributes:
        rank: Importance; traffic of a higher rank has priority.
        lanes: Lanes of a street with traffic both ways.
        one_way: Lanes of a one-way street.
        lane_width: Metres.
        speed: Speed limit in towns, km/h.
        sidewalk: Width of a sidewalk in towns, metres; 0: none.
        shoulder: Width of a paved shoulder outside of towns, metres; 0: none.
        lined: True where a line parts the directions.
        implied_one_way: True where the class is one-way without a tag.
        parked_lane: Width of a lane where vehicles park on the carriageway of a town, metres; 0:
            they do not.
    """

    rank: int
    lanes: int
    one_way: int
    lane_width: float
    speed: int
    sidewalk: float = 0.0
    shoulder: float = 0.0
    lined: bool = True
    implied_one_way: bool = False
    parked_lane: float = 0.0


CLASSES: Mapping[str, StreetClass] = {
    "motorway": StreetClass(7, 4, 2, 3.75, 130, shoulder=2.5, implied_one_way=True),
    "motorway_link": StreetClass(4, 2, 1, 3.75, 80, shoulder=1.5, implied_one_way=True),
    "trunk": StreetClass(6, 2, 2, 3.5, 100, shoulder=1.0),
    "trunk_link": StreetClass(4, 2, 1, 3.5, 60, shoulder=0.5),
    "primary": StreetClass(5, 2, 2, 3.5, 50, sidewalk=2.5, shoulder=0.5),
    "primary_link": StreetClass(4, 2, 1, 3.5, 50, shoulder=0.5),
    "secondary": StreetClass(4, 2, 2, 3.25, 50, sidewalk=2.5, shoulder=0.5),
    "secondary_link": StreetClass(3, 2, 1, 3.25, 50, shoulder=0.5),
    "tertiary": StreetClass(3, 2, 1, 3.0, 50, sidewalk=2.25, shoulder=0.25),
    "tertiary_link": StreetClass(2, 2, 1, 3.0, 50),
    "unclassified": StreetClass(2, 2, 1, 2.75, 50, sidewalk=2.0, lined=False),
    "residential": StreetClass(1, 2, 1, 2.75, 30, sidewalk=2.0, lined=False, parked_lane=2.25),
    "living_street": StreetClass(0, 2, 1, 2.5, 10, lined=False),
    "road": StreetClass(1, 2, 1, 2.75, 50, lined=False),
}
"""Streets for motor vehicles, after RASt 06 and RAL; others are ways of the land."""
WIDER: Mapping[str, float] = {"2": 1.15}
"""Factor of lane widths by country; wider where larger vehicles are usual."""
ONE_LANE_ONE_WAY = 3.5
"""Width of the only lane of a one-way street, metres; vehicles pass what stands at its side."""
ONE_LANE_BOTH_WAYS = 4.0
"""Width of the only lane for both directions, metres."""
CYCLE_LANE = 1.6
"""Width of a cycle lane or track without a tagged width, metres."""
PARKING: Mapping[str, float] = {"parallel": 2.0, "diagonal": 4.5, "perpendicular": 5.0}
"""Width of a parking lane by the tagged orientation, metres."""
