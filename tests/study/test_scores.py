"""Scores, intervals and subsets against closed forms."""

import numpy as np
import pytest
from PIL import Image

from envgen_usd.errors import EnvgenError
from envgen_usd.label_taxonomy import labels
from envgen_usd.study.labelled_images import LabelledImage, full_classes
from envgen_usd.study.paired_bootstrap import difference, interval
from envgen_usd.study.real_images import read_real_images
from envgen_usd.study.segmentation_scores import confusion, scores
from envgen_usd.study.study_classes import CLASSES, VOID, camvid_frame_table, mapped_table
from envgen_usd.study.study_protocol import (
    ALL,
    Protocol,
    image_blocks,
    make_plan,
    nested_subset,
    run_images,
    scored_images,
)
from envgen_usd.study.training_options import TrainingOptions


def test_scores_of_a_known_confusion():
    truth = np.array([[0, 0, 0, 2], [2, 6, VOID, 6]], np.uint8)
    said = np.array([[0, 0, 2, 2], [2, 0, 0, 6]], np.uint8)
    matrix = confusion(truth, said)
    assert matrix.sum() == 7  # void is left out
    found = scores(matrix)
    assert found.overall == pytest.approx(5 / 7)
    # Accuracy: road 2 of 3, building 2 of 2, sky 1 of 2.
    assert found.mean_class == pytest.approx((2 / 3 + 1 + 1 / 2) / 3)
    # Union: road 3 true + 3 said - 2, building 2 + 3 - 2, sky 2 + 1 - 1.
    assert found.miou == pytest.approx((2 / 4 + 2 / 3 + 1 / 2) / 3)
    assert np.isnan(found.iou[CLASSES.index("pole")])


def counts_of(rights):
    """Matrices with a share of right pixels of road, the rest said to be sky."""
    matrices = np.zeros((*np.shape(rights), 7, 7))
    matrices[..., 0, 0] = rights
    matrices[..., 0, 6] = 1.0 - np.asarray(rights)
    return matrices


def accuracy(matrices):
    return scores(matrices).overall


def test_the_interval_of_a_mean_is_that_of_the_central_limit():
    chance = np.random.default_rng(0)
    rights = chance.uniform(0.2, 0.8, (1, 400))
    found = interval({"fold": counts_of(rights)}, accuracy)
    half = 1.96 * rights.std() / np.sqrt(rights.size)
    assert found.value == pytest.approx(rights.mean())
    assert found.low == pytest.approx(rights.mean() - half, abs=0.15 * half)
    assert found.high == pytest.approx(rights.mean() + half, abs=0.15 * half)


def test_a_constant_difference_has_no_width_however_images_differ():
    rights = np.random.default_rng(1).uniform(0.2, 0.6, (3, 50))
    first, second = {"a": counts_of(rights + 0.1)}, {"a": counts_of(rights)}
    found = difference(first, second, accuracy)
    assert (found.value, found.low, found.high) == pytest.approx((0.1, 0.1, 0.1))
    alone = interval(second, accuracy)
    assert alone.high - alone.low > 0.01


def test_the_interval_holds_seeds_too():
    rights = np.repeat([[0.3], [0.5], [0.7]], 20, axis=1)
    found = interval({"a": counts_of(rights)}, accuracy)
    assert found.low < 0.4
    assert found.high > 0.6


@pytest.fixture
def images(tmp_path):
    file = tmp_path / "0.png"
    file.write_bytes(b"x")
    return [
        LabelledImage(file.with_name("0.png"), file, f"s{n % 3}", camvid_frame_table().tobytes())
        for n in range(60)
    ]


def test_subsets_are_nested_and_differ_by_seed(images):
    named = [
        LabelledImage(image.picture.with_name(f"{n}.png"), image.labels, "s", image.table)
        for n, image in enumerate(images)
    ]
    large = nested_subset(named, 30, 0, "real")
    assert nested_subset(named, 10, 0, "real") == large[:10]
    assert len(set(large)) == 30
    assert nested_subset(named, 10, 1, "real") != large[:10]


def test_a_plan_repeats_no_run_and_tests_on_other_sequences(images):
    plan = make_plan(
        Protocol((10, ALL), (1.0, 0.5, 0.0), seeds=2), TrainingOptions(), images, images
    )
    runs = plan.runs
    assert len(set(runs)) == len(runs) < len(plan.cells)
    assert len({run.name for run in runs}) == len(runs)
    for run in runs:
        real, synthetic = run_images(plan, run)
        assert len(real) == (run.repeated or run.real)
        assert len(synthetic) == run.synthetic
        assert not {each.sequence for each in real} & {run.fold}
        assert {each.sequence for each in scored_images(plan, run)} == (
            {run.fold} if run.fold else {"s0", "s1", "s2"}
        )


def test_one_sequence_leaves_none_to_score_on(images):
    alike = [image for image in images if image.sequence == "s0"]
    with pytest.raises(EnvgenError, match="of one sequence"):
        make_plan(Protocol(), TrainingOptions(), alike, images)


def test_blocks_hold_neighbours_of_one_sequence(images):
    ordered = sorted(images, key=lambda image: image.sequence)
    blocks = image_blocks(ordered, 8)
    assert blocks.max() + 1 == 9
    assert np.bincount(blocks).tolist() == [8, 8, 4] * 3


def test_class_maps_are_checked(tmp_path):
    path = tmp_path / "map.toml"
    path.write_text("void = [0]\n[classes]\nroad = [3, 4]\nsky = [1]\n")
    table = mapped_table(path)
    assert (table[3], table[4], table[1], table[0]) == (0, 0, 6, VOID)
    for text, fault in (
        ("[classes]\nlane = [3]\n", "unknown class lane"),
        ("[classes]\nroad = [3]\nsky = [3]\n", "3 stands twice"),
        ("[classes]\nroad = [300]\n", "not from 0 to 255"),
    ):
        path.write_text(text)
        with pytest.raises(EnvgenError, match=fault):
            mapped_table(path)


def write(path, value, mode="L", size=(8, 8)):
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.new(mode, size, value).save(path)


def test_layouts_of_real_data_sets_are_found(tmp_path):
    city = tmp_path / "cityscapes"
    write(city / "leftImg8bit/train/ulm/ulm_000001_000019_leftImg8bit.png", (1, 2, 3), "RGB")
    write(city / "gtFine/train/ulm/ulm_000001_000019_gtFine_labelIds.png", 26)
    kitti = tmp_path / "kitti"
    drive = "2013_05_28_drive_0000_sync"
    write(kitti / "data_2d_raw" / drive / "image_00/data_rect/0000000250.png", (1, 2, 3), "RGB")
    write(kitti / "data_2d_semantics/train" / drive / "image_00/semantic/0000000250.png", 37)
    camvid = tmp_path / "camvid"
    write(camvid / "train/0001TP_006690.png", (1, 2, 3), "RGB")
    write(camvid / "trainannot/0001TP_006690.png", 3)
    expected = {city: ("cityscapes", "ulm", VOID), kitti: ("kitti360", drive, 3)}
    expected[camvid] = ("camvid", "0001TP", 0)
    for folder, (layout, sequence, value) in expected.items():
        found = read_real_images(folder)
        assert (found.layout, found.sequences) == (layout, (sequence,))
        assert (full_classes(found.images[0]) == value).all()


@pytest.mark.parametrize("value", CLASSES)
def test_grass_is_vegetation_where_no_real_image_has_terrain(tmp_path, value):
    """CamVid's eleven classes have none: its labels count grass with trees."""
    for folder, name in (("images", "a_0.png"), ("labels", "a_0.png"), ("labels", "a_1.png")):
        write(tmp_path / folder / name, 0)
    write(tmp_path / "images/a_1.png", (1, 2, 3), "RGB")
    write(tmp_path / "labels/a_1.png", CLASSES.index(value))
    ids = {entry.name: entry.id for entry in labels()}
    grass = read_real_images(tmp_path).frame_table[ids["terrain"]]
    assert CLASSES[grass] == ("terrain" if value == "terrain" else "vegetation")


def test_images_without_labels_and_unknown_values_are_named(tmp_path):
    write(tmp_path / "images/a_000.png", (1, 2, 3), "RGB")
    (tmp_path / "labels").mkdir()
    with pytest.raises(EnvgenError, match=r"a_000.png: has no labels"):
        read_real_images(tmp_path)
    write(tmp_path / "labels/a_000.png", 77)
    with pytest.raises(EnvgenError, match="label value 77 is no class"):
        full_classes(read_real_images(tmp_path).images[0])
    write(tmp_path / "labels/a_000.png", (1, 2, 3), "RGB")
    with pytest.raises(EnvgenError, match="is a RGB image"):
        full_classes(read_real_images(tmp_path).images[0])
