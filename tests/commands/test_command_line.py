"""The command, run as its user runs it."""

import os
import shlex
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

from envgen_usd import __main__

DEMO = ["build", "--demo", "--country", "1", "--area", "residential"]
BAD = [
    (["build", "nowhere.xodr", "--country", "1", "--area", "residential"], "nowhere.xodr"),
    (["build", "--demo", "--country", "9", "--area", "residential"], "known: 1, 2"),
    (
        ["build", "--demo", "--country", "1", "--area", "moor"],
        "known: agricultural, city_centre, harbour, industrial, residential, suburb",
    ),
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
    (["render", "stage.usda", "--outputs", ""], "no outputs named"),
    (["build", "no.xml", "--country", "1", "--area", "residential"], "no.xml"),
    ([*DEMO, "--bbox", "8,49,9,50"], "--bbox: has no effect without --osm FILE; leave it out"),
    ([*DEMO, "--fill", "none", "--driving-side", "left"], "--fill, --driving-side: have no effect"),
    ([*DEMO, "--max-area", "9"], "--max-area: has no effect without --osm FILE or --lanelet2"),
    ([*DEMO, "--address", "local"], "--address: has no effect with --executor local"),
    (["render", "stage.usda", "--fps", "10"], "--fps: has no effect with --trajectory spread"),
    (["render", "stage.usda", "--speed", "9", "--trajectory", "traffic"], "--speed: has no effect"),
    (
        ["render", "stage.usda", "--lidar-motion"],
        "--lidar-motion: has no effect without",
    ),
]
BAD_EXPORTS = [
    (["export", ".", "--gltf"], "holds no stage"),
    (["export", "no.xml", "--gltf"], "no.xml: cannot be read as a USD stage"),
    (["export", "."], "choose a format"),
    (["export", ".", "--carla"], "--road FILE"),
    (["export", "no.xml", "--gltf", "--metadata", "some"], "embedded or only"),
]
KINDS = [
    (["library", "new", "no.xml"], "no.xml: is a file; choose a new folder"),
    (["library", "check", "no.xml"], "no.xml: is a file, not a folder; name the folder of an"),
    (
        ["library", "import", "no.xml", "--kind", "bin", "--library", "no.xml"],
        "no.xml: is a file, not a folder",
    ),
    (["flatten", "no.xml", "a.txt"], "a.txt: choose a name that ends in"),
    (["flatten", ".", "a.usda"], ".: is a folder without stage.usda; name the stage of a build"),
    (["render", "."], ".: is a folder without stage.usda"),
    (["citygml", "no.xml", "--out", "no.xml/a.gml"], "no.xml: cannot be written"),
    (["inspect", "no.xml", "--image", "a.txt"], "a.txt: choose a name that ends in .svg or .png"),
    (["inspect", "no.xml", "--list", "."], ".: is a folder; choose the name of a file"),
    (["synth-road", "grid", "--out", "."], ".: is a folder; choose the name of a file"),
    (["environment", "learn", "a.osm", "--out", "country_x/a.toml"], "a.osm: no such file; name"),
    ([*DEMO, "--landuse", ".", "--out", "out"], "--landuse .: is a folder, not a file"),
    ([*DEMO[:1], *DEMO[2:], "--osm", ".", "--out", "o"], ".: is a folder, not a file; name"),
]
"""Files that are folders, folders that are files, and names that cannot be written."""
IDLE = [
    (["export", ".", "--gltf", "--tile-size", "500"], "--tile-size: has no effect with --gltf"),
    (["export", ".", "--gltf", "--road", "a", "--detail", "simple"], "--road, --detail: have no"),
    (
        ["export", ".", "--carla", "--road", "a", "--no-instancing"],
        "--no-instancing: has no effect with --carla",
    ),
    (
        ["citygml", "road.xodr", "--out", "a.gml", "--heightmap", "a.tif"],
        "--heightmap: has no effect without --lod, --land or --city",
    ),
    (["validate", ".", "--no-schema", "--schemas", "."], "--schemas: has no effect with --no-sch"),
    (["traffic", ".", "--csv", "a", "--road", "b"], "--road: has no effect without --sumo or --sc"),
    (["traffic", ".", "--csv", "a", "--vehicles", "0"], "--vehicles: has no effect without --sumo"),
    (["traffic", ".", "--sumo", "--road", "b", "--net", "a"], "--net: has no effect without --fcd"),
]
"""Options without an effect beside the others."""
EACH = [
    ["--help"],
    [*DEMO, "--city", "no.xml", "--out", "out"],
    ["citygml", "road.xodr", "--tolerance", "2", "--out", "out"],
    ["render", "stage.usda", "--frames", "0", "--out", "out"],
    ["export", "no.xml", "--gltf"],
    ["landuse", "from-osm", "no.xml", "--out", "no.xml/out"],
    ["library", "check", "no.xml"],
]
"""A call of each command whose user gets no files."""
OSM = """<osm version="0.6">
<node id="1" version="1" lat="0.0001" lon="0.0001"/>
<node id="2" version="1" lat="0.0015" lon="0.0016"/>
<way id="3" version="1"><nd ref="1"/><nd ref="2"/><tag k="highway" v="residential"/></way></osm>"""
TIMED = {"landuse", "terrain", "chunks"}
"""Steps that a build shows."""


@dataclass(frozen=True)
class Ended:
    """How the command ended and what it said."""

    returncode: int
    stdout: str
    stderr: str


class Command:
    """The command in a folder: in this process, or `alone`, as a shell starts it."""

    def __init__(self, patch: pytest.MonkeyPatch, capture: pytest.CaptureFixture[str]) -> None:
        # Of interrupts see test_interrupts.py, which starts processes.
        patch.setattr(__main__, "end_on_interrupt", lambda: None)
        patch.setattr(sys, "excepthook", sys.excepthook)
        self._patch, self._capture = patch, capture

    def __call__(self, folder: Path, *arguments: str) -> Ended:
        self._patch.chdir(folder)
        self._patch.setattr(sys, "argv", [str(__main__.__file__), *arguments])
        self._patch.setitem(sys.modules, "__main__", __main__)
        with pytest.raises(SystemExit) as caught:
            __main__.main()
        code = caught.value.code
        return Ended(int(code or 0), *self._capture.readouterr())

    def alone(self, folder: Path, *arguments: str) -> Ended:
        command = [sys.executable, "-m", "envgen_usd", *arguments]
        ended = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
        return Ended(ended.returncode, ended.stdout, ended.stderr)


@pytest.fixture
def command(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Command:
    return Command(monkeypatch, capsys)


@pytest.mark.parametrize("arguments", EACH, ids=lambda arguments: arguments[0])
def test_a_process_ends_as_the_command_does_here(
    arguments: list[str], command: Command, tmp_path: Path
) -> None:
    """So the tests below need no process of their own."""
    (tmp_path / "no.xml").write_text("this is no XML")
    alone = command.alone(tmp_path, *arguments)
    assert alone == command(tmp_path, *arguments)
    assert alone.returncode == (0 if arguments == ["--help"] else 2)
    assert "Traceback" not in alone.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["no.xml"]


@pytest.mark.parametrize(("arguments", "said"), BAD)
def test_bad_input_is_one_line_and_exit_code_2(
    arguments: list[str], said: str, command: Command, tmp_path: Path
) -> None:
    (tmp_path / "no.xml").write_text("this is no XML")
    result = command(tmp_path, *arguments, "--out", "out")
    assert result.returncode == 2
    lines = [line for line in result.stderr.splitlines() if line.startswith("envgen-usd: ")]
    assert len(lines) == 1 or "Invalid value" in result.stderr
    assert said in "".join(lines or result.stderr)
    assert not TIMED & set(result.stderr.split()), "something was made before"
    assert "Traceback" not in result.stderr
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(("arguments", "said"), [*BAD_EXPORTS, *KINDS, *IDLE])
def test_a_bad_export_or_an_idle_option_is_one_line_and_exit_code_2(
    arguments: list[str], said: str, command: Command, tmp_path: Path
) -> None:
    (tmp_path / "no.xml").write_text("this is no XML")
    result = command(tmp_path, *arguments)
    assert result.returncode == 2
    assert len(result.stderr.splitlines()) == 1
    assert said in result.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["no.xml"]


def test_a_folder_that_cannot_be_written_is_named(command: Command, tmp_path: Path) -> None:
    locked = tmp_path / "locked"
    locked.mkdir(mode=0o500)
    if os.access(locked, os.W_OK):
        pytest.skip("this user may write everywhere")
    result = command(tmp_path, *DEMO, "--out", "locked/out")
    assert result.returncode == 2
    assert "cannot be written" in result.stderr


@pytest.mark.parametrize(
    "arguments", [[*DEMO, "--out", "/proc/out"], ["citygml", "road.xodr", "--out", "/proc/a.gml"]]
)
def test_a_place_where_nothing_can_be_made_is_named_before_the_work(
    arguments: list[str], command: Command, tmp_path: Path
) -> None:
    result = command(tmp_path, *arguments)
    assert result.returncode == 2
    assert result.stderr.strip().startswith("envgen-usd: /proc")
    assert "cannot be written" in result.stderr
    assert len(result.stderr.strip().splitlines()) == 1


def test_files_that_cannot_be_written_are_one_line(command: Command, tmp_path: Path) -> None:
    """What the system refuses is one line for every command, as is what the user got wrong."""
    (tmp_path / "file").write_text("")
    result = command(tmp_path, "landuse", "from-osm", "file", "--out", "file/out")
    assert result.returncode == 2
    assert len(result.stderr.splitlines()) == 1
    assert "Traceback" not in result.stderr


def test_a_folder_below_a_file_is_named(command: Command, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    result = command(tmp_path, *DEMO, "--out", "file/out")
    assert result.returncode == 2
    assert "cannot be written" in result.stderr


def test_help_names_the_commands(command: Command, tmp_path: Path) -> None:
    result = command(tmp_path, "--help")
    assert result.returncode == 0
    for name in ("build", "render", "inspect"):
        assert name in result.stdout


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["synth-road", "grid", "--blocks", "1x1", "--out"], ["build", "my town.xodr"]),
        (["landuse", "from-osm", "a.osm", "--out"], ["landuse", "train", "--data", "my town.xodr"]),
        (["library", "new"], ["build", "...", "--library", "my town.xodr"]),
    ],
    ids=lambda words: words[0],
)
def test_the_next_command_can_be_pasted_where_a_path_has_spaces(
    arguments: list[str], words: list[str], command: Command, tmp_path: Path
) -> None:
    (tmp_path / "a.osm").write_text(OSM)
    result = command(tmp_path, *arguments, "my town.xodr")
    assert result.returncode == 0, result.stderr
    _, _, pasted = result.stdout.strip().splitlines()[-1].partition("envgen-usd ")
    assert shlex.split(pasted)[: len(words)] == words


def test_the_library_command_lists_every_fault_with_its_whole_path(
    command: Command, tmp_path: Path
) -> None:
    deep = tmp_path.joinpath(*["a_folder_with_quite_a_long_name"] * 4)
    (deep / "materials").mkdir(parents=True)
    (deep / "assets").mkdir()
    paths = [deep / "materials" / f"{name}.usda" for name in ("mud", "rust")]
    for path in paths:
        path.write_text("no usd")
    result = command(tmp_path, "library", "check", str(deep))
    assert result.returncode == 2
    assert result.stderr.splitlines() == [
        f"error: {path}: cannot be read as a USD layer" for path in paths
    ]
    assert result.stdout == "0 assets, 2 findings\n"
