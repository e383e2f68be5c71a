"""Statistics, distances, changes and adaptation against closed forms; the commands end to end."""

import numpy as np
import pytest
import torch
from typer.testing import CliRunner

from envgen_usd.commands.command_line import app
from envgen_usd.errors import EnvgenError
from envgen_usd.study.counterfactuals import counterfactuals, recoloured, void_grey
from envgen_usd.study.domain_adaptation import colours_of, with_amplitudes, with_colours
from envgen_usd.study.feature_distance import kernel_distance
from envgen_usd.study.labelled_images import Images
from envgen_usd.study.learners import Lesson
from envgen_usd.study.lesson_batches import Batches, class_weights
from envgen_usd.study.picture_augmentation import (
    Augmentation,
    augmented,
    encoded_light,
    linear_light,
)
from envgen_usd.study.set_statistics import set_distances, set_statistics
from envgen_usd.study.study_classes import CLASSES, VOID
from envgen_usd.study.training_options import TrainingOptions
from envgen_usd.study.yolo_learner import polygon_lines

ROAD, SKY = CLASSES.index("road"), CLASSES.index("sky")


def half_and_half(sky=(200, 200, 200), road=(50, 50, 50), count=2):
    """Sky above a road, 10 x 10."""
    classes = np.full((count, 10, 10), SKY, np.uint8)
    classes[:, 5:] = ROAD
    pictures = np.empty((count, 10, 10, 3), np.uint8)
    pictures[:, :5], pictures[:, 5:] = sky, road
    return Images(pictures, classes)


def test_statistics_of_two_halves():
    found = set_statistics(half_and_half(sky=(255, 0, 0)))
    assert found.share[[SKY, ROAD]].tolist() == [0.5, 0.5]
    assert found.rows[:5, SKY].tolist() == [1.0] * 5
    assert found.columns[3, SKY] == 0.5
    assert found.adjacency[ROAD, SKY] == found.adjacency[SKY, ROAD] == 0.5
    assert found.brightness[SKY] == pytest.approx(0.2126, rel=1e-5)
    assert found.chroma[[SKY, ROAD]].tolist() == [1.0, 0.0]
    assert found.gradient[ROAD] == 0.0
    assert np.isnan(found.brightness[CLASSES.index("pole")])
    assert all(value == 0.0 for value in set_distances(found, found).values())


def test_recolouring_takes_over_mean_and_deviation():
    chance = np.random.default_rng(0)
    ours, theirs = half_and_half(), half_and_half()
    ours.pictures[:, 5:] = chance.normal(60, 10, (2, 5, 10, 3)).round()
    theirs.pictures[:, 5:] = chance.normal(120, 20, (2, 5, 10, 3)).round()
    known, wanted = set_statistics(ours), set_statistics(theirs)
    found = set_statistics(recoloured(ours, known, wanted, [ROAD]))
    assert np.abs(found.colour - wanted.colour)[ROAD].max() < 0.003
    assert np.abs(found.deviation - wanted.deviation)[ROAD].max() < 0.003
    assert (found.colour[SKY] == known.colour[SKY]).all()


def test_real_skies_are_taken_and_nothing_else_changes():
    real, ours = half_and_half(sky=(10, 20, 30), road=(1, 2, 3)), half_and_half()
    change = {each.name: each for each in counterfactuals(real, ours, light=True)}
    assert {"colour_road", "colour_sky", "colour_all", "sky", "light", "void"} == change.keys()
    found = change["sky"].train(ours)
    assert (found.pictures[:, :5] == (10, 20, 30)).all()
    assert (found.pictures[:, 5:] == ours.pictures[:, 5:]).all()


def test_void_is_grey():
    images = half_and_half()
    images.classes[0, 0] = VOID
    found = void_grey(images)
    assert len(np.unique(found.pictures[0, 0])) == 1
    assert (found.pictures[1] == images.pictures[1]).all()


def test_the_kernel_distance_is_zero_in_the_mean_for_equal_distributions():
    chance = np.random.default_rng(0)
    equal = [
        kernel_distance(chance.normal(size=(40, 8)), chance.normal(size=(40, 8))) for _ in range(60)
    ]
    assert abs(np.mean(equal)) < 3.0 * np.std(equal) / np.sqrt(len(equal))
    assert kernel_distance(chance.normal(size=(40, 8)), chance.normal(1.0, 1.0, (40, 8))) > 0.5


def test_colour_adaptation_takes_over_mean_and_covariance():
    draws = torch.Generator().manual_seed(0)
    ours = torch.rand((2, 3, 16, 16), generator=draws) * 0.2 + 0.2
    theirs = torch.rand((2, 3, 16, 16), generator=draws) * 0.3 + 0.4
    theirs[:, 1] = 0.5 * theirs[:, 0] + 0.5 * theirs[:, 1]
    colours = [colours_of(pictures * 255.0) for pictures in (ours, theirs)]
    found = with_colours(ours, *colours)
    for each, wanted in zip(found, theirs, strict=True):
        assert torch.allclose(each.mean((1, 2)), wanted.mean((1, 2)), atol=0.01)
        covariances = torch.cov(each.flatten(1)), torch.cov(wanted.flatten(1))
        assert torch.allclose(*covariances, atol=5e-4)


def test_fourier_adaptation_takes_over_the_mean_and_keeps_edges():
    draws = torch.Generator().manual_seed(0)
    ours = torch.rand((1, 3, 64, 64), generator=draws) * 0.3 + 0.35
    found = with_amplitudes(ours, torch.full((1, 3, 64, 64), 0.6))
    assert torch.allclose(found.mean((2, 3)), torch.tensor(0.6), atol=0.01)
    steps = [x.diff(dim=3).flatten() for x in (ours, found)]
    assert torch.corrcoef(torch.stack(steps))[0, 1] > 0.99


def test_light_changes_pictures_and_keeps_classes():
    values = torch.linspace(0.0, 1.0, 50)
    assert torch.allclose(encoded_light(linear_light(values)), values, atol=1e-4)
    draws = torch.Generator().manual_seed(0)
    pictures, classes = torch.rand((4, 3, 32, 32)), torch.randint(0, 7, (4, 32, 32))
    lit, same = augmented(pictures, classes, Augmentation(flip=False, light=True), draws)
    assert (same == classes).all()
    assert lit.min() >= 0.0
    assert lit.max() <= 1.0
    assert not torch.allclose(lit, pictures)
    turned, labels = augmented(pictures, classes, Augmentation(), draws)
    for n in range(4):
        mirrored = not torch.equal(turned[n], pictures[n])
        assert torch.equal(labels[n], classes[n].flip(1) if mirrored else classes[n])


def test_framing_moves_picture_and_classes_together():
    classes = torch.randint(0, 7, (6, 4, 4)).repeat_interleave(16, 1).repeat_interleave(16, 2)
    pictures = (classes / 10.0)[:, None].repeat(1, 3, 1, 1)
    draws = torch.Generator().manual_seed(1)
    moved, labels = augmented(pictures, classes, Augmentation(False, framing=True), draws)
    inside = labels != VOID
    agree = (moved[:, 0] * 10.0 - labels).abs()[inside] < 0.05
    assert agree.float().mean() > 0.8  # the others lie on borders, where pictures are blended


def test_class_weights_follow_shares():
    images = half_and_half()
    images.classes[:, :1] = CLASSES.index("pole")  # 10, 40 and 50 %
    inverse = class_weights("inverse", images)
    assert inverse[CLASSES.index("pole")] / inverse[ROAD] == pytest.approx(5.0)
    root = class_weights("root", images)
    assert root[CLASSES.index("pole")] / root[ROAD] == pytest.approx(5.0**0.5)
    assert class_weights("none", images).tolist() == [1.0] * 7


def test_half_of_a_batch_is_synthetic_or_each_image_counts_the_same():
    real, synthetic = half_and_half(road=(0, 0, 0), count=4), half_and_half(count=12)
    lesson = Lesson(real, synthetic, real.pictures[:0], 0, augmented=False, steps=20)

    def real_of(step, **options):
        batches = Batches(lesson, TrainingOptions(batch=8, **options), torch.device("cpu"))
        return int((batches.at(torch.tensor([step]))[0][:, 0, 9, 0] == 0.0).sum())

    assert real_of(0) == 4
    assert real_of(0, batches="proportional") == 2
    assert [real_of(s, schedule="finetune") for s in (0, 9, 10, 19)] == [0, 0, 8, 8]


def test_polygons_outline_the_classes():
    (sky, road) = sorted(polygon_lines(half_and_half().classes[0]), reverse=True)
    assert sky.split()[0] == str(SKY)
    places = np.array(road.split()[1:], float).reshape(-1, 2)
    assert places.min(0).tolist() == [0.0, 0.5]
    assert places.max(0).tolist() == [1.0, 1.0]


def study(*words):
    result = CliRunner().invoke(app, ["study", *(str(word) for word in words)])
    if isinstance(result.exception, EnvgenError):
        raise result.exception
    assert result.exit_code == 0, result.output + str(result.exception)
    return result.output


def test_a_diagnosis_ranks_changes_and_resumes(real_folder, frames_folder, tmp_path):
    words = ("--real", real_folder, "--synthetic", frames_folder, "--out", tmp_path)
    words += ("--iterations", 2, "--resolution", "64x48")
    text = study("diagnose", *words)
    rows = [line.split("|") for line in text.splitlines() if line.startswith("| ")][2:]
    names = [row[1].strip() for row in rows]
    assert names[0] == "baseline"
    assert {"colour_road", "colour_all", "sky", "light", "void"} <= set(names)
    gains = [float(row[3].split()[0]) for row in rows[1:]]
    assert gains == sorted(gains, reverse=True)
    files = {p: p.stat().st_mtime_ns for p in (tmp_path / "runs").glob("*.json")}
    assert study("diagnose", *words).count("colour_road") == text.count("colour_road")
    assert files == {p: p.stat().st_mtime_ns for p in (tmp_path / "runs").glob("*.json")}
    with pytest.raises(EnvgenError, match="augmentation was"):
        study("diagnose", *words, "--augment", "none")


def test_realism_stands_beside_real_against_real(real_folder, frames_folder, tmp_path):
    words = ("--real", real_folder, "--synthetic", frames_folder, "--out", tmp_path)
    text = study("realism", *words, "--iterations", 3, "--resolution", "64x48")
    lines = [line.split("|") for line in text.splitlines() if line.startswith("| ")]
    rows = {line[1].strip(): line for line in lines}
    # The frames are drawn in other colours, on the same layout.
    assert float(rows["brightness by class"][4]) > 5.0
    assert float(rows["classes by row"][4]) < 2.0
    assert "features (task KID)" in rows
    assert (tmp_path / "report.html").is_file()
