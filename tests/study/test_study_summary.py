"""Gains, equivalent images and replaceable shares of results that are known."""

import json

import numpy as np
import pytest

from envgen_usd.study.labelled_images import LabelledImage
from envgen_usd.study.pages.study_tables import Table, comma_separated, latex, markdown
from envgen_usd.study.study_classes import camvid_frame_table
from envgen_usd.study.study_folder import RUNS
from envgen_usd.study.study_protocol import ALL, Protocol, make_plan, scored_images
from envgen_usd.study.study_runs import result_file
from envgen_usd.study.study_summary import ALL_REAL, summarise, whole_seeds
from envgen_usd.study.training_options import TrainingOptions

SIZE = 20
RATIOS = (1.0, 0.5, 0.25, 0.0)


def right_share(run):
    """A curve of real images, 0.1 ln n, on which synthetic images lie at known places."""
    if run.flat:
        return 0.05
    if run.synthetic:
        return {10: 0.1 * np.log(15.0), 8: 0.0, 5: 0.1 * np.log(20.0) - 0.03, 0: 0.01}[run.real]
    return 0.1 * np.log(run.real) - (0.0 if run.augmented else 0.02)


@pytest.fixture
def plan(tmp_path):
    file = tmp_path / "0.png"
    for n in range(60):
        (tmp_path / f"{n}.png").write_bytes(b"x")
    table = camvid_frame_table().tobytes()
    images = [
        LabelledImage(tmp_path / f"{n}.png", file, "ab"[n % 2], table)
        for n in sorted(range(60), key=lambda n: (n % 2, n))
    ]
    arms = ("mix", "real_only", "flat", "plain")
    return make_plan(Protocol((SIZE,), RATIOS, arms, seeds=2), TrainingOptions(), images, images)


def test_few_real_images_with_synthetic_ones_stand_beside_all_real_ones(tmp_path, plan):
    real = plan.folds[0].train + plan.folds[0].test
    protocol = Protocol((SIZE, ALL), (1.0, 0.25), ("real_only", "mix"), seeds=2)
    other = make_plan(protocol, TrainingOptions(), real, real)
    for run in other.runs:
        write_result(other, run, tmp_path)
    gains = {
        (c.first, c.size, c.ratio): c.gain.value
        for c in summarise(other, tmp_path).comparisons
        if c.second == ALL_REAL
    }
    # 5 real images with synthetic ones are worth 20 without the 0.03; all are 30 in each fold.
    assert gains["mix", SIZE, 0.25] == pytest.approx(0.1 * np.log(20 / 30) - 0.03, abs=2e-3)
    assert ("mix", ALL, 1.0) not in gains


def write_result(plan, run, out):
    """Each of the images has 1,000 pixels of road, of which a share is right."""
    images = scored_images(plan, run)
    counts = np.zeros((len(images), 7, 7), int)
    counts[:, 0, 0] = round(1000 * right_share(run))
    counts[:, 0, 6] = 1000 - counts[:, 0, 0]
    content = {
        "images": [f"{image.sequence}/{image.name}" for image in images],
        "counts": counts.tolist(), "curve": [], "seconds": 1, "device": "none",
    }  # fmt: skip
    (out / RUNS).mkdir(exist_ok=True)
    result_file(out, run).write_text(json.dumps(content))


def test_known_results_give_known_conclusions(plan, tmp_path):
    for run in plan.runs:
        write_result(plan, run, tmp_path)
    found = summarise(plan, tmp_path)
    assert found.seeds == (0, 1)
    gains = {(c.first, c.second, c.ratio): c.gain.value for c in found.comparisons}
    assert gains["mix", "real_only", 0.5] == pytest.approx(0.1 * np.log(1.5), abs=2e-3)
    assert gains["real_only", "plain", 1.0] == pytest.approx(0.02, abs=2e-3)
    assert ("mix", "real_only", 1.0) not in gains  # the same runs
    assert found.equivalent[SIZE, 0.5] == pytest.approx(15.0, rel=0.02)
    assert found.equivalent[SIZE, 0.0] is None
    shares = {each.loss: (each.mix, each.real_only) for each in found.replaceable}
    # At 5 points a quarter of the real images is enough with synthetic ones (3 points less); alone
    # not even half of them (7 points less).
    assert shares[0.05][0] == 0.75
    assert np.isnan(shares[0.05][1])
    assert np.isnan(shares[0.01][0])
    best = {(arm, ratio) for arm, _, ratio in found.pareto}
    assert {("mix", 0.25), ("mix", 0.5)} <= best
    assert ("real_only", 0.5) not in best


def test_a_repetition_counts_when_all_of_its_runs_are_done(plan, tmp_path):
    for run in plan.runs:
        if run.seed == 0:
            write_result(plan, run, tmp_path)
    assert whole_seeds(plan, tmp_path) == (0,)
    assert summarise(plan, tmp_path).seeds == (0,)


def test_tables_are_written_in_three_languages():
    table = Table("t", ("a_b", "c, %"), (("1 ± 2", "3"),))
    assert markdown(table).splitlines()[-1] == "| 1 ± 2 | 3 |"
    assert comma_separated(table) == 'a_b,"c, %"\n1 ± 2,3\n'
    assert r"a\_b & c, \% \\" in latex(table)
    assert r"1 $\pm$ 2 & 3 \\" in latex(table)
