"""What a terminal's Ctrl-C does: it reaches the command and all that it has started."""

import multiprocessing
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from envgen_usd.errors import EnvgenError
from envgen_usd.recipe.build_options import demo_road
from envgen_usd.workers import Workers

BUILD = ["build", str(demo_road("straight")), "--country", "1", "--area", "residential"]
IMPORTING = """
import sys
from envgen_usd.interrupts import Interrupted, end_on_interrupt
end_on_interrupt()
try:
    import swallows
    import time
    time.sleep(30)
except Interrupted:
    print("ended", swallows.whole)
"""
SWALLOWS = """
import signal
try:
    signal.raise_signal(signal.SIGINT)
except BaseException:
    pass
whole = True
"""
FINALISER = """
import signal, time
from envgen_usd.interrupts import Interrupted, end_on_interrupt
class Thing:
    def __del__(self):
        signal.raise_signal(signal.SIGINT)
end_on_interrupt()
try:
    Thing()
    time.sleep(30)
except Interrupted:
    print("ended")
    signal.raise_signal(signal.SIGINT)
    print("in order")
"""


def members(group: int) -> list[str]:
    """Processes of a group that have not ended."""
    lines = [path.read_text() for path in Path("/proc").glob("[0-9]*/stat")]
    fields = [line.rpartition(")")[2].split() for line in lines]
    return [field[0] for field in fields if field[2] == str(group) and field[0] != "Z"]


@pytest.mark.parametrize("delay", [0.0, 1.0])
def test_an_interrupted_build_says_one_line_and_leaves_nothing_half(
    delay: float, tmp_path: Path
) -> None:
    chunks = tmp_path / "out" / "chunks"
    with subprocess.Popen(
        [sys.executable, "-m", "envgen_usd", *BUILD, "--workers", "2", "--out", "out"],
        cwd=tmp_path,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as process:
        while not list(chunks.glob(".shared*")):
            assert process.poll() is None
            time.sleep(0.01)
        time.sleep(delay)  # The workers start, or import.
        os.killpg(process.pid, signal.SIGINT)
        os.kill(process.pid, signal.SIGINT)
        _, said = process.communicate(timeout=120)
    assert process.returncode == 130
    assert "Traceback" not in said
    lines = [line for line in said.splitlines() if line.startswith("envgen-usd:")]
    assert lines == ["envgen-usd: interrupted; run the same command again to resume"]
    assert not list(chunks.glob(".*"))
    end = time.monotonic() + 10  # Python's resource tracker ends when its pipe is closed.
    while members(process.pid):
        assert time.monotonic() < end
        time.sleep(0.05)


def python(code: str, folder: Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", code]
    return subprocess.run(
        command, cwd=folder, capture_output=True, text=True, check=False, timeout=60
    )


def test_an_interrupt_that_an_import_would_swallow_comes_after_it(tmp_path: Path) -> None:
    (tmp_path / "swallows.py").write_text(SWALLOWS)
    result = python(IMPORTING, tmp_path)
    assert (result.stdout, result.stderr) == ("ended True\n", "")


def test_an_interrupt_in_a_finaliser_comes_after_it_and_only_once(tmp_path: Path) -> None:
    result = python(FINALISER, tmp_path)
    assert (result.stdout, result.stderr) == ("ended\nin order\n", "")


def test_a_failing_job_ends_the_others() -> None:
    """At once, and not at the end of the block: the caller may tidy up what they were writing."""
    start = time.monotonic()
    with Workers(2) as workers:
        workers.run(time.sleep, [0.1, 0.1], time.time, (), print)
        children = set(multiprocessing.active_children())
        with pytest.raises(ValueError, match="non-negative"):
            workers.run(time.sleep, [100.0, -1.0], time.time, (), print)
        assert children
        assert not children & set(multiprocessing.active_children())
    assert time.monotonic() - start < 60


def test_an_interrupt_between_jobs_ends_processes_that_stay() -> None:
    found: set[multiprocessing.process.BaseProcess] = set()

    def interrupted() -> None:
        with Workers(2) as workers:
            workers.run(time.sleep, [0.1, 0.1], time.time, (), print)
            workers.load("this")
            found.update(multiprocessing.active_children())
            raise KeyboardInterrupt

    start = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert found
    assert not found & set(multiprocessing.active_children())
    assert time.monotonic() - start < 60


def test_a_process_that_is_killed_is_no_traceback() -> None:
    with Workers(1) as workers, pytest.raises(EnvgenError, match="fewer --workers"):
        workers.run(os._exit, [1], time.time, (), print)


def test_processes_that_stay_prepare_for_each_kind_of_jobs() -> None:
    """Each prepares once for a kind: its mask of new files is that of the kind, then of a job."""
    with Workers(2) as workers:
        workers.load("wave")
        for kind, job in ((0o11, 0o22), (0o33, 0o44)):
            masks: list[int] = []
            workers.run(os.umask, [job] * 8, os.umask, (kind,), masks.append)
            assert set(masks) == {kind, job}
            assert masks.count(kind) <= 2
        children = set(multiprocessing.active_children())
        assert len(children) == 2
    assert not children & set(multiprocessing.active_children())
