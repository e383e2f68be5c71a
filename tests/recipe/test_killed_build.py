"""A build that is killed, and what the same command makes of its folder."""

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from tests.recipe.conftest import tiny_options
from tests.short_roads import IN_NINE_CHUNKS

from envgen_usd.errors import EnvgenError
from envgen_usd.recipe.build_options import BuildOptions
from envgen_usd.recipe.environment_build import BuildResult, build
from envgen_usd.recipe.product_files import check_products
from envgen_usd.recipe.traffic_build import check_build
from envgen_usd.render.stage.stage_reader import open_stage
from envgen_usd.whole_files import PART_PREFIX


def killed(options: BuildOptions, moment: Callable[[], bool]) -> None:
    """Ends the command with SIGKILL as soon as its folder shows a moment."""
    place = ["--country", options.country, "--area", options.area, "--out", str(options.out)]
    command = [sys.executable, "-m", "envgen_usd", "build", str(options.road), *place]
    with subprocess.Popen([*command, "--workers=1"], start_new_session=True) as process:
        while not moment():
            assert process.poll() is None
            time.sleep(0.01)
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        assert process.returncode == -signal.SIGKILL


def states(paths: list[Path]) -> dict[Path, tuple[int, int]]:
    return {path: (path.stat().st_ino, path.stat().st_mtime_ns) for path in paths}


def test_a_build_that_is_killed_twice_ends_with_the_same_bytes(
    tiny_build: BuildResult, tmp_path: Path
) -> None:
    """The first kill comes between two chunks, the second while the stage is composed."""
    options = tiny_options(tmp_path)
    out, chunks = options.out, options.out / "chunks"
    killed(options, lambda: bool([*chunks.glob("[!.]*/made.json")]))
    finished = states([*chunks.glob("[!.]*/made.json")])
    killed(options, (out / "layers").is_dir)
    assert states([*finished]) == finished
    with pytest.raises(EnvgenError, match=r"no manifest\.json"):
        check_products(out)
    with pytest.raises(EnvgenError, match="no finished build"):
        check_build(out)
    finished = states([*chunks.glob("[!.]*/made.json")])
    result = build(options)
    assert (result.built, result.kept) == (0, len(finished))
    assert len(finished) > 1
    assert states([*finished]) == finished
    assert not [*out.rglob(f"{PART_PREFIX}*")]
    assert not [*chunks.glob(".*")]
    assert result.manifest.products == tiny_build.manifest.products
    assert not check_products(out).faults


def test_an_interrupted_build_of_another_road_leaves_no_stage_of_the_first(
    tiny_build: BuildResult, tmp_path: Path
) -> None:
    """Chunks of two roads under the stage, the manifest or the city of one are a lie."""
    options = tiny_options(tmp_path, IN_NINE_CHUNKS)
    out, chunks = options.out, options.out / "chunks"
    shutil.copytree(tiny_build.stage.parent, out)
    before = {path: path.read_bytes() for path in chunks.glob("*/made.json")}
    killed(
        options,
        lambda: {path: path.read_bytes() for path in chunks.glob("[!.]*/made.json")} != before,
    )
    top = {path.name for path in out.iterdir() if path.is_file()}
    assert not top & {"stage.usda", "manifest.json", "city.gml", "map.svg", "report.html"}
    with pytest.raises(EnvgenError, match=r"stage\.usda: is missing, the build is unfinished"):
        open_stage(out / "stage.usda")
    result = build(options)
    assert result.kept > 0
    assert not check_products(out).faults
