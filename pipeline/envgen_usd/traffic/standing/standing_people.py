"""People on sidewalks, at crossings and at bus stops."""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from envgen_usd.models.actor_rules import PeopleRules
from envgen_usd.models.array_types import BoolArray, FloatArray, IntArray
from envgen_usd.models.city_model import Placement
from envgen_usd.models.distribution import drawn
from envgen_usd.models.parked_actors import ActorLook, Looks
from envgen_usd.models.road_surface import LaneLine
from envgen_usd.seeds import generator
from envgen_usd.traffic.standing.standing_actors import Candidates, LookDraw

WALKS = frozenset({"sidewalk", "walking"})
"""Types of lanes with people."""
PERSON = "pedestrian"
"""Kind of their assets."""
_POSE = "pose"
"""Variant set of their postures."""
_WALKING, _STANDING = ("walk", "roll"), ("stand", "wait")
"""How the names of postures begin; people who sit need a seat, and are left out."""
_ABREAST = 0.75
"""Metres between two people of a group who walk abreast."""
_CIRCLE = 0.55
"""Metres from the middle of a group that stands together to each of its people."""
_BORDER = 0.45
"""Metres from the border of a sidewalk to the nearest people."""
_MOST = 60
"""Largest number of groups of a lane for each 100 m; bounds the number of draws."""


def people_on_sidewalks(
    lanes: Iterable[LaneLine], rules: PeopleRules, looks: Looks, seed: int
) -> Iterator[Candidates]:
    """Yields the people of sidewalks; those of a lane depend on the seed and the lane alone.

    Args:
        lanes: Lanes; people are on sidewalks outside of junctions.
        rules: The environment.
        looks: Looks by kind.
        seed: The user's seed.
    """
    walking, standing = postures(looks)
    numbers = np.array([int(size) for size in rules.groups])
    weights = np.array(list(rules.groups.values()))
    mean = float(numbers @ weights) / max(float(weights.sum()), 1e-9)
    for lane in lanes:
        if lane.lane_type not in WALKS or lane.junction or len(lane.points) < 2 or not mean:
            continue
        rng = generator(seed, "actors", "people", lane.id)
        s = _arc_length(lane.points)
        wanted = float(drawn(rng, rules.density)) * s[-1] / 100.0 / mean
        count = min(int(wanted + rng.random()), int(_MOST * s[-1] / 100.0))
        shares = rng.random((count, 5))
        sizes = numbers[_drawn_rows(shares[:, 0], weights)]
        walks = shares[:, 1] < rules.walking
        group = np.repeat(np.arange(count), sizes)
        member = np.arange(len(group)) - np.repeat(np.cumsum(sizes) - sizes, sizes)
        places, along = _middles(lane, s, shares[:, 2], shares[:, 3])
        direction = along + np.pi * (shares[:, 4] < 0.5)
        offsets, headings = _members(sizes, group, member, direction, walks, rng)
        spots = places[group]
        spots[:, :2] += offsets
        draw = rng.random(len(group))
        for chosen, people, name in ((walks, walking, "walking"), (~walks, standing, "standing")):
            rows = np.flatnonzero(chosen[group])
            if people and len(rows):
                ids = [
                    f"{name}_{lane.id}_{g}_{m}"
                    for g, m in zip(group[rows], member[rows], strict=True)
                ]
                yield Candidates(
                    ids,
                    people.at(draw[rows]),
                    spots[rows],
                    headings[rows],
                    "sidewalk",
                    upright=True,
                )


def postures(looks: Looks) -> tuple[LookDraw, LookDraw]:
    """Looks of people who walk, and of people who stand; assets without postures do both."""
    people = looks.get(PERSON, ())
    walking, standing = (
        LookDraw({PERSON: 1.0}, {PERSON: tuple(p for p in people if _has_pose(p, starts))})
        for starts in (_WALKING, _STANDING)
    )
    return walking, standing


def _has_pose(look: ActorLook, starts: tuple[str, ...]) -> bool:
    return _POSE not in look.selections or look.selections[_POSE].startswith(starts)


def people_who_wait(
    crossings: Sequence[FloatArray],
    stops: Iterable[Placement],
    rules: PeopleRules,
    looks: Looks,
    seed: int,
) -> Iterator[Candidates]:
    """Yields the people who wait at crossings, and those who wait at stops.

    Args:
        crossings: Corners of each crosswalk, 4 x 3, metres.
        stops: Shelters of bus stops; +x is their front.
        rules: The environment.
        looks: Looks by kind.
        seed: The user's seed.
    """
    _, standing = postures(looks)
    if not standing:
        return
    for corners in crossings:
        for end, inwards, half in _ends(corners):
            name = f"crossing_{_place_name(end)}"
            rng = generator(seed, "actors", name)
            count = round(float(drawn(rng, rules.crossing)))
            aside = (rng.random(count) - 0.5) * 2 * half
            back = 0.5 + 0.9 * rng.random(count)
            normal = np.array([-inwards[1], inwards[0]])
            spots = end + np.column_stack(
                [aside[:, None] * normal - back[:, None] * inwards, np.zeros(count)]
            )
            facing = float(np.arctan2(inwards[1], inwards[0])) + rng.normal(0.0, 0.3, count)
            ids = [f"{name}_{number}" for number in range(count)]
            yield Candidates(
                ids, standing.at(rng.random(count)), spots, facing, "crossing", upright=True
            )
    for stop in stops:
        name = f"stop_{_place_name(stop.position)}"
        rng = generator(seed, "actors", name)
        count = round(float(drawn(rng, rules.stop)))
        front = np.array([np.cos(stop.heading), np.sin(stop.heading)])
        normal = np.array([-front[1], front[0]])
        along, out = (rng.random(count) - 0.5) * 5.0, 1.3 + 0.7 * rng.random(count)
        spots = stop.position + np.column_stack(
            [along[:, None] * normal + out[:, None] * front, np.zeros(count)]
        )
        facing = stop.heading + rng.normal(0.0, 0.6, count)
        ids = [f"{name}_{number}" for number in range(count)]
        yield Candidates(ids, standing.at(rng.random(count)), spots, facing, "stop", upright=True)


def _place_name(place: FloatArray) -> str:
    return f"{place[0]:.1f}_{place[1]:.1f}".replace("-", "m")


def _ends(corners: FloatArray) -> Iterator[tuple[FloatArray, FloatArray, float]]:
    """Both ends of a crosswalk: middle (3), direction onto it (2), half its width."""
    sides = np.roll(corners, -1, axis=0) - corners
    lengths = np.linalg.norm(sides[:, :2], axis=1)
    first = 0 if lengths[0] >= lengths[1] else 1
    axis = sides[first, :2] / max(lengths[first], 1e-9)
    half_width = float(lengths[1 - first]) / 2
    middle = corners.mean(axis=0)
    for sign in (-1.0, 1.0):
        end = middle + np.append(sign * axis * lengths[first] / 2, 0.0)
        yield end, -sign * axis, half_width


def _arc_length(points: FloatArray) -> FloatArray:
    steps = np.linalg.norm(np.diff(points[:, :2], axis=0), axis=1)
    return np.concatenate([[0.0], np.cumsum(steps)])


def _drawn_rows(shares: FloatArray, weights: FloatArray) -> IntArray:
    limits = np.cumsum(weights)
    rows = np.searchsorted(limits, shares * limits[-1], side="right")
    drawn_rows: IntArray = np.minimum(rows, len(weights) - 1)
    return drawn_rows


def _middles(
    lane: LaneLine, s: FloatArray, along: FloatArray, across: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Middles of groups (N x 3), and the direction of the sidewalk there (N)."""
    at = along * s[-1]
    places = np.stack([np.interp(at, s, axis) for axis in lane.points.T], axis=1)
    ends = [
        np.stack([np.interp(at + d, s, axis) for axis in lane.points.T[:2]]) for d in (-0.5, 0.5)
    ]
    step = ends[1] - ends[0]
    heading = np.arctan2(step[1], step[0])
    reach = np.maximum(np.interp(at, s, lane.width) / 2 - _BORDER, 0.0)
    aside = (2 * across - 1.0) * reach
    places[:, :2] += aside[:, None] * np.column_stack([-np.sin(heading), np.cos(heading)])
    return places, heading


def _members(  # noqa: PLR0913, PLR0917 - what a group consists of
    sizes: IntArray,
    group: IntArray,
    member: IntArray,
    direction: FloatArray,
    walks: BoolArray,
    rng: np.random.Generator,
) -> tuple[FloatArray, FloatArray]:
    """Places of people in their group (N x 2), and their headings (N).

    People who walk go abreast; those who stand look at one another, a single one at the street.
    """
    of, ahead = sizes[group], direction[group]
    aside = (member - (of - 1) / 2) * _ABREAST
    lag = rng.uniform(-0.25, 0.25, len(group)) * (of > 1)
    abreast = np.column_stack(
        [lag * np.cos(ahead) - aside * np.sin(ahead), lag * np.sin(ahead) + aside * np.cos(ahead)]
    )
    angle = ahead + 2 * np.pi * member / np.maximum(of, 1)
    radius = _CIRCLE * (of > 1) * np.maximum(of / 3.0, 1.0)
    circle = radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    together = np.where(of > 1, angle + np.pi, ahead + np.pi / 2)
    walking = walks[group]
    headings = np.where(walking, ahead, together) + rng.normal(0.0, 0.12, len(group))
    return np.where(walking[:, None], abreast, circle), headings
