"""A minute of fuzzing: changed files are read or refused, and nothing else."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
TARGETS = (
    *("opendrive", "citygml", "cityjson", "osm", "geotiff", "toml", "traces"),
    *("assets", "stages", "exports"),
)
SECONDS = 6
"""Processor seconds for each target: a minute for all."""


@pytest.mark.parametrize("target", TARGETS)
def test_a_short_round_finds_nothing(target: str, tmp_path: Path) -> None:
    """The seeds are those of the repository: all machines read the same files, fast ones more."""
    command = [sys.executable, str(ROOT / "tools" / "fuzz.py"), target, f"--seconds={SECONDS}"]
    command += ["--shared", str(tmp_path), "--findings", str(tmp_path / "findings")]
    result = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path)
    assert result.returncode == 0, result.stdout + result.stderr
    rows = [line.split() for line in result.stdout.splitlines()]
    assert [row[0] for row in rows] == [target]
    assert all(int(row[1]) > 0 for row in rows)
    assert not (tmp_path / "findings").exists()
