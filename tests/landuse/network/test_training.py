import json
import time
from dataclasses import replace

import numpy as np
import pytest
import torch
from safetensors import safe_open
from safetensors.torch import save_file

from envgen_usd.errors import EnvgenError
from envgen_usd.landuse.network.data.class_channels import BORDER, INPUT, ROAD, to_channels
from envgen_usd.landuse.network.data.environment_conditions import CONDITIONS
from envgen_usd.landuse.network.data.known_fields import FIELDS, RAW
from envgen_usd.landuse.network.data.landuse_scenes import make_sample
from envgen_usd.landuse.network.data.training_masks import draw_mask
from envgen_usd.landuse.network.model.forward_draws import Draws
from envgen_usd.landuse.network.model.generator import make_generator
from envgen_usd.landuse.network.model.network_config import NetworkConfig, TrainConfig
from envgen_usd.landuse.network.tasks.known_tasks import task_of
from envgen_usd.landuse.network.training.trainer import Trainer
from envgen_usd.landuse.network.training.training_batches import (
    mirror,
    stack,
    training_batch,
    turn,
    window_of,
)
from envgen_usd.landuse.network.training.weights_file import (
    read_network,
    read_state,
    write_state,
    write_weights,
)

TINY = NetworkConfig(
    FIELDS,
    CONDITIONS,
    head=(12, 16, 16),
    dim=16,
    heads=2,
    style=8,
    mapping=2,
    refine=(12, 16, 16, 16),
    critic=(8, 8, 8),
)
RUN = TrainConfig(
    images=24,
    batch=2,
    size=64,
    small=0.5,
    rate=1e-2,
    adversarial=0.1,
    adversarial_from=0.5,
    r1_every=2,
)
CPU = torch.device("cpu")


@pytest.fixture(scope="module")
def sample():
    return make_sample("determined", 0, 7)


def weights(trainer):
    return torch.cat([value.flatten() for value in trainer.average.parameters()])


def test_samples_follow_from_their_number(sample):
    again, other = make_sample("determined", 0, 7), make_sample("determined", 2, 7)
    assert np.array_equal(sample.classes, again.classes)
    assert np.array_equal(sample.raw, again.raw)
    assert not np.array_equal(sample.classes, other.classes)


def test_turning_a_sample_four_times_changes_nothing(sample):
    turned = sample
    for _ in range(4):
        turned = turn(turned, 1)
    assert np.array_equal(turned.classes, sample.classes)
    assert np.array_equal(turned.raw, sample.raw)


def test_a_mirrored_sample_points_the_other_way(sample):
    mirrored = mirror(sample)
    west, east = (one.raw[RAW.index("normal_x")] for one in (sample, mirrored))
    assert np.array_equal(west, -east[:, ::-1])
    assert np.array_equal(mirror(mirrored).channels, sample.channels)
    assert np.array_equal(mirrored.channels, sample.channels[:, ::-1])


def test_border_lines_separate_neighbouring_plots():
    plots = np.kron(np.array([[1, 2], [3, 0]]), np.ones((4, 4), dtype=np.int64))
    classes = np.full(plots.shape, INPUT[3], dtype=np.uint8)
    inside = to_channels(classes, plots) != BORDER
    for axis in (0, 1):
        one, other = (np.moveaxis(v, axis, 0) for v in (plots, inside))
        both = other[1:] & other[:-1] & (one[1:] > 0) & (one[:-1] > 0)
        assert np.array_equal(one[1:][both], one[:-1][both])


@pytest.mark.parametrize("kind", ["mat", "unet"])
@pytest.mark.parametrize("size", [64, 96])
def test_known_cells_stay_and_road_is_never_generated(sample, kind, size):
    torch.manual_seed(0)
    network = make_generator(replace(TINY, kind=kind))
    mask = draw_mask(size, np.random.default_rng(1), 0.3)
    batch = stack(network.task, [window_of(sample, 200, 180, size)], [mask])
    fine, coarse = network(batch.known, batch.mask, batch.fields, batch.condition, Draws([0]))
    assert fine.shape == coarse.shape == (1, BORDER, size, size)
    made = network.task.composite(fine, batch.known, batch.mask)
    known = batch.mask[0, 0] > 0
    assert torch.equal(made[0][:, known], batch.known[0][:, known])
    assert torch.all(made[0, ROAD][~known] == 0)
    assert torch.allclose(made.sum(1), torch.ones(1), atol=1e-5)


def test_a_draw_belongs_to_its_seed_whatever_the_batch():
    torch.manual_seed(0)
    network = make_generator(TINY)
    sample = make_sample("random", 1, 3)
    windows = [window_of(sample, row, 100, 64) for row in (0, 64)]
    nothing = [np.zeros((64, 64), dtype=np.bool_)] * 2
    both = stack(network.task, windows, nothing)
    one = stack(network.task, windows[1:], nothing[1:])
    first, _ = network(both.known, both.mask, both.fields, both.condition, Draws([4, 5]))
    alone, _ = network(one.known, one.mask, one.fields, one.condition, Draws([5]))
    assert torch.allclose(first[1], alone[0], atol=1e-4)


def test_a_resumed_run_ends_like_an_uninterrupted_one(sample, tmp_path):
    whole = Trainer(TINY, RUN, CPU)
    for _ in range(whole.steps):
        whole.advance([sample])
    part = Trainer(TINY, RUN, CPU)
    for _ in range(7):
        part.advance([sample])
    write_state(part.state(), tmp_path / "state.pt")
    resumed = Trainer(TINY, RUN, CPU)
    resumed.load(read_state(tmp_path / "state.pt"))
    while resumed.step < resumed.steps:
        losses = resumed.advance([sample])
    assert {"first", "second", "adversarial", "critic"} <= set(losses)
    assert torch.equal(weights(whole), weights(resumed))


def test_weights_come_back_with_their_sizes(tmp_path):
    network = make_generator(TINY)
    write_weights(network, tmp_path / "weights.safetensors")
    again = read_network(tmp_path / "weights.safetensors")
    assert again.config == TINY
    for one, other in zip(network.parameters(), again.parameters(), strict=True):
        assert torch.equal(one, other)


@pytest.mark.parametrize(
    ("value", "said"), [(np.nan, "nan"), (np.inf, "inf"), (-np.inf, "-inf"), (1e30, "1e+30")]
)
def test_weights_that_are_no_weights_are_refused_with_their_tensor(tmp_path, value, said):
    """A single one of them spoils every cell that the network draws."""
    network, path = make_generator(TINY), tmp_path / "weights.safetensors"
    name, tensor = list(network.named_parameters())[5]
    with torch.no_grad():
        tensor.view(-1)[-1] = value
    write_weights(network, path)
    with pytest.raises(EnvgenError) as caught:
        read_network(path)
    message = str(caught.value)
    assert message.startswith(f"{path}: tensor {name} holds {said}; ")
    assert "\n" not in message


@pytest.mark.parametrize(
    ("name", "value"),
    [("dim", 10**6), ("mapping", 10**9), ("passes", 10**9), ("head", [8] * 99), ("depths", [1e9])],
)
def test_sizes_that_a_file_only_states_request_no_memory(tmp_path, name, value):
    path = tmp_path / "weights.safetensors"
    write_weights(make_generator(TINY), path)
    with safe_open(path, framework="pt") as file:
        tensors = {key: file.get_tensor(key) for key in file.keys()}  # noqa: SIM118
        sizes = json.loads(file.metadata()["network"])
    save_file(tensors, path, metadata={"network": json.dumps(sizes | {name: value})})
    start = time.process_time()
    with pytest.raises(EnvgenError, match="cannot be read as a network") as caught:
        read_network(path)
    assert time.process_time() - start < 5
    assert "\n" not in str(caught.value)


@pytest.mark.long
def test_one_window_can_be_learnt_by_heart(sample):
    window = window_of(sample, 190, 190, 64)
    run = replace(RUN, images=720, batch=4, small=0, adversarial=0, rate=2e-2, smoothing=0)
    trainer = Trainer(TINY, run, CPU)
    while trainer.step < trainer.steps:
        losses = trainer.advance([window])
    assert losses["second"] < 0.35


def test_batches_follow_from_step_and_seed(sample):
    task, config = task_of("landuse"), TrainConfig(seed=5)
    one, again = (training_batch(task, [sample], 3, (64, 2), config) for _ in range(2))
    other = training_batch(task, [sample], 4, (64, 2), config)
    assert torch.equal(one.mask, again.mask)
    assert not torch.equal(one.mask, other.mask)
    assert torch.all(one.mask[:, 0][one.truth == ROAD] == 1)


def test_masked_diffusion_learns_from_single_known_cells(sample):
    """Every mask has some; in all of them together their number goes from few to many."""
    config, task = TrainConfig(scattered=1.0), task_of("landuse")
    batch = training_batch(task, [sample], 0, (128, 40), config)
    land = (batch.truth != ROAD).float()
    shares = (batch.mask[:, 0] * land).sum((1, 2)) / land.sum((1, 2))
    assert shares.min() > 0
    assert shares.min() < 0.002
    assert shares.max() > 0.1


def test_conditions_have_their_number(sample):
    assert sample.condition.shape == (CONDITIONS,)
    assert np.all(np.abs(sample.condition) < 6)
