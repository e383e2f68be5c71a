"""Filling a hole in passes."""

from itertools import pairwise

import numpy as np
import pytest
import torch

from envgen_usd.errors import EnvgenError
from envgen_usd.landuse.network.data.class_channels import INPUT, OUTPUTS, ROAD
from envgen_usd.landuse.network.hole_filling import UNSEEN, draw_chance, fill, schedule
from envgen_usd.landuse.network.tasks.landuse_task import LanduseTask
from envgen_usd.models.landuse import LanduseClass

GRASS, WOOD = INPUT.index(LanduseClass.GRASS), INPUT.index(LanduseClass.WOOD)


class Follower:
    """Knows only that the whole land is alike: grass or wood, whichever is known of it."""

    task = LanduseTask()

    def __call__(self, known, mask, *_):
        logits = torch.full((len(known), OUTPUTS, *known.shape[2:]), -50.0)
        seen = [(known[:, channel] * mask[:, 0]).sum((1, 2)) for channel in (GRASS, WOOD)]
        for channel, count in zip((GRASS, WOOD), seen, strict=True):
            logits[:, channel - 1] = (20 * torch.sign(count))[:, None, None]
        return logits, logits


def filled(passes, seed, side=64):
    channels = np.full((1, side, side), UNSEEN, dtype=np.uint8)
    channels[0, side // 2] = ROAD
    chance = draw_chance([np.random.default_rng(seed)], (side, side), passes)
    nothing = torch.zeros(1, 1, side // 2, side // 2)
    made = fill(Follower(), channels, nothing, torch.zeros(1, 1), chance)
    assert np.all(made[0, side // 2] == ROAD)
    return np.delete(made[0], side // 2, axis=0)


class Overflow(Follower):
    """A network whose scores overflow in a single cell."""

    def __call__(self, known, mask, *_):
        scores, _ = super().__call__(known, mask)
        scores[0, 0, 0, 0] = torch.nan
        return scores, scores


def test_scores_that_are_no_numbers_are_refused():
    channels = np.full((1, 64, 64), UNSEEN, dtype=np.uint8)
    chance = draw_chance([np.random.default_rng(0)], (64, 64), ())
    nothing = torch.zeros(1, 1, 32, 32)
    with pytest.raises(EnvgenError, match="its output is not finite"):
        fill(Overflow(), channels, nothing, torch.zeros(1, 1), chance)


def test_a_single_pass_cannot_choose():
    """Both are as likely, so it makes the same of every draw."""
    assert len({filled((), seed).tobytes() for seed in range(8)}) == 1


def test_what_is_drawn_first_decides_the_rest():
    """Where only one class is drawn first, the whole map is of that class; both come up."""
    made = [np.unique(filled((1.5 / 64**2, 0.1), seed)) for seed in range(24)]
    whole = [int(classes[0]) for classes in made if len(classes) == 1]
    assert len(whole) >= 8
    assert set(whole) == {GRASS, WOOD}


def test_no_cell_is_left_and_each_draw_follows_from_its_seed():
    passes = schedule(6)
    assert not np.any(filled(passes, 1) == UNSEEN)
    assert np.array_equal(filled(passes, 1), filled(passes, 1))


@pytest.mark.parametrize("passes", [1, 2, 24])
def test_a_schedule_knows_more_from_pass_to_pass(passes):
    shares = schedule(passes)
    assert len(shares) == passes - 1
    assert all(0 < a < b < 1 for a, b in pairwise(shares))
