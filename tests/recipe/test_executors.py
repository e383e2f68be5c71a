"""What clusters build and draw is that of one machine, also where a machine is lost meanwhile."""

import gc
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from shutil import which
from typing import Any

import pytest
from tests.kept_work import kept
from tests.recipe.conftest import tiny_options
from tests.short_roads import IN_NINE_CHUNKS
from typer.testing import CliRunner

from envgen_usd.commands.command_line import app
from envgen_usd.errors import EnvgenError
from envgen_usd.executors.executor import Tasks, code_hash, executor_named, run_task
from envgen_usd.recipe.build_options import BuildOptions
from envgen_usd.recipe.environment_build import build
from envgen_usd.render.frames.frame_export import render_frames

needs_ray = pytest.mark.skipif(find_spec("ray") is None, reason="Ray is not here (extra ray)")
needs_submitit = pytest.mark.skipif(
    find_spec("submitit") is None, reason="submitit is not here (extra submitit)"
)
needs_slurm = pytest.mark.skipif(which("sinfo") is None, reason="Slurm is not here")
"""Marks skip a test before the build of a module is made for it; a fixture would skip after."""
SECONDS = 1200
"""The longest that a build on a cluster may take, on a busy machine."""


@pytest.fixture(scope="module")
def options(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> BuildOptions:
    """Of the local build; the road is tiny, or that of the corpus which a parameter names."""
    name = getattr(request, "param", "")
    road = request.getfixturevalue("corpus") / name if name else None

    def make(folder: Path) -> BuildOptions:
        chosen = tiny_options(folder, IN_NINE_CHUNKS)
        return replace(chosen, road=road or chosen.road)

    return kept(tmp_path_factory, f"executors_{Path(name).stem or 'tiny'}", make)


@pytest.fixture(scope="module")
def products(options: BuildOptions, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Hashes of all files of the local build."""

    def make(_folder: Path) -> dict[str, Any]:
        return dict(build(options).manifest.products)

    return kept(tmp_path_factory, f"{options.out.parent.name}_products", make)


def started(options: BuildOptions, out: Path, *more: str) -> subprocess.Popen[str]:
    """A build in a process of its own."""
    place = ("--country", "1", "--area", "residential", "--no-pictures", "--out", str(out))
    return running_command("build", str(options.road), *place, *more)


def running_command(*words: str) -> subprocess.Popen[str]:
    """A command in a process of its own."""
    command = (sys.executable, "-m", "envgen_usd", *words)
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


def wait_for_work(
    build: subprocess.Popen[str], out: Path, parallel: int, finished: int = 1
) -> None:
    """Waits until some chunks are finished and others are being built."""
    end = time.monotonic() + SECONDS
    while build.poll() is None and time.monotonic() < end:
        folders = [path.name for path in (out / "chunks").glob("*") if path.is_dir()]
        hidden = [name for name in folders if name[0] == "." and name[1] in "-0123456789"]
        done = sum(name[0] != "." for name in folders)
        if len(hidden) >= parallel and done >= finished:
            return
        time.sleep(0.02)
    pytest.fail(f"no {parallel} chunks were built at a time: {build.communicate()[0]}")


def built(process: subprocess.Popen[str], options: BuildOptions, out: Path) -> dict[str, Any]:
    """Hashes of the files that a build on a cluster made; the build then keeps all of them."""
    said = process.communicate(timeout=SECONDS)[0]
    assert process.returncode == 0, said
    assert not [*out.rglob(".*")]
    result = build(replace(options, out=out))
    assert result.built == 0
    return dict(result.manifest.products)


@pytest.fixture
def cluster(monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    """A Ray cluster of two nodes on loopback, a processor each."""
    monkeypatch.setenv("RAY_USAGE_STATS_ENABLED", "0")  # Ray would report to its makers.
    utils = import_module("ray.cluster_utils")
    node = {"num_cpus": 1, "object_store_memory": 100_000_000, "include_dashboard": False}
    both = utils.Cluster(initialize_head=True, head_node_args=node)
    try:
        yield both
    finally:
        both.shutdown()


@needs_ray
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize(
    "options", ["", "carla_test/Town01.xodr"], ids=["tiny", "Town01"], indirect=True
)
def test_a_ray_cluster_that_loses_a_node_builds_the_same(
    cluster: Any, options: BuildOptions, products: dict[str, Any], tmp_path: Path
) -> None:
    second = cluster.add_node(num_cpus=1, object_store_memory=100_000_000)
    cluster.wait_for_nodes()
    out = tmp_path / "out"
    process = started(options, out, "--executor", "ray", "--address", cluster.address)
    wait_for_work(process, out, 2, len([*(options.out / "chunks").iterdir()]) // 2)
    cluster.remove_node(second, allow_graceful=False)
    assert built(process, options, out) == products


FRAMES = 12
"""Six on each of two processors."""


@pytest.fixture
def images(options: BuildOptions, products: dict[str, Any], tmp_path: Path) -> dict[str, bytes]:
    """Images of a drive over the local build, drawn by one process."""
    assert products
    render_frames(options.out / "stage.usda", tmp_path / "alone", FRAMES, seed=4)
    return files_of(tmp_path / "alone")


def files_of(folder: Path) -> dict[str, bytes]:
    names = (path for path in folder.rglob("*") if path.is_file())
    return {str(path.relative_to(folder)): path.read_bytes() for path in names}


def render_started(options: BuildOptions, out: Path, *more: str) -> subprocess.Popen[str]:
    """A run of `render` in a process of its own."""
    chosen = ("--out", str(out), "--frames", str(FRAMES), "--seed", "4")
    return running_command("render", str(options.out / "stage.usda"), *chosen, *more)


def drawn_images(process: subprocess.Popen[str], out: Path) -> dict[str, bytes]:
    said = process.communicate(timeout=SECONDS)[0]
    assert process.returncode == 0, said
    assert f"{FRAMES} rendered" in said
    return files_of(out)


@needs_ray
@pytest.mark.filterwarnings("ignore")
def test_a_ray_cluster_that_loses_a_node_draws_the_same(
    cluster: Any, options: BuildOptions, images: dict[str, bytes], tmp_path: Path
) -> None:
    second = cluster.add_node(num_cpus=1, object_store_memory=100_000_000)
    cluster.wait_for_nodes()
    out = tmp_path / "out"
    process = render_started(options, out, "--executor", "ray", "--address", cluster.address)
    end = time.monotonic() + SECONDS
    while len([*out.glob("rgb/*.png")]) < 2 and process.poll() is None:
        assert time.monotonic() < end
        time.sleep(0.05)
    cluster.remove_node(second, allow_graceful=False)
    assert drawn_images(process, out) == images


@needs_submitit
@pytest.mark.filterwarnings("ignore")
def test_jobs_of_submitit_draw_the_same(
    options: BuildOptions, images: dict[str, bytes], tmp_path: Path
) -> None:
    out = tmp_path / "out"
    more = ("--executor", "submitit", "--address", "local", "--workers", "2")
    assert drawn_images(render_started(options, out, *more), out) == images


def gpu_of(_job: int) -> str:
    return os.environ.get("CUDA_VISIBLE_DEVICES", "")


@needs_ray
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("on_gpu", [True, False])
def test_tasks_that_draw_run_beside_a_gpu(cluster: Any, on_gpu: bool) -> None:
    """Ray believes the test that the second node has a GPU."""
    cluster.add_node(num_cpus=1, num_gpus=1, object_store_memory=100_000_000)
    cluster.wait_for_nodes()
    executor = executor_named("ray", 0, cluster.address, Path())
    found: list[str] = []
    try:
        executor.run(Tasks(gpu_of, range(6), gc.enable, (), on_gpu), found.append)
    finally:
        import_module("ray").shutdown()
    assert len(found) == 6
    assert {*found} == {"0"} if on_gpu else "0" not in found


@needs_submitit
@pytest.mark.filterwarnings("ignore")
def test_jobs_of_submitit_that_are_killed_are_given_again(
    options: BuildOptions, products: dict[str, Any], tmp_path: Path
) -> None:
    out = tmp_path / "out"
    more = ("--executor", "submitit", "--address", "local", "--workers", "2")
    process = started(options, out, *more)
    wait_for_work(process, out, 2)
    os.kill(submitted(out), signal.SIGKILL)
    assert built(process, options, out) == products


@needs_submitit
@needs_slurm
@pytest.mark.filterwarnings("ignore")
def test_jobs_that_slurm_loses_are_given_again(
    options: BuildOptions, products: dict[str, Any], tmp_path: Path
) -> None:
    out = tmp_path / "out"
    more = ("--executor", "submitit", "--address", "slurm", "--workers", "2")
    process = started(options, out, *more)
    wait_for_work(process, out, 2)
    first = running()
    os.kill(submitted(out), signal.SIGKILL)
    later, end = set[str](), time.monotonic() + SECONDS
    while process.poll() is None and time.monotonic() < end:
        later |= running() - first
        time.sleep(0.2)
    assert later, "the share of the killed job was not given again"
    assert built(process, options, out) == products


def running() -> set[str]:
    """Ids of the jobs of Slurm that run."""
    command = ("squeue", "--me", "--array", "--noheader", "--states=running", "--format=%i")
    return {*subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()}


def submitted(out: Path) -> int:
    """A process of Python that submitit has started on this machine for a build."""
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        words = path.read_bytes()
        is_python = words.startswith(os.fsencode(sys.executable))
        if (
            is_python
            and b"submitit.core._submit" in words
            and os.fsencode(out / "chunks" / ".jobs.") in words
        ):
            return int(path.parent.name)
    return pytest.fail("no process of submitit")


def test_an_unknown_executor_is_refused_before_anything_is_written(
    options: BuildOptions, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    with pytest.raises(EnvgenError, match="local, ray, submitit"):
        build(replace(options, out=out, executor="moon"))
    assert not out.exists()


@pytest.mark.parametrize("command", ["render", "dataset"])
def test_frames_of_an_unknown_executor_are_refused_before_anything_is_written(
    options: BuildOptions, products: dict[str, Any], command: str, tmp_path: Path
) -> None:
    assert products
    given = {"render": str(options.out / "stage.usda"), "dataset": "article"}[command]
    words = [command, given, "--out", str(tmp_path / "out"), "--executor", "moon"]
    with pytest.raises(EnvgenError, match="local, ray, submitit"):
        CliRunner().invoke(app, words, catch_exceptions=False)
    assert not (tmp_path / "out").exists()


@needs_submitit
def test_no_tasks_need_no_jobs_of_submitit(tmp_path: Path) -> None:
    executor = executor_named("submitit", 2, "local", tmp_path / ".jobs")
    executor.run(Tasks(abs, (), print, ()), print)
    assert not [*tmp_path.iterdir()]


def test_a_process_starts_once_for_the_same_tasks() -> None:
    calls: list[str] = []
    tasks = Tasks(abs, (-1, -2), calls.append, ("first",))
    assert run_task(code_hash(), "a", tasks) == [1, 2]
    assert run_task(code_hash(), "a", tasks) == [1, 2]
    assert run_task(code_hash(), "b", replace(tasks, shared=("second",))) == [1, 2]
    assert calls == ["first", "second"]
    with pytest.raises(EnvgenError, match="another version"):
        run_task("0", "a", tasks)
