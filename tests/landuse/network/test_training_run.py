"""A run of training after a kill, and after damage to its files."""

import hashlib
import shutil
from dataclasses import replace

import numpy as np
import pytest
from tests.landuse.network.test_training import RUN, TINY

from envgen_usd.errors import EnvgenError
from envgen_usd.landuse.network.data.landuse_scenes import LanduseSample, make_sample
from envgen_usd.landuse.network.data.sample_cache import read_samples
from envgen_usd.landuse.network.training import training_run
from envgen_usd.landuse.network.training.training_run import Run, train

SHORT = replace(RUN, images=8)
"""Four steps; each second is kept."""
PRODUCTS = ("state.pt", "weights.safetensors", "curves.csv", "curves.png", "samples.png")


def digests(folder):
    return {path.name: hashlib.sha256(path.read_bytes()).digest() for path in folder.iterdir()}


@pytest.fixture(scope="module")
def sample():
    return make_sample("random", 1, 3)


@pytest.fixture(scope="module")
def finished(sample, tmp_path_factory):
    """Folder of an undisturbed run."""
    folder = tmp_path_factory.mktemp("whole")
    train(Run(folder, keep_every=2), [sample], TINY, SHORT)
    assert set(PRODUCTS) == {path.name for path in folder.iterdir()}
    return folder


@pytest.fixture(scope="module")
def whole(finished):
    return digests(finished)


def run(folder, sample):
    issues = []
    train(Run(folder, keep_every=2), [sample], TINY, SHORT, warn=issues.append)
    return issues


class Killed(BaseException):
    """As final as SIGKILL for a test within a process."""


@pytest.mark.parametrize("writer", ["write_state", "write_weights", "write_curves", "write_sheet"])
def test_a_run_that_dies_between_two_files_ends_with_the_same_bytes(
    writer, sample, whole, tmp_path, monkeypatch
):
    """The second time is the end, after which no step follows."""
    write, calls = getattr(training_run, writer), []

    def dies(*args):
        calls.append(args)
        if len(calls) == 2:
            raise Killed
        write(*args)

    monkeypatch.setattr(training_run, writer, dies)
    with pytest.raises(Killed):
        run(tmp_path, sample)
    monkeypatch.setattr(training_run, writer, write)
    assert run(tmp_path, sample) == []
    assert digests(tmp_path) == whole


@pytest.mark.parametrize("name", PRODUCTS)
@pytest.mark.parametrize("damage", ["deleted", "cut", "flipped"])
def test_damage_is_repaired_by_the_same_run(name, damage, sample, finished, whole, tmp_path):  # noqa: PLR0917
    shutil.copytree(finished, tmp_path / "run")
    path = tmp_path / "run" / name
    data = bytearray(path.read_bytes())
    if damage == "deleted":
        path.unlink()
    elif damage == "cut":
        path.write_bytes(data[: len(data) // 2])
    else:
        data[len(data) // 2] ^= 4
        path.write_bytes(data)
    issues = run(tmp_path / "run", sample)
    assert digests(tmp_path / "run") == whole
    if name == "state.pt" and damage != "deleted":
        (issue,) = issues
        assert (issue.kind, issue.where) == ("training.damaged", str(path))
    else:
        assert issues == []


def test_a_run_of_another_network_is_refused(sample, finished, whole):
    with pytest.raises(EnvgenError, match="another network"):
        train(Run(finished), [sample], replace(TINY, dim=8), SHORT)
    assert digests(finished) == whole


@pytest.mark.parametrize("damage", ["cut", "flipped", "empty"])
def test_a_damaged_sample_is_named_and_made_again(damage, sample, tmp_path):
    def read(made):
        issues = []

        def make(number):
            made.append(number)
            return sample

        samples = [*read_samples(tmp_path, "s", range(2), LanduseSample, make, issues.append)]
        return samples, issues

    first, _ = read([])
    path = tmp_path / "s_1.npz"
    before = path.read_bytes()
    data = bytearray(before)
    data[len(data) // 3] ^= 1
    path.write_bytes({"cut": before[: len(before) // 2], "flipped": data, "empty": b""}[damage])
    made = []
    again, (issue,) = read(made)
    assert made == [1]
    assert str(path) in issue.where
    assert path.read_bytes() == before
    assert np.array_equal(again[1].classes, first[1].classes)
    made.clear()
    assert read(made)[1] == []
    assert made == []
