"""Bicycles beside racks, and wheeled bins at kerbs."""

from collections.abc import Iterable, Iterator

import numpy as np

from envgen_usd.models.actor_rules import KerbObjectRules
from envgen_usd.models.city_model import Placement
from envgen_usd.models.distribution import drawn
from envgen_usd.models.parked_actors import Looks
from envgen_usd.seeds import generator
from envgen_usd.traffic.standing.kerb_lines import KerbLine
from envgen_usd.traffic.standing.standing_actors import Candidates, LookDraw

BICYCLE, BIN = "bicycle", "wheelie_bin"
"""Kinds of their assets."""
_FIRST, _STEP = 1.35, 0.65
"""Metres from the middle of a rack to the nearest bicycle beside it, and between bicycles."""
_BIN_STEP = 0.72
"""Metres between the bins of a group."""
_BEHIND_KERB = 0.65
"""Metres from the kerb to the middle of a bin."""
_END = 6.0
"""Metres at the ends of a kerb without bins."""


def bicycles_at_racks(
    racks: Iterable[Placement], rules: KerbObjectRules, looks: Looks, seed: int
) -> Iterator[Candidates]:
    """Yields bicycles on both sides of each rack, in line with those in it.

    Args:
        racks: Bicycle racks; bicycles stand along their x.
        rules: The environment.
        looks: Looks by kind.
        seed: The user's seed.
    """
    bicycles = LookDraw({BICYCLE: 1.0}, looks)
    for rack in racks if bicycles else ():
        name = f"{rack.position[0]:.1f}_{rack.position[1]:.1f}".replace("-", "m")
        rng = generator(seed, "actors", "rack", name)
        count = round(float(drawn(rng, rules.bicycles)))
        number = np.arange(count)
        aside = (_FIRST + _STEP * (number // 2)) * np.where(number % 2, -1.0, 1.0)
        across = np.array([-np.sin(rack.heading), np.cos(rack.heading), 0.0])
        headings = rack.heading + np.pi * (rng.random(count) < 0.4) + rng.normal(0.0, 0.08, count)
        ids = [f"rack_{name}_{each}" for each in number.tolist()]
        places = rack.position + aside[:, None] * across
        yield Candidates(ids, bicycles.at(rng.random(count)), places, headings, "rack")


def bins_at_kerbs(
    lines: Iterable[KerbLine], rules: KerbObjectRules, looks: Looks, seed: int
) -> Iterator[Candidates]:
    """Yields groups of wheeled bins behind kerbs, with their front to the road.

    Args:
        lines: Kerbs.
        rules: The environment.
        looks: Looks by kind.
        seed: The user's seed.
    """
    bins = LookDraw({BIN: 1.0}, looks)
    for line in lines if bins and rules.bins > 0.0 else ():
        if line.kind != "kerb" or line.walk <= 2 * _BEHIND_KERB:
            continue
        rng = generator(seed, "actors", "bins", line.lane.id)
        count = int(line.s[-1] / rules.bins + rng.random())
        first = rng.uniform(_END, max(line.s[-1] - _END, _END), count)
        sizes = np.rint(drawn(rng, rules.bin_group, count)).astype(np.int64)
        group = np.repeat(np.arange(count), sizes)
        member = np.arange(len(group)) - np.repeat(np.cumsum(sizes) - sizes, sizes)
        points, along = line.at(first[group] + member * _BIN_STEP)
        normal = line.outward * np.column_stack([-np.sin(along), np.cos(along)])
        points[:, :2] += normal * (_BEHIND_KERB + rng.uniform(-0.08, 0.08, len(group)))[:, None]
        headings = along - line.outward * np.pi / 2 + rng.normal(0.0, 0.12, len(group))
        pairs = zip(group.tolist(), member.tolist(), strict=True)
        ids = [f"bin_{line.lane.id}_{g}_{m}" for g, m in pairs]
        yield Candidates(ids, bins.at(rng.random(len(group))), points, headings, "sidewalk")
