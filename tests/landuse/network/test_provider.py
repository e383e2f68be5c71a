from dataclasses import replace

import numpy as np
import pytest
import torch

from envgen_usd.chunks import Chunk
from envgen_usd.environment_files import read_profile
from envgen_usd.errors import EnvgenError
from envgen_usd.landuse.landuse_rules import RuleProvider
from envgen_usd.landuse.network.class_repair import repair
from envgen_usd.landuse.network.data.class_channels import BORDER, INPUT, ROAD
from envgen_usd.landuse.network.data.environment_conditions import CONDITIONS
from envgen_usd.landuse.network.data.known_fields import FIELDS
from envgen_usd.landuse.network.data.road_layouts import draw_layout
from envgen_usd.landuse.network.model.generator import make_generator
from envgen_usd.landuse.network.model.network_config import NetworkConfig
from envgen_usd.landuse.network.network_provider import NetworkProvider
from envgen_usd.landuse.network.training.weights_file import write_weights
from envgen_usd.models.landuse import LanduseClass

TINY = NetworkConfig(
    FIELDS, CONDITIONS, head=(8, 8, 8), dim=8, heads=2, style=8, mapping=1, refine=(8, 8, 8, 8)
)
CHUNKS = [Chunk(0, 0), Chunk(1, 0), Chunk(0, 1)]
GRASS, LAWN = INPUT.index(LanduseClass.GRASS), INPUT.index(LanduseClass.LAWN)


@pytest.fixture(scope="module", params=["mat", "diffusion"])
def provider(tmp_path_factory, request):
    torch.manual_seed(0)
    path = tmp_path_factory.mktemp("network") / "weights.safetensors"
    diffusion = replace(TINY, kind="unet", passes=4)
    write_weights(make_generator(diffusion if request.param == "diffusion" else TINY), path)
    return NetworkProvider(path)


def test_a_map_has_road_exactly_where_the_rules_have_it(provider):
    surface, profile = (
        draw_layout("tee", np.random.default_rng(2)),
        read_profile("1", "residential"),
    )
    made = provider.generate(surface, CHUNKS, profile, 3)
    truth = RuleProvider().generate(surface, CHUNKS, profile, 3)
    assert set(made) == set(CHUNKS)
    for chunk in CHUNKS:
        road = truth[chunk].classes == LanduseClass.ROAD
        assert np.array_equal(made[chunk].classes == LanduseClass.ROAD, road)
        assert not np.any(made[chunk].classes == LanduseClass.UNKNOWN)
        assert not np.any(made[chunk].plots[road])


def test_a_map_follows_from_its_seed_and_not_from_the_order_of_chunks(provider):
    surface, profile = (
        draw_layout("curve", np.random.default_rng(2)),
        read_profile("2", "industrial"),
    )
    made = provider.generate(surface, CHUNKS, profile, 3)
    again = provider.generate(surface, CHUNKS[::-1], profile, 3)
    other = provider.generate(surface, CHUNKS, profile, 4)
    assert all(np.array_equal(made[c].classes, again[c].classes) for c in CHUNKS)
    assert all(np.array_equal(made[c].plots, again[c].plots) for c in CHUNKS)
    assert any(not np.array_equal(made[c].classes, other[c].classes) for c in CHUNKS)


def test_a_network_of_rasters_does_without_streets(tmp_path):
    path = tmp_path / "weights.safetensors"
    write_weights(make_generator(replace(TINY, streets=False)), path)
    surface = draw_layout("bend", np.random.default_rng(2))
    profiles = [read_profile("1", "residential"), read_profile("2", "industrial")]
    one, other = (
        NetworkProvider(path).generate(surface, CHUNKS[:1], profile, 3)[CHUNKS[0]]
        for profile in profiles
    )
    assert np.mean(one.classes == other.classes) > 0.9  # not all: the nearest street differs


def test_weights_that_are_none_are_refused(tmp_path):
    (tmp_path / "weights.safetensors").write_text("no weights")
    with pytest.raises(EnvgenError, match="cannot be read"):
        NetworkProvider(tmp_path / "weights.safetensors")


def test_repair_tells_neighbouring_plots_apart_and_keeps_the_road():
    channels = np.full((60, 60), GRASS, dtype=np.uint8)
    channels[:6] = ROAD
    channels[10:40, 10:50] = LAWN
    channels[10:40, 30] = BORDER
    channels[50, 50] = LAWN  # a speck
    classes, plots = repair(channels)
    assert plots[20, 20] != plots[20, 40]
    assert min(plots[20, 20], plots[20, 40]) > 0
    assert len(np.unique(plots)) == 3
    assert np.all(plots[10:40, 10:50] > 0)
    assert np.all(classes[10:40, 10:50] == LanduseClass.LAWN)
    assert classes[50, 50] == LanduseClass.GRASS
    assert np.array_equal(classes == LanduseClass.ROAD, channels == ROAD)


def test_a_plot_that_no_way_leads_to_is_given_up():
    channels = np.full((60, 60), GRASS, dtype=np.uint8)
    channels[10:30, 10:30] = channels[10:30, 35:55] = LAWN
    channels[5:12, 20:23] = INPUT.index(LanduseClass.ACCESS)
    classes, plots = repair(channels)
    assert plots[20, 20] > 0
    assert np.all(plots[10:30, 35:55] == 0)
    assert np.all(classes[10:30, 35:55] == LanduseClass.GRASS)


def test_a_small_hole_in_a_border_line_does_not_join_plots():
    channels = np.full((60, 60), GRASS, dtype=np.uint8)
    channels[10:40, 10:50] = LAWN
    channels[10:40, 30] = BORDER
    channels[20, 30] = LAWN
    _, plots = repair(channels)
    assert plots[25, 20] != plots[25, 40]
