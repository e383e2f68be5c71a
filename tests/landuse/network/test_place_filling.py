"""Networks of places: order of sampling, the task, filling, and nearness to real places."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from scipy import ndimage

from envgen_usd.chunks import CELL_SIZE, LANDUSE_CELLS, Chunk
from envgen_usd.environment_files import read_profile
from envgen_usd.landuse.area_statistics import environment_statistics
from envgen_usd.landuse.landuse_rules import RuleProvider
from envgen_usd.landuse.network.data.cell_order import dispersed_order
from envgen_usd.landuse.network.data.place_channels import CORE, GIVEN, HOUSE, PLACE_OUTPUTS
from envgen_usd.landuse.network.data.place_sample import (
    AROUND,
    PLACE_CONDITIONS,
    PlaceSample,
    place_condition,
)
from envgen_usd.landuse.network.data.road_layouts import draw_layout
from envgen_usd.landuse.network.model.generator import make_generator
from envgen_usd.landuse.network.model.known_pyramid import spread
from envgen_usd.landuse.network.model.network_config import NetworkConfig, TrainConfig
from envgen_usd.landuse.network.network_provider import network_provider
from envgen_usd.landuse.network.place_filling import buildings_of, fill_places, land_of_channels
from envgen_usd.landuse.network.place_provider import PlaceProvider
from envgen_usd.landuse.network.shipped_weights import find_weights
from envgen_usd.landuse.network.tasks.known_tasks import task_of
from envgen_usd.landuse.network.tasks.place_task import PLACE_FIELDS
from envgen_usd.landuse.network.training.place_measures import (
    FIGURES,
    agreement,
    differences,
    land_figures,
)
from envgen_usd.landuse.network.training.training_run import Run, train
from envgen_usd.landuse.network.training.weights_file import read_network, write_weights
from envgen_usd.landuse.place_landuse import PlaceLand, land_with_plots
from envgen_usd.models.landuse import LanduseClass, LanduseMap
from envgen_usd.recipe.landuse_runs import network_sizes, training_figures
from envgen_usd.recipe.place_windows import land_of_maps

SIZE = 128
TINY = NetworkConfig(
    PLACE_FIELDS,
    PLACE_CONDITIONS,
    head=(12, 16, 16),
    dim=16,
    heads=2,
    style=8,
    mapping=2,
    refine=(16, 24, 24),
    critic=(8, 8),
    kind="unet",
    target="place",
    streets=False,
    passes=4,
)


def sample(house=9, gap=13):
    """A street, and a row of square houses on one side of it."""
    side = SIZE + 2 * AROUND
    base = np.full((side, side), LanduseClass.UNKNOWN, np.uint8)
    middle = side // 2
    base[middle - 4 : middle + 4] = LanduseClass.ROAD
    houses = np.zeros(base.shape, np.int64)
    row = middle + 10
    for number, column in enumerate(range(0, side - house, house + gap), 1):
        houses[row : row + house, column : column + house] = number
    land = land_with_plots(base, houses, np.zeros(houses.max(), bool))
    return PlaceSample.of(land, np.array([0.2, 100.0, 6.0, 0.0]))


def land_of(one):
    return PlaceLand(one.classes, one.plots.astype(np.int64), one.built)


@pytest.mark.parametrize("step", [2, 4, 16])
def test_cells_that_are_sampled_at_once_lie_apart(step):
    order = dispersed_order((128, 96), np.random.default_rng(3))
    row, column = np.nonzero(order < 1 / step**2)
    assert len(row) == 128 * 96 // step**2
    assert len(np.unique(row % step)) == len(np.unique(column % step)) == 1


def test_an_order_visits_each_cell_once_and_windows_of_a_map_agree():
    whole = dispersed_order((512, 512), np.random.default_rng(1))
    part = dispersed_order((64, 32), np.random.default_rng(1), (100, 40))
    assert len(np.unique(whole)) == whole.size
    assert np.array_equal(part, whole[100:164, 40:72])


@pytest.mark.parametrize("kind", ["mat", "unet"])
def test_what_is_given_stays_and_is_never_generated(kind):
    torch.manual_seed(0)
    network = make_generator(replace(TINY, kind=kind))
    one = sample()
    lands = fill_places(network.eval(), [one, one], 0)
    for land in lands:
        given = np.isin(one.classes, GIVEN)
        assert np.array_equal(land.classes[given], one.classes[given])
        assert not np.isin(land.classes[~given], GIVEN).any()
    assert task_of("place").outputs == PLACE_OUTPUTS


def test_a_draw_follows_from_its_seed():
    torch.manual_seed(0)
    network, one = make_generator(TINY).eval(), sample()
    first, again, other = (fill_places(network, [one], seed)[0].classes for seed in (1, 1, 2))
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)


def test_plots_follow_from_buildings_as_in_the_ground_truth():
    one = sample()
    land = land_of_channels(one.channels)
    true = np.unique(one.plots[one.plots > 0])
    assert len(np.unique(land.plots)) - 1 == len(true)
    inside = ndimage.binary_erosion(one.plots > 0, iterations=3)
    pairs = np.unique(np.stack([one.plots, land.plots])[:, inside], axis=1)
    assert len(pairs.T) == len(true)


def test_a_speck_is_no_building():
    channels = np.full((40, 40), 3 + len(GIVEN), np.uint8)
    channels[20:23, 20:23] = HOUSE
    assert not land_of_channels(channels).built.any()
    channels[20:30, 20:30] = HOUSE
    assert land_of_channels(channels).built.any()


def test_cores_keep_buildings_apart_that_touch():
    channels = np.full((60, 60), 3 + len(GIVEN), np.uint8)
    channels[20:32, 10:50] = HOUSE
    channels[23:29, 14:22] = channels[23:29, 34:46] = CORE
    houses = buildings_of(channels)
    assert houses.max() == 2
    assert set(houses[20:32, 10:50].ravel().tolist()) == {1, 2}
    assert houses[25, 26] != houses[25, 30]


def test_a_network_learns_where_houses_stand(tmp_path):
    """Houses stand to the north of the street: sampled ones do, too."""
    samples = [sample(), sample(gap=20)]
    config = TrainConfig(images=200, batch=4, size=64, small=0.0, rate=2e-2, scattered=0.8)
    weights = train(Run(tmp_path, 40), samples, TINY, config)
    losses = np.loadtxt(tmp_path / "curves.csv", delimiter=",", usecols=2)[::2]
    assert losses[-20:].mean() < 0.5 * losses[:5].mean()
    network = read_network(weights, "place")
    built = fill_places(network, [samples[0]], 5)[0].built
    assert not built.any() or np.nonzero(built)[0].mean() > SIZE / 2


def test_real_land_is_at_no_distance_from_itself():
    one = sample()
    figures = land_figures([land_of(one)], [one])
    assert differences(figures, figures, [one])[:5] == pytest.approx(0)
    assert differences(figures, figures, [one])[5] == 1


def test_figures_tell_other_houses_and_other_land():
    one, large = sample(), sample(house=16, gap=18)
    real, other = (land_figures([land_of(each)], [one]) for each in (one, large))
    far = dict(zip(FIGURES, differences(real, other, [one]), strict=True))
    areas = [np.bincount(each.plots.ravel())[1:].max() * CELL_SIZE**2 for each in (one, large)]
    assert far["area"] == pytest.approx(areas[1] - areas[0], rel=0.25)
    assert 0 < far["shares"] < 1
    assert far["miou"] < 1
    bare = replace(one, classes=np.where(one.classes == 1, 1, LanduseClass.GRASS).astype(np.uint8))
    empty = land_figures([replace(land_of(bare), plots=0 * one.plots)], [one])
    away = differences(real, empty)
    assert np.isnan(away[1:4]).all()
    assert away[0] == pytest.approx(real.shares[LanduseClass.LAWN])
    assert away[4] == 1
    assert agreement(real, empty, [one]) < 1


def test_squares_are_cut_from_chunks():
    rng = np.random.default_rng(0)
    whole = rng.integers(2, 12, (2 * LANDUSE_CELLS, 2 * LANDUSE_CELLS)).astype(np.uint8)
    maps = {}
    for x in (0, 1):
        for y in (0, 1):
            rows = slice(y * LANDUSE_CELLS, (y + 1) * LANDUSE_CELLS)
            part = whole[rows, x * LANDUSE_CELLS : (x + 1) * LANDUSE_CELLS]
            maps[Chunk(x - 1, y)] = LanduseMap(Chunk(x - 1, y), part, part.astype(np.int64))
    land = land_of_maps(maps, (-100, 50), 300)
    assert np.array_equal(land.classes, whole[50:350, 155:455])
    assert np.array_equal(land.plots, land.classes)
    beyond = land_of_maps(maps, (-300, 0), 100)
    assert np.all(beyond.classes[:, :45] == LanduseClass.GRASS)
    assert np.array_equal(beyond.classes[:, 45:], whole[:100, :55])


@pytest.mark.parametrize("name", ["small", "unet", "diffusion"])
def test_architectures_of_places_take_their_fields(name):
    sizes = network_sizes(name, "place", streets=False)
    assert (sizes.fields, sizes.condition) == (PLACE_FIELDS, PLACE_CONDITIONS)
    scattered = training_figures(sizes, {}, 256, 0).scattered
    assert (scattered > 0.5) == (sizes.passes > 1)


@pytest.mark.parametrize("shape", [(8, 8), (12, 20)])
def test_known_values_reach_the_whole_hole(shape):
    known = torch.zeros(1, 2, *shape)
    mask = torch.zeros(1, 1, *shape)
    mask[0, 0, 1, 2] = mask[0, 0, 6, 7] = 1
    known[0, 0, 1, 2], known[0, 1, 6, 7] = 3.0, 5.0
    filled, level = spread(known, mask)
    assert filled[0, 0, 1, 2] == 3
    assert filled[0, 0, 0, 3] == 3
    assert filled[0, 1, 7, 6] == 5
    assert torch.equal(level == 0, mask > 0)
    assert torch.all(filled.sum(1) > 0)
    nothing, _ = spread(known, torch.zeros_like(mask))
    assert torch.all(nothing == 0)


@pytest.fixture(scope="module")
def provider(tmp_path_factory):
    torch.manual_seed(0)
    path = tmp_path_factory.mktemp("network") / "weights.safetensors"
    write_weights(make_generator(TINY), path)
    return network_provider(path)


def test_a_map_has_road_where_the_rules_have_it_and_follows_from_its_seed(provider):
    surface = draw_layout("tee", np.random.default_rng(2))
    profile, chunks = read_profile("1", "residential"), [Chunk(0, 0), Chunk(1, 0)]
    made, again = (
        provider.generate(surface, order, profile, 3) for order in (chunks, chunks[::-1])
    )
    truth = RuleProvider().generate(surface, chunks, profile, 3)
    other = provider.generate(surface, chunks, profile, 4)
    assert isinstance(provider, PlaceProvider)
    for chunk in chunks:
        road = truth[chunk].classes == LanduseClass.ROAD
        assert np.array_equal(made[chunk].classes == LanduseClass.ROAD, road)
        assert not np.any(made[chunk].classes == LanduseClass.UNKNOWN)
        assert not np.any(made[chunk].plots[road])
        assert np.array_equal(made[chunk].classes, again[chunk].classes)
        assert np.array_equal(made[chunk].plots, again[chunk].plots)
    assert not np.array_equal(made[chunks[0]].classes, other[chunks[0]].classes)


@pytest.mark.parametrize("environment", [("1", "residential"), ("2", "industrial")])
def test_an_environment_has_statistics_like_places(environment):
    built, footprint, height, industrial = environment_statistics(read_profile(*environment))
    assert 0.02 < built < 0.8
    assert 40 < footprint < 5000
    assert 2.5 < height < 30
    assert industrial == (environment[1] == "industrial")


def test_the_shipped_network_builds_what_an_area_is_asked_for():
    network = read_network(find_weights(learnt=True), "place")
    asked = [
        replace(sample(), condition=place_condition(np.array(figures), is_real=True))
        for figures in ((0.03, 120.0, 6.0, 0.0), (0.3, 120.0, 6.0, 0.0), (0.3, 2000.0, 8.0, 1.0))
    ]
    open_land, town, works = fill_places(network, asked, 0)
    built = [np.mean(one.built) for one in (open_land, town)]
    assert 0.0 < built[1] < 0.5
    assert built[0] < 0.5 * built[1]
    rubble = [np.mean(one.classes == LanduseClass.RUBBLE) for one in (town, works)]
    assert rubble[0] < 0.1 < rubble[1]
