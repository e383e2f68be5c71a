"""A short round of fuzzing: changed files are read or refused, and nothing else."""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
QUICK = ("opendrive", "citygml", "cityjson", "osm", "geotiff", "toml", "traces")
"""Targets of which a second reads dozens of files; `make fuzz` takes all."""


def test_a_short_round_finds_nothing(tmp_path: Path) -> None:
    """The seeds are those of the repository, so the round is the same on each machine."""
    command = [sys.executable, str(ROOT / "tools" / "fuzz.py"), *QUICK, "--seconds=1"]
    command += ["--shared", str(tmp_path), "--findings", str(tmp_path / "findings")]
    result = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path)
    assert result.returncode == 0, result.stdout + result.stderr
    rows = [line.split() for line in result.stdout.splitlines()]
    assert [row[0] for row in rows] == [*QUICK]
    assert all(int(row[1]) > 0 for row in rows)
    assert not (tmp_path / "findings").exists()
