"""Parts of a build, which several machines do at a time, are the whole build."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from tests.recipe.conftest import tiny_options

from envgen_usd.errors import EnvgenError
from envgen_usd.folder_lock import LOCK_FILE, locked
from envgen_usd.recipe.build_options import BuildOptions
from envgen_usd.recipe.environment_build import BuildResult, build, build_shard


@pytest.fixture(scope="module")
def options(tmp_path_factory: pytest.TempPathFactory) -> BuildOptions:
    return tiny_options(tmp_path_factory.mktemp("shards"))


@pytest.mark.long
def test_three_parts_at_a_time_are_the_whole(
    options: BuildOptions, tiny_build: BuildResult
) -> None:
    out = options.out
    place = ["--country", "1", "--area", "residential", "--out", str(out), "--workers", "1"]
    command = [sys.executable, "-m", "envgen_usd", "build", str(options.road), *place]
    others = [
        subprocess.Popen([*command, "--shard", f"{number}/3"], stdout=subprocess.PIPE, text=True)
        for number in (1, 2)
    ]
    built = build_shard(options, (3, 3)).built
    said = [process.communicate()[0] for process in others]
    assert [process.returncode for process in others] == [0, 0]
    assert not (out / "stage.usda").exists()
    assert not [*out.rglob(".*")]
    counts = [int(text.split()[1]) for text in said]
    result = build(options)
    assert (result.built, result.kept) == (0, built + sum(counts))
    assert min(built, *counts) >= result.kept // 3 > 0
    assert result.manifest.products == tiny_build.manifest.products
    assert build_shard(options, (1, 3)).built == 0


def test_a_part_and_the_whole_do_not_run_at_a_time(options: BuildOptions, tmp_path: Path) -> None:
    out = tmp_path / "out"
    with locked(out, shared=True), pytest.raises(EnvgenError, match="is being built"):
        build(replace(options, out=out))
    with locked(out), pytest.raises(EnvgenError, match="is being built"):
        build_shard(replace(options, out=out), (1, 2))
    with (
        locked(out, shared=True),
        locked(out / "chunks" / ".shard_1_of_2"),
        pytest.raises(EnvgenError, match="is being built"),
    ):
        build_shard(replace(options, out=out), (1, 2))


def test_the_last_of_those_who_share_a_lock_removes_it(tmp_path: Path) -> None:
    with locked(tmp_path / "out", shared=True):
        with locked(tmp_path / "out", shared=True):
            pass
        assert (tmp_path / "out" / LOCK_FILE).exists()
    assert not (tmp_path / "out").exists()
