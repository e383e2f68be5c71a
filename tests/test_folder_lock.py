"""Two processes never hold one folder; a process that is killed holds none."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from envgen_usd.errors import EnvgenError
from envgen_usd.folder_lock import LOCK_FILE, locked
from envgen_usd.output_folder import check_output, remove_unfinished
from envgen_usd.whole_files import PART_PREFIX, whole_file

HOLD = """
import sys, time
from pathlib import Path
from envgen_usd.folder_lock import locked
with locked(Path(sys.argv[1])):
    print("held", flush=True)
    time.sleep(60)
"""


@pytest.fixture
def holder(tmp_path: Path) -> subprocess.Popen[str]:
    """Another process that holds the folder ``out``."""
    process = subprocess.Popen(
        [sys.executable, "-c", HOLD, str(tmp_path / "out")], stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "held\n"
    yield process
    process.kill()
    process.wait()
    process.stdout.close()


def test_the_second_is_told_who_holds_the_folder(
    holder: subprocess.Popen[str], tmp_path: Path
) -> None:
    with (
        pytest.raises(EnvgenError, match=rf"process {holder.pid} on .* for 0 min; wait"),
        locked(tmp_path / "out"),
    ):
        pass
    check_output(tmp_path / "out")  # A lock alone is not somebody's data.


def test_a_killed_process_holds_nothing(holder: subprocess.Popen[str], tmp_path: Path) -> None:
    os.kill(holder.pid, signal.SIGKILL)
    holder.wait()
    with locked(tmp_path / "out"):
        assert (tmp_path / "out" / LOCK_FILE).is_file()
    assert not (tmp_path / "out" / LOCK_FILE).exists()


def test_empty_folders_go_and_full_ones_stay(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="stop"), locked(tmp_path / "a" / "b"):
        raise ValueError("stop")
    assert not (tmp_path / "a").exists()
    with locked(tmp_path / "c"):
        (tmp_path / "c" / "file").touch()
    assert (tmp_path / "c" / "file").exists()


def test_what_killed_builds_had_begun_goes_and_all_else_stays(tmp_path: Path) -> None:
    for folder in ("chunks/.0_0.x1y2", "chunks/.shared.abc", "layers", ".mine", "chunks/0_0"):
        (tmp_path / folder).mkdir(parents=True)
        (tmp_path / folder / "file").touch()
    with whole_file(tmp_path / "layers" / "roads.usda") as part:
        part.touch()
        begun = part.parent
        begun_copy = begun.with_name(f"{PART_PREFIX}killed")
        begun_copy.mkdir()
    remove_unfinished(tmp_path)
    left = {p.relative_to(tmp_path).as_posix() for p in tmp_path.rglob("*") if p.is_file()}
    assert left == {"layers/roads.usda", "layers/file", ".mine/file", "chunks/0_0/file"}
    assert not begun_copy.exists()


def test_a_waiting_process_gets_a_folder_that_the_first_removed(tmp_path: Path) -> None:
    """The first leaves the folder empty, so it removes it while the second waits."""
    code = HOLD.replace("locked(Path(sys.argv[1]))", "locked(Path(sys.argv[1]), wait=True)")
    command = [sys.executable, "-c", code.replace("sleep(60)", "sleep(0.4)"), str(tmp_path / "out")]
    both = [subprocess.Popen(command, stdout=subprocess.PIPE, text=True) for _ in range(2)]
    assert [process.communicate(timeout=60)[0] for process in both] == ["held\n"] * 2
    assert [process.returncode for process in both] == [0, 0]
    assert not list(tmp_path.glob("out/*"))
