"""The command, run as its user runs it."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

DEMO = ["build", "--demo", "--country", "1", "--area", "residential"]
BAD = [
    (["build", "nowhere.xodr", "--country", "1", "--area", "residential"], "nowhere.xodr"),
    (["build", "--demo", "--country", "9", "--area", "residential"], "known: 1, 2"),
    (["build", "--demo", "--country", "1", "--area", "harbour"], "known: industrial, residential"),
    (["build", "--country", "1", "--area", "residential"], "--demo"),
    ([*DEMO, "--tolerance", "0"], "tolerance"),
    ([*DEMO, "--tolerance", "nan"], "tolerance"),
    ([*DEMO, "--workers", "-1"], "workers"),
    ([*DEMO, "--library", "."], "no asset library"),
    ([*DEMO, "--city", "none.gml"], "none.gml: cannot be read: No such file"),
    ([*DEMO, "--city", "no.xml"], "no.xml: not CityGML"),
    ([*DEMO, "--heightmap", "none.tif"], "none.tif: cannot be read: No such file"),
    ([*DEMO, "--landuse", "none.tif"], "none.tif"),
    (["citygml", "road.xodr", "--tolerance", "2"], "tolerance"),
    (["citygml", "road.xodr"], "ends in .gml or .xml or .json"),
    (["render", "stage.usda", "--frames", "0"], "frames"),
    (["render", "stage.usda", "--spacing", "0"], "spacing"),
    (["build", "no.xml", "--country", "1", "--area", "residential"], "no.xml"),
]
BAD_EXPORTS = [
    (["export", ".", "--gltf"], "holds no stage"),
    (["export", "no.xml", "--gltf"], "no.xml cannot be opened"),
    (["export", "."], "choose a format"),
    (["export", ".", "--carla"], "--road FILE"),
    (["export", "no.xml", "--gltf", "--metadata", "some"], "embedded or only"),
]
TIMED = {"landuse", "terrain", "chunks"}
"""Steps that a build shows."""


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
    assert len(lines) == 1 or "Invalid value" in result.stderr
    assert said in "".join(lines or result.stderr)
    assert not TIMED & set(result.stderr.split()), "something was made before"
    assert "Traceback" not in result.stderr
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(("arguments", "said"), BAD_EXPORTS)
def test_a_bad_export_is_one_line_and_exit_code_2(
    arguments: list[str], said: str, tmp_path: Path
) -> None:
    (tmp_path / "no.xml").write_text("this is no XML")
    result = run(tmp_path, *arguments)
    assert result.returncode == 2
    assert len(result.stderr.splitlines()) == 1
    assert said in result.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["no.xml"]


def test_a_folder_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    locked = tmp_path / "locked"
    locked.mkdir(mode=0o500)
    if os.access(locked, os.W_OK):
        pytest.skip("this user may write everywhere")
    result = run(tmp_path, "build", "--demo", "--country", "1", "--area", "residential", "--out",
                 "locked/out")  # fmt: skip
    assert result.returncode == 2
    assert "cannot be written" in result.stderr


@pytest.mark.parametrize(
    "arguments", [[*DEMO, "--out", "/proc/out"], ["citygml", "road.xodr", "--out", "/proc/a.gml"]]
)
def test_a_place_where_nothing_can_be_made_is_named_before_the_work(
    arguments: list[str], tmp_path: Path
) -> None:
    result = run(tmp_path, *arguments)
    assert result.returncode == 2
    assert result.stderr.strip().startswith("envgen-usd: /proc")
    assert "cannot be written" in result.stderr
    assert len(result.stderr.strip().splitlines()) == 1


def test_files_that_cannot_be_written_are_one_line(tmp_path: Path) -> None:
    """What the system refuses is one line for every command, as is what the user got wrong."""
    (tmp_path / "file").write_text("")
    result = run(tmp_path, "landuse", "from-osm", "file", "--out", "file/out")
    assert result.returncode == 2
    assert len(result.stderr.splitlines()) == 1
    assert "Traceback" not in result.stderr


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


def test_the_library_command_lists_every_fault_with_its_whole_path(tmp_path: Path) -> None:
    deep = tmp_path.joinpath(*["a_folder_with_quite_a_long_name"] * 4)
    (deep / "materials").mkdir(parents=True)
    (deep / "assets").mkdir()
    paths = [deep / "materials" / f"{name}.usda" for name in ("mud", "rust")]
    for path in paths:
        path.write_text("no usd")
    result = run(tmp_path, "library", "check", str(deep))
    assert result.returncode == 2
    assert result.stderr.splitlines() == [
        f"error: {path}: cannot be read as a USD layer" for path in paths
    ]
    assert result.stdout == "0 assets, 2 findings\n"
