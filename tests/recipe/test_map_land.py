import dataclasses
from pathlib import Path

import pytest

from envgen_usd.environment_files import read_profile
from envgen_usd.errors import EnvgenError
from envgen_usd.landuse.network.shipped_weights import find_weights
from envgen_usd.landuse.network.training.weights_file import read_target
from envgen_usd.models.distribution import Quantiles
from envgen_usd.recipe.build_options import BuildOptions
from envgen_usd.recipe.map_land import landuse_file

PROFILE = read_profile("1", "residential")
OPTIONS = BuildOptions(Path("road.xodr"), "1", "residential", Path("out"))


def test_rules_need_no_file():
    assert landuse_file(OPTIONS, PROFILE) is None


def test_a_network_has_the_weights_that_are_named(tmp_path):
    path = tmp_path / "own.safetensors"
    path.write_bytes(b"")
    options = dataclasses.replace(OPTIONS, landuse="network", landuse_network=path)
    assert landuse_file(options, PROFILE) == find_weights(path) == path


def test_learnt_environments_have_the_network_of_real_places():
    options = dataclasses.replace(OPTIONS, landuse="network")
    sizes = Quantiles((6.0, 9.0, 14.0), 40)
    plots = dataclasses.replace(PROFILE.plots, frontage=sizes)
    learnt = dataclasses.replace(PROFILE, plots=plots)
    targets = [read_target(landuse_file(options, one)) for one in (PROFILE, learnt)]
    assert targets == ["landuse", "place"]


def test_choices_that_cannot_be_used(tmp_path):
    missing = dataclasses.replace(
        OPTIONS, landuse="network", landuse_network=tmp_path / "no.safetensors"
    )
    alone = dataclasses.replace(OPTIONS, landuse_network=tmp_path)
    folder = dataclasses.replace(OPTIONS, landuse=str(tmp_path))
    neither = dataclasses.replace(OPTIONS, landuse="nature")
    for options, match in (
        (missing, "no such file"),
        (alone, "needs"),
        (neither, "neither"),
        (folder, "is a folder"),
    ):
        with pytest.raises(EnvgenError, match=match):
            landuse_file(options, PROFILE)
