"""City models by command: roads alone, whole environments, and what is wrong with files."""

import re
from pathlib import Path

import pytest
import shapely
from typer.testing import CliRunner

from envgen_usd.citygml.read import read_city
from envgen_usd.commands.command_line import app
from envgen_usd.commands.terminal_output import print_issues
from envgen_usd.errors import EnvgenError, Issue, Severity

ROAD = """<?xml version="1.0"?>
<OpenDRIVE><header revMajor="1" revMinor="7" name="small"/>
<road name="a" length="120" id="7" junction="-1"><type s="0" type="town"/>
<planView><geometry s="0" x="40" y="200" hdg="0" length="120"><line/></geometry></planView>
<lanes><laneSection s="0">
<left><lane id="1" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane></left>
<center><lane id="0" type="none"><roadMark sOffset="0" type="broken"/></lane></center>
<right><lane id="-1" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane></right>
</laneSection></lanes></road></OpenDRIVE>
"""
runner = CliRunner()


@pytest.fixture(scope="module")
def road(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("road") / "small.xodr"
    path.write_text(ROAD, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def street(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The first 40 m of the road, which have houses on both sides."""
    path = tmp_path_factory.mktemp("street") / "small.xodr"
    path.write_text(ROAD.replace('length="120"', 'length="40"'), encoding="utf-8")
    return path


def test_what_has_no_room_is_told(road: Path, tmp_path: Path) -> None:
    out = tmp_path / "city.gml"
    command = ["citygml", str(road), "--out", str(out), "--lod", "3.3", "--seed", "1"]
    result = runner.invoke(app, command)
    assert result.exit_code == 0
    assert re.search(r"building\.\w+_left_out", result.stderr)
    assert "_left_out" not in runner.invoke(app, [*command[:-3], "2.0"]).stderr


@pytest.mark.parametrize("text", ["road[id=7]/lanes", "road[id=1][/b]", "[red]"])
def test_brackets_of_places_are_printed(text: str, capsys: pytest.CaptureFixture[str]) -> None:
    print_issues((Issue("a.b", Severity.INFO, text, "c", text),))
    said = capsys.readouterr().err
    assert f"{text}: c" in said
    assert said.count(text) == 2


def run(*arguments: object) -> str:
    result = runner.invoke(app, [str(argument) for argument in arguments])
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    return f"{result.exit_code} {result.stdout}"


def test_the_roads_alone(road: Path, tmp_path: Path, citygml_schemas: Path) -> None:
    out = tmp_path / "roads.gml"
    assert run("citygml", road, "--out", out).startswith("0 ")
    kinds = {thing.kind for thing in read_city(out).objects}
    assert kinds == {"Road", "GenericLogicalSpace"}
    assert run("validate", out, "--schemas", citygml_schemas) == "0 1 files, 0 findings\n"
    run("citygml", road, "--out", out, "--no-lines", "--no-solids")
    assert {thing.kind for thing in read_city(out).objects} == {"Road"}


@pytest.mark.parametrize(("country", "dashes", "dash"), [("1", 14, 3 * 0.12), ("2", 10, 0.305)])
def test_marks_have_the_sizes_of_the_country(
    road: Path, tmp_path: Path, country: str, dashes: int, dash: float
) -> None:
    """On 120 m: 3 m of 9 m and 0.12 m wide (RMS), 10 ft of 40 ft and 0.1 m wide (MUTCD)."""
    out = tmp_path / "roads.gml"
    run("citygml", road, "--out", out, "--country", country, "--no-lines", "--no-solids")
    parts = [s.polygons for t in read_city(out).walk() for s in t.surfaces if s.kind == "Marking"]
    rings = [part.rings(n)[0][:, :2] for part in parts for n in range(len(part))]
    assert shapely.area(shapely.polygons(rings)).sum() == pytest.approx(dashes * dash, rel=0.02)


@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_the_whole_environment(
    street: Path, tmp_path: Path, citygml_schemas: Path, version: str
) -> None:
    out = tmp_path / "city.gml"
    run("citygml", street, "--out", out, "--lod", "3.3", "--interiors", "--land", "--seed", "1",
        "--version", version)  # fmt: skip
    city = read_city(out)
    kinds = {thing.kind for thing in city.walk()}
    assert {"Road", "Building", "BuildingRoom", "LandUse", "TINRelief", "CityFurniture"} <= kinds
    assert {s.lod for thing in city.of_kind("Building") for s in thing.surfaces} == {3}
    assert run("validate", out, "--schemas", citygml_schemas) == "0 1 files, 0 findings\n"


def test_levels_of_detail_and_cityjson(street: Path, tmp_path: Path) -> None:
    sizes = []
    for level in ("0.0", "1.2", "2.1"):
        run("citygml", street, "--out", tmp_path / "city.gml", "--lod", level)
        sizes.append((tmp_path / "city.gml").stat().st_size)
    assert sizes == sorted(sizes)
    run("citygml", street, "--out", tmp_path / "city.json", "--lod", "2.2")
    assert run("validate", tmp_path / "city.json") == "0 1 files, 0 findings\n"


def test_options_that_make_no_sense_are_named(road: Path, tmp_path: Path) -> None:
    out = ("--out", tmp_path / "city.gml")
    with pytest.raises(EnvgenError, match=r"'9\.9' is not a level of detail; known: 0\.0"):
        run("citygml", road, *out, "--lod", "9.9")
    with pytest.raises(EnvgenError, match=r"fab\.txt: choose a name that ends in \.gml"):
        run("citygml", road, "--out", tmp_path / "fab.txt")
    assert not (tmp_path / "fab.txt").exists()
    with pytest.raises(EnvgenError, match="--interiors needs buildings"):
        run("citygml", road, *out, "--interiors")
    with pytest.raises(EnvgenError, match=r"CityGML 4\.0 cannot be written"):
        run("citygml", road, *out, "--version", "4.0")
    with pytest.raises(EnvgenError, match="does not exist"):
        run("validate", tmp_path / "nothing")


def test_a_finding_names_file_object_and_fault(road: Path, tmp_path: Path) -> None:
    out = tmp_path / "city.gml"
    run("citygml", road, "--out", out, "--lod", "2.0", "--no-solids", "--no-lines")
    text = out.read_text("utf-8")
    first = text.index("<con:RoofSurface")
    start = text.index("<gml:posList", first)
    numbers = text[text.index(">", start) + 1 : text.index("</gml:posList>", start)]
    moved = numbers.split()
    for axis in (2, len(moved) - 1):
        moved[axis] = "99.000"
    out.write_text(text.replace(numbers, " ".join(moved), 1), "utf-8")
    said = run("validate", out, "--no-schema")
    assert said.startswith("1 ")
    assert f"{out}: iso19107." in said
    assert "[building_plot_" in said
