"""Trainings on the CPU and, where there is one, on a GPU, which repeats a step as a CUDA graph."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import torch

from envgen_usd.study.captured_work import CapturedWork
from envgen_usd.study.domain_norms import running_means_kept
from envgen_usd.study.labelled_images import Images
from envgen_usd.study.learners import Lesson
from envgen_usd.study.picture_augmentation import Augmentation
from envgen_usd.study.torch_learner import TorchLearner
from envgen_usd.study.training_options import TrainingOptions

NEEDS_GPU = pytest.mark.skipif(not torch.cuda.is_available(), reason="there is no CUDA GPU")
DEVICES = ["cpu", pytest.param("cuda", marks=NEEDS_GPU)]
SIZE = (48, 64)


def coloured_images(count, seed, noise):
    """Images whose colours tell the classes, in blocks of 16 pixels."""
    chance = np.random.default_rng(seed)
    blocks = chance.integers(0, 7, (count, SIZE[0] // 16, SIZE[1] // 16), dtype=np.uint8)
    classes = blocks.repeat(16, 1).repeat(16, 2)
    palette = np.array([[c & 1, c >> 1 & 1, c >> 2] for c in range(7)]) * 160 + 40
    pictures = palette[classes] + chance.normal(0.0, noise, (*classes.shape, 3))
    return Images(pictures.clip(0, 255).astype(np.uint8), classes)


def learnt(seed, steps=80):
    """A network that learnt from coloured images, and its mean losses."""
    options = TrainingOptions(
        width=SIZE[1], height=SIZE[0], augmentation=Augmentation(), adaptation="colour"
    )
    real, synthetic = coloured_images(6, 1, 20.0), coloured_images(10, 2, 10.0)
    losses = []
    predict = TorchLearner(options).learn(
        Lesson(real, synthetic, real.pictures, seed, augmented=True, steps=steps),
        lambda step, loss, _: losses.append((step, loss)),
    )
    return predict, losses


def test_means_for_scoring_are_kept_inside_of_a_block():
    network = torch.nn.Sequential(torch.nn.Conv2d(3, 4, 3), torch.nn.BatchNorm2d(4, momentum=None))
    norm = network[1]
    dark, bright = torch.rand(2, 3, 8, 8), torch.rand(2, 3, 8, 8) + 9.0
    with running_means_kept(network):
        normed = network(bright)
    assert norm.num_batches_tracked == 0
    torch.testing.assert_close(norm.running_mean, torch.zeros(4))
    torch.testing.assert_close(normed.mean((0, 2, 3)), torch.zeros(4), atol=1e-5, rtol=0.0)
    network(dark)
    torch.testing.assert_close(norm.running_mean, network[0](dark).mean((0, 2, 3)))


def test_real_pictures_are_scored_with_the_means_of_real_ones():
    """Means of synthetic pictures, a fifth as bright, would be those of none that is scored."""
    real, synthetic, tested = (coloured_images(12, seed, 5.0) for seed in (1, 2, 3))
    dark = Images(synthetic.pictures // 5, synthetic.classes)
    options = TrainingOptions(width=SIZE[1], height=SIZE[0], augmentation=Augmentation())
    lesson = Lesson(real, dark, real.pictures[:0], 0, augmented=False, steps=40)
    predict = TorchLearner(options).learn(lesson, lambda *_: None)
    assert np.mean(predict(tested.pictures, SIZE) == tested.classes) > 0.9


def test_norms_apart_count_only_where_a_batch_has_both_kinds():
    """Synthetic pictures are a fifth as bright, so that a joint mean is that of neither kind."""
    real, synthetic = coloured_images(8, 1, 5.0), coloured_images(8, 2, 5.0)
    dark, nothing = Images(synthetic.pictures // 5, synthetic.classes), coloured_images(0, 2, 5.0)

    def losses(norms, frames, **changed):
        options = TrainingOptions(
            width=SIZE[1], height=SIZE[0], augmentation=Augmentation(), batch_norm=norms, **changed
        )
        lesson = Lesson(real, frames, real.pictures[:0], 0, augmented=False, steps=12)
        found = []
        TorchLearner(options).learn(lesson, lambda _step, loss, _: found.append(loss))
        return found

    assert losses("domain", nothing) == losses("joint", nothing)
    for alike in ({"batches": "proportional"}, {"schedule": "finetune"}, {"batch": 3}):
        assert losses("domain", dark, **alike) == losses("joint", dark, **alike)
    assert losses("domain", dark) != losses("joint", dark)


@pytest.mark.parametrize("device", DEVICES)
def test_repeated_work_goes_on_where_it_stopped(device):
    """Draws of ten calls, captured or not, are those of one generator."""
    where = torch.device(device)
    draws, plain = (torch.Generator(where).manual_seed(3) for _ in range(2))
    found, place = torch.zeros(10, 4, device=where), torch.zeros(1, dtype=torch.int64, device=where)

    def work():
        values = torch.rand((1, 4), generator=draws, device=where)
        found.index_copy_(0, place, values)
        place.add_(1)

    begun = []
    repeated = CapturedWork(work, lambda: begun.append(1), draws)
    stream = torch.cuda.Stream() if device == "cuda" else None
    with torch.cuda.stream(stream):
        for _ in range(10):
            repeated()
    if stream:
        stream.synchronize()
    wanted = [torch.rand((1, 4), generator=plain, device=where) for _ in range(10)]
    assert torch.equal(found, torch.cat(wanted))
    assert begun


def test_a_network_learns_what_colours_tell():
    predict, losses = learnt(0)
    assert [step for step, _ in losses] == [14, 27, 40, 54, 67, 80]
    assert losses[-1][1] < 0.5 * losses[0][1]
    unseen = coloured_images(8, 9, 15.0)
    assert (predict(unseen.pictures, SIZE) == unseen.classes).mean() > 0.9


@NEEDS_GPU
def test_trainings_side_by_side_learn_what_each_learns_alone():
    unseen = coloured_images(8, 9, 15.0)
    alone = [learnt(seed)[0](unseen.pictures, SIZE) for seed in range(4)]
    with ThreadPoolExecutor(4) as pool:
        beside = [each[0](unseen.pictures, SIZE) for each in pool.map(learnt, range(4))]
    for one, other in zip(alone, beside, strict=True):
        # Sums on a GPU have no order of their own; 97.7 % agreed on an H200.
        assert (one == other).mean() > 0.95
        assert (other == unseen.classes).mean() > 0.9
