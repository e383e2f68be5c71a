"""The command, run as its user runs it."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

BAD = [
    (["build", "nowhere.xodr", "--country", "1", "--area", "residential"], "nowhere.xodr"),
    (["build", "--demo", "--country", "9", "--area", "residential"], "known: 1, 2"),
    (["build", "--demo", "--country", "1", "--area", "harbour"], "known: industrial, residential"),
    (["build", "--country", "1", "--area", "residential"], "--demo"),
    (["build", "no.xml", "--country", "1", "--area", "residential"], "no.xml"),
]


def run(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "envgen_usd", *arguments]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)


@pytest.mark.parametrize(("arguments", "said"), BAD)
def test_bad_input_is_one_line_and_exit_code_2(
    arguments: list[str], said: str, tmp_path: Path
) -> None:
    (tmp_path / "no.xml").write_text("this is no XML")
    result = run(tmp_path, *arguments, "--out", "out")
    assert result.returncode == 2
    lines = [line for line in result.stderr.splitlines() if line.startswith("envgen-usd: ")]
    assert len(lines) == 1
    assert said in lines[0]
    assert "Traceback" not in result.stderr
    assert not (tmp_path / "out").exists()


def test_a_folder_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    locked = tmp_path / "locked"
    locked.mkdir(mode=0o500)
    if os.access(locked, os.W_OK):
        pytest.skip("this user may write everywhere")
    result = run(tmp_path, "build", "--demo", "--country", "1", "--area", "residential", "--out",
                 "locked/out")  # fmt: skip
    assert result.returncode == 2
    assert "cannot be written" in result.stderr


def test_a_folder_below_a_file_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    result = run(tmp_path, "build", "--demo", "--country", "1", "--area", "residential", "--out",
                 "file/out")  # fmt: skip
    assert result.returncode == 2
    assert "cannot be written" in result.stderr


def test_help_names_the_commands(tmp_path: Path) -> None:
    result = run(tmp_path, "--help")
    assert result.returncode == 0
    for command in ("build", "render", "inspect"):
        assert command in result.stdout
