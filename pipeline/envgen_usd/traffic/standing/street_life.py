"""Actors that stand still in a chunk: the order in which they take their places."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from envgen_usd.chunks import Chunk
from envgen_usd.errors import Issue, Severity
from envgen_usd.geometry.square_index import are_near
from envgen_usd.models.actor_rules import ActorRules
from envgen_usd.models.array_types import BoolArray, FloatArray
from envgen_usd.models.city_model import City, Placement
from envgen_usd.models.ground import GroundMesh
from envgen_usd.models.landuse import Plot
from envgen_usd.models.parked_actors import Looks, ParkedActor
from envgen_usd.models.road_surface import LaneLine
from envgen_usd.traffic.standing.free_stretches import KeptClear, Roadside
from envgen_usd.traffic.standing.kerb_lines import kerb_lines
from envgen_usd.traffic.standing.kerb_objects import bicycles_at_racks, bins_at_kerbs
from envgen_usd.traffic.standing.kerbside_parking import lines_with_rows, park_along_roads
from envgen_usd.traffic.standing.off_street_parking import (
    garage_doors,
    park_in_bays,
    park_in_car_parks,
    park_on_driveways,
    park_on_yards,
)
from envgen_usd.traffic.standing.standing_actors import Candidates, Pavement, gathered
from envgen_usd.traffic.standing.standing_people import people_on_sidewalks, people_who_wait
from envgen_usd.traffic.standing.standing_surface import StandingSurface, ground_triangles
from envgen_usd.traffic.standing.street_facts import StreetFacts

NEAR = 20.0
"""Metres around a chunk within which places keep its kerbs clear."""
_SIGN = "street_sign"
"""Kind of small signs on posts at the kerb."""
_SIGN_REACH = 4.0
"""Metres from a kerb or the middle of a parking lane within which signs belong to it."""
_MUCH, _LEAST = 0.6, 10
"""Share of the actors of a place without room that gives an issue, and their least number."""


@dataclass(frozen=True)
class Street:
    """What the actors of a chunk follow from.

    Attributes:
        chunk: The tile.
        facts: Streets of the map.
        lanes: Lanes in the chunk and near it.
        road: Triangles of the roads near the chunk, T x 3 x 3, metres.
        ground: Ground of the chunk.
        city: City of the chunk.
        obstacles: What stands in the chunk, in plan.
        plots: Plots in the chunk and those that reach into it.
        looks: Looks by kind.
        seed: The user's seed.
    """

    chunk: Chunk
    facts: StreetFacts
    lanes: Sequence[LaneLine]
    road: FloatArray
    ground: GroundMesh
    city: City
    obstacles: Sequence[shapely.Geometry]
    plots: Sequence[Plot]
    looks: Looks
    seed: int


def place_actors(
    street: Street, rules: ActorRules
) -> tuple[tuple[ParkedActor, ...], tuple[Issue, ...]]:
    """Returns the actors of a chunk, and issues where many had no room.

    Vehicles come first; people and bins then take what is left. An actor that touches an object or
    another actor, or has no firm ground below all of its corners, is left out.

    Args:
        street: The chunk.
        rules: The environment.
    """
    pavement = Pavement(
        street.chunk,
        StandingSurface(street.road),
        lambda: StandingSurface(ground_triangles(street.ground)),
        street.obstacles,
    )
    for candidates in gathered(_candidates(street, rules)):
        pavement.add(candidates)
    found = Counter(actor.place for actor in pavement.actors)
    issues = tuple(
        _crowded(street.chunk, place, wanted, wanted - found[place])
        for place, wanted in sorted(pavement.wanted.items())
        if wanted - found[place] >= max(_LEAST, _MUCH * wanted)
    )
    return tuple(pavement.actors), issues


def signs_beside_rows(street: Street, rules: ActorRules) -> frozenset[str]:
    """Ids of the small signs at kerbs and parking lanes where vehicles may park.

    The face of such a sign is drawn for the stage, after vehicles have their places; it has to
    allow what they do. Whether vehicles park at a kerb does not depend on the chunk.

    Args:
        street: The chunk.
        rules: The environment.
    """
    lines = kerb_lines(street.lanes, street.facts)
    rows = [
        shapely.LineString(line.points[:, :2])
        for line in lines_with_rows(lines, rules, street.looks, street.seed)
    ]
    signs = [
        (feature.id, feature.placement.position[:2])
        for feature in street.city.walk()
        if feature.placement is not None and feature.placement.template == _SIGN
    ]
    if not rows or not signs:
        return frozenset()
    points = shapely.points(np.array([place for _, place in signs]))
    near = shapely.STRtree(points).query(rows, predicate="dwithin", distance=_SIGN_REACH)[1]
    return frozenset(signs[number][0] for number in near.tolist())


def _candidates(street: Street, rules: ActorRules) -> Iterator[Candidates]:
    facts, looks, seed = street.facts, street.looks, street.seed
    lines = list(kerb_lines(street.lanes, facts))
    doors = garage_doors(street.city)
    roadside = Roadside(street.chunk, facts, _kept_clear(street, doors), street.obstacles)
    yield from park_in_bays(_bays(street), rules.bays, looks, seed)
    yield from park_along_roads(lines, roadside, rules, looks, seed)
    yield from park_on_driveways(doors, rules.lots, looks, seed)
    yield from park_in_car_parks(street.plots, rules.lots, looks, seed)
    yield from park_on_yards(street.plots, rules, looks, seed)
    yield from bicycles_at_racks(_placed(street.city, "bicycle_rack"), rules.kerbside, looks, seed)
    stops = _placed(street.city, "bus_stop")
    yield from people_who_wait(_crossings(street), stops, rules.people, looks, seed)
    yield from people_on_sidewalks(street.lanes, rules.people, looks, seed)
    yield from bins_at_kerbs(lines, rules.kerbside, looks, seed)


def _kept_clear(street: Street, doors: FloatArray) -> list[KeptClear]:
    """Places beside which kerbs stay free; see `kerb_lines` for the distances."""
    facts = street.facts
    crossings = [_edges(corners) for corners in _crossings(street)]
    stops = [place.position[:2] for place in _placed(street.city, "bus_stop")]
    lights = [place.position[:2] for place in _placed(street.city, "traffic_light")]
    return [
        KeptClear(np.concatenate([np.empty((0, 2)), *crossings]), 0.8, 5.0, 1.0),
        KeptClear(np.concatenate([facts.lights, np.array(lights).reshape(-1, 2)]), 4.0, 10.0, 1.0),
        KeptClear(facts.no_stopping, _SIGN_REACH, 0.0, np.inf),
        KeptClear(np.array(stops).reshape(-1, 2), 5.0, 15.0, 15.0),
        KeptClear(doors[:, :2], 14.0, 2.2, 2.2),
    ]


def _edges(corners: FloatArray) -> FloatArray:
    """Points around a rectangle, at most 0.5 m apart for one as long as 20 m; N x 2."""
    share = np.linspace(0.0, 1.0, 40, endpoint=False)[:, None, None]
    after = np.roll(corners, -1, axis=0)
    points: FloatArray = (corners + share * (after - corners)).reshape(-1, 3)[:, :2]
    return points


def _bays(street: Street) -> dict[str, FloatArray]:
    """Parking spaces of the road file near the chunk."""
    bays = street.facts.bays
    near = _are_near(list(bays.values()), street.chunk)
    return {name: bay for (name, bay), is_near in zip(bays.items(), near, strict=True) if is_near}


def _crossings(street: Street) -> list[FloatArray]:
    """Crosswalks near the chunk."""
    crossings = street.facts.crossings
    near = _are_near(crossings, street.chunk)
    return [corners for corners, is_near in zip(crossings, near, strict=True) if is_near]


def _are_near(rectangles: Sequence[FloatArray], chunk: Chunk) -> BoolArray:
    middles = np.array([corners[:, :2].mean(axis=0) for corners in rectangles]).reshape(-1, 2)
    return are_near(middles, chunk.bounds, NEAR)


def _placed(city: City, template: str) -> list[Placement]:
    """Placements of a kind of asset in a city."""
    placements = (feature.placement for feature in city.walk())
    return [place for place in placements if place is not None and place.template == template]


def _crowded(chunk: Chunk, place: str, wanted: int, lost: int) -> Issue:
    text = f"{lost} of {wanted} actors of the place '{place}' have no room or no level ground"
    return Issue("actors.no_room", Severity.INFO, f"chunk[{chunk.name}]/Actors", text, "left out")
