"""Counts of real streets become weights and spacings of an environment."""

import shutil
import tomllib
from importlib import resources
from pathlib import Path

import numpy as np
import pytest

from envgen_usd.errors import EnvgenError
from envgen_usd.recipe.environment_edits import (
    asset_weight,
    edited_environment,
    library_of,
    variant_weight,
    write_environment,
)
from envgen_usd.recipe.learned_environment import learned_edits

SHIPPED = Path(str(resources.files("envgen_usd.asset_library")))
HEAD = "kind,variant,count,spacing,area\n"


@pytest.fixture
def file(tmp_path):
    """A copy of an environment; its library is the shipped one."""
    folder = tmp_path / "environments" / "country_1"
    folder.mkdir(parents=True)
    shutil.copy(SHIPPED / "environments/country_1/residential.toml", folder)
    return folder / "residential.toml"


def learned(file, rows, smoothing=1.0):
    """The environment's file after learning, and its text."""
    counts = file.parent / "counts.csv"
    counts.write_text(HEAD + rows)
    write_environment(file, learned_edits(counts, file, smoothing), library_of(file))
    text = file.read_text()
    return tomllib.loads(text), text


def test_shares_are_those_of_the_counts(file):
    data, _ = learned(file, "bin,pillar,30,,\nbin,round,10,,\nbin,post,0,,\n", smoothing=0.0)
    found = data["props"]["bin"]["variants"]["design"]
    assert found == {"pillar": 0.75, "post": 0.0, "round": 0.25}


def test_smoothing_is_laplace(file):
    data, _ = learned(file, "bin,design=pillar,30,,\nbin,design=round,10,,\n")
    found = data["props"]["bin"]["variants"]["design"]
    expected = {"pillar": 31 / 43, "round": 11 / 43, "post": 1 / 43}
    assert found == pytest.approx(expected, abs=1e-4)


def test_drawn_counts_give_back_their_shares(file):
    """Many draws of known weights: the fit finds them."""
    rng = np.random.default_rng(3)
    weights = {"lime": 0.6, "plane": 0.3, "oak": 0.1}
    drawn = rng.choice(list(weights), size=20_000, p=list(weights.values()))
    rows = "".join(f"street_tree,{name},{(drawn == name).sum()},,\n" for name in weights)
    data, _ = learned(file, rows, smoothing=0.0)
    found = data["street_trees"]["variants"]["shape"]
    assert {name: found[name] for name in weights} == pytest.approx(weights, abs=0.01)
    assert sum(found.values()) == pytest.approx(1.0, abs=1e-3)


def test_spacings_and_densities_follow_the_survey(file):
    rows = (
        "bin,,30,80,\nbin,,10,120,\ntree,,52,,20000\nstreet_light,,9,25,\nstreet_light,,4,31,\n"
        "hydrant,,7,350,\n"
    )
    data, _ = learned(file, rows)
    assert data["furniture"]["bin"] == pytest.approx((30 * 80 + 10 * 120) / 40)
    assert data["furniture"]["hydrant"] == 350
    assert data["trees"]["density"] == pytest.approx(26.0)
    assert data["street_lights"]["spacing"] == [25.0, 31.0]


def test_a_single_spacing_keeps_the_relative_range(file):
    before = tomllib.loads(file.read_text())["street_trees"]["spacing"]
    data, _ = learned(file, "street_tree,,50,10,\n")
    low, high = data["street_trees"]["spacing"]
    assert (low + high) / 2 == pytest.approx(10.0)
    assert high / low == pytest.approx(before[1] / before[0], rel=1e-3)


def test_the_rest_of_the_file_stays(file):
    before = file.read_text().splitlines()
    _, text = learned(file, "hydrant,squat,3,,\n")
    assert [line for line in before if line not in text.splitlines()] == []
    assert "# Country 1, residential" in text


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        ("rocket,,3,,\n", "line 2: the library has no asset of the kind 'rocket'"),
        ("bin,pillar,3,,\nbin,cube,3,,\n", "line 3: unknown variant 'cube' of bin"),
        ("bin,pillar,-3,,\n", "line 2: count"),
        ("bin,pillar,2.5,,\n", "line 2: count"),
        ("bin,,2,0,\n", "line 2: spacing"),
        ("bench,,2,,50\n", "area is for the kind 'tree'"),
        ("barrel,,2,50,\n", "barrel has no spacing"),
        (",pillar,2,,\n", "line 2: kind is missing"),
        ("", "holds no counts"),
        ("bin,,1,0.5,\n", "furniture"),
    ],
)
def test_what_does_not_fit_is_named_and_changes_nothing(rows, said, file):
    before = file.read_bytes()
    with pytest.raises(EnvgenError) as error:
        learned(file, rows)
    assert said in str(error.value)
    assert file.read_bytes() == before


def test_another_header_is_refused(file):
    counts = file.parent / "counts.csv"
    counts.write_text("what,how many\nbin,3\n")
    with pytest.raises(EnvgenError, match="line 1: expected the columns kind,variant,count"):
        learned_edits(counts, file)


def test_a_weight_is_added_beside_the_present_ones(file):
    catalogue = library_of(file)
    write_environment(file, [variant_weight(file, "bin", "colour", "red", 2.0)], catalogue)
    data = tomllib.loads(file.read_text())
    colours = {"black": 4.0, "green": 1.0, "grey": 1.0, "red": 2.0}
    assert data["props"]["bin"]["variants"]["colour"] == colours
    # A set without weights keeps its default at 1.
    write_environment(file, [variant_weight(file, "hydrant", "design", "squat", 3.0)], catalogue)
    data = tomllib.loads(file.read_text())
    assert data["props"]["hydrant"]["variants"]["design"] == {"pillar": 1.0, "squat": 3.0}
    write_environment(file, [asset_weight(file, "tree_conifer", 5.0)], catalogue)
    data = tomllib.loads(file.read_text())
    assert data["trees"]["assets"] == {"tree_broadleaf": 3.0, "tree_conifer": 5.0}


def test_weights_that_nothing_would_read_are_named(file):
    """Trees have a table of their own: weights below props would have no effect."""
    text = file.read_text() + "\n[props.tree]\nassets = { tree_conifer = 1.0 }\n"
    file.write_text(text)
    with pytest.raises(EnvgenError, match=r"props\.tree.*write its weights in \[trees\]"):
        edited_environment(file, [], library_of(file))
