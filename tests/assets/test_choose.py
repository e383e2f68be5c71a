from collections import Counter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from envgen_usd.assets.asset_catalogue import read_catalogue
from envgen_usd.assets.variant_choice import Distribution, check_distribution, choose
from envgen_usd.errors import EnvgenError

LIBRARY = read_catalogue()
TREES = Distribution(
    {"tree_broadleaf": 3.0, "tree_conifer": 1.0},
    {"season": {"summer": 1.0}, "shape": {"lime": 2.0, "oak": 1.0, "birch": 1.0, "yew": 1.0}},
)


def test_follows_the_weights():
    rng = np.random.default_rng(1)
    drawn = [choose(LIBRARY, TREES, rng) for _ in range(4000)]
    names = Counter(choice.asset.name for choice in drawn)
    shapes = Counter(choice.selections["shape"] for choice in drawn)
    assert names["tree_broadleaf"] / 4000 == pytest.approx(0.75, abs=0.03)
    assert shapes["lime"] / 3000 == pytest.approx(0.5, abs=0.03)
    assert shapes["oak"] / 3000 == pytest.approx(0.25, abs=0.03)


def test_selects_a_variant_of_every_set_of_the_asset():
    choice = choose(LIBRARY, Distribution({"street_light": 1.0}, {}), np.random.default_rng(0))
    assert set(choice.selections) == {"design", "finish"}
    conifer = choose(LIBRARY, Distribution({"tree_conifer": 1.0}, TREES.variants),
                     np.random.default_rng(0))  # fmt: skip
    assert set(conifer.selections) == {"shape"}


@given(st.integers(0, 2**32), st.floats(0.1, 10.0))
def test_changing_one_weight_moves_no_other_draw(seed, weight):
    rng, other = (np.random.default_rng(seed) for _ in range(2))
    choose(LIBRARY, TREES, rng)
    assets = {"tree_broadleaf": weight, "tree_conifer": 1.0}
    choose(LIBRARY, Distribution(assets, TREES.variants), other)
    assert rng.random() == other.random()


@given(st.integers(0, 2**32))
def test_never_chooses_what_weighs_nothing(seed):
    weights = {"virginia": 0.0, "new_york": 1.0}
    distribution = Distribution({"street_light": 1.0}, {"design": weights})
    choice = choose(LIBRARY, distribution, np.random.default_rng(seed))
    assert choice.selections["design"] == "new_york"


@pytest.mark.parametrize(
    ("distribution", "message"),
    [
        (
            Distribution({"oak": 1.0}, {}),
            r"x\.toml: trees\.assets: unknown asset 'oak'; known: .*tree",
        ),
        (Distribution({"tree_conifer": 0.0}, {}), "no asset has a weight above 0"),
        (
            Distribution({"tree_conifer": 1.0}, {"leaf": {"a": 1.0}}),
            "unknown variant set 'leaf' of tree_conifer; known: shape",
        ),
        (
            Distribution({"tree_conifer": 1.0}, {"shape": {"square": 1.0}}),
            r"trees\.variants\.shape: unknown variant 'square'; known: cypress, fir, pine",
        ),
    ],
)
def test_names_what_is_unknown_and_what_is_known(distribution, message):
    with pytest.raises(EnvgenError, match=message):
        check_distribution(LIBRARY, distribution, "x.toml: trees")
