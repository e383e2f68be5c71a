"""Which street is in which split: frames of a street are never in two."""

import re
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from envgen_usd.compressed_files import content_stem
from envgen_usd.errors import EnvgenError
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.road import Road, RoadNetwork
from envgen_usd.opendrive.geometry.curve_evaluation import evaluate
from envgen_usd.opendrive.reader import read_network
from envgen_usd.recipe.dataset_recipe import DatasetRecipe
from envgen_usd.seeds import generator

_LANE = re.compile(r"road_(.+)_s\d+_lane_-?\d+")
"""Begin of a lane's id on the stage, with the id of its road."""
_STEP = 5.0
"""Distance of the points of a street on the map, metres; a larger value draws coarser curves."""


@dataclass(frozen=True)
class Streets:
    """The streets of a road file.

    Attributes:
        of_road: Street of each road of the file, by id.
        lengths: Metres of reference line by street.
        lines: Reference lines of the roads, each N x 2, metres.
        splits: Split of each street.
    """

    of_road: Mapping[str, str]
    lengths: Mapping[str, float]
    lines: tuple[FloatArray, ...]
    splits: Mapping[str, str]

    def of_lane(self, lane: str) -> str:
        """Street of a lane of the stage; empty for a lane without a road of the file."""
        named = _LANE.match(lane)
        return self.of_road.get(named[1], "") if named else ""

    def split_of(self, lane: str) -> str:
        """Split of the frames on a lane; frames beside all roads are in the first."""
        return self.splits.get(self.of_lane(lane)) or next(iter(self.splits.values()))


def streets_of(network: RoadNetwork) -> dict[str, str]:
    """Returns the street of each road: its least road id.

    A street is what roads form that follow each other directly. A connecting road of a junction
    belongs to the street that leads into it.
    """
    street = {id_: id_ for id_, road in network.roads.items() if not road.junction}

    def root(id_: str) -> str:
        while street[id_] != id_:
            id_ = street[id_]
        return id_

    for id_ in street:
        for link in (network.roads[id_].predecessor, network.roads[id_].successor):
            if link is not None and link.element == "road" and link.id in street:
                low, high = sorted((root(id_), root(link.id)), key=_natural)
                street[high] = low
    found = {id_: root(id_) for id_ in street}
    return {id_: _incoming(road, network, found) for id_, road in network.roads.items()}


def _incoming(road: Road, network: RoadNetwork, street: Mapping[str, str]) -> str:
    """Street of a road, or of the first road before it that is not in a junction."""
    seen: set[str] = set()
    here: Road | None = road
    while here is not None and here.id not in street and here.id not in seen:
        seen.add(here.id)
        link = here.predecessor
        before = link if link is not None and link.element == "road" else here.successor
        is_road = before is not None and before.element == "road"
        here = network.roads.get(before.id) if before is not None and is_road else None
    return street[here.id] if here is not None and here.id in street else road.id


def _natural(text: str) -> tuple[int, str]:
    return (int(text), "") if text.isascii() and text.isdigit() else (1 << 62, text)


def share_streets(recipe: DatasetRecipe, source: Path) -> dict[str, Streets]:
    """Gives each street of all roads a split; returns the streets by name of the road file.

    Long streets are given first, each to the split that lacks most of its share of all metres; of
    equal streets, the seed decides. Nothing depends on which frames are drawn.

    Args:
        recipe: The recipe.
        source: Its file, for errors.

    Raises:
        EnvgenError: A road cannot be read, or a split gets no street.
    """
    networks = {
        content_stem(Path(road.file)): read_network(Path(road.file)) for road in recipe.road
    }
    of_road = {name: streets_of(network) for name, network in networks.items()}
    lengths = {name: _lengths(networks[name], of_road[name]) for name in networks}
    fixed = {content_stem(Path(road.file)): road.split for road in recipe.road if road.split}
    free = [(name, street) for name in networks if name not in fixed for street in lengths[name]]
    rng = generator(recipe.seed, "dataset", "splits")
    free = [free[index] for index in rng.permutation(len(free))]
    free.sort(key=lambda each: -lengths[each[0]][each[1]])
    given = {name: 0.0 for name, share in recipe.splits.items() if share > 0.0}
    splits: dict[str, dict[str, str]] = {
        name: dict.fromkeys(lengths[name], split) for name, split in fixed.items()
    }
    for number, (name, street) in enumerate(free):
        empty = [split for split, metres in given.items() if not metres]
        # The last streets go to splits that would stay empty.
        choice = empty if empty and len(free) - number <= len(empty) else list(given)
        chosen = max(
            choice, key=lambda split: recipe.splits[split] * _total(lengths) - given[split]
        )
        given[chosen] += lengths[name][street]
        splits.setdefault(name, {})[street] = chosen
    used = {split for each in splits.values() for split in each.values()}
    missing = [split for split, share in recipe.splits.items() if share > 0.0 and split not in used]
    if missing:
        count = "1 street is" if len(free) == 1 else f"{len(free)} streets are"
        fault = f"{count} too few for {len(given)} splits"
        raise EnvgenError(f"{source}: splits: {missing[0]} gets no street: {fault}; add a road")
    return {
        name: Streets(of_road[name], lengths[name], _lines(network), splits[name])
        for name, network in networks.items()
    }


def _lengths(network: RoadNetwork, street: Mapping[str, str]) -> dict[str, float]:
    metres: defaultdict[str, float] = defaultdict(float)
    for id_, road in network.roads.items():
        metres[street[id_]] += road.length
    return dict(sorted(metres.items(), key=lambda each: _natural(each[0])))


def _total(lengths: Mapping[str, Mapping[str, float]]) -> float:
    return sum(sum(each.values()) for each in lengths.values())


def _lines(network: RoadNetwork) -> tuple[FloatArray, ...]:
    """Reference lines for the map."""
    lines = []
    for road in network.roads.values():
        s = np.linspace(0.0, road.length, max(int(road.length / _STEP) + 2, 2))
        x, y, _ = evaluate(road.plan_view, s)
        lines.append(np.column_stack((x, y)))
    return tuple(lines)
