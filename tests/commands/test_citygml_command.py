"""`citygml` lays the same land as `build`, by the same options."""

import json
from pathlib import Path

import pytest
from tests.short_roads import TINY_ROAD, write_short_road
from typer.testing import CliRunner

from envgen_usd.citygml.read import read_city
from envgen_usd.commands.command_line import app
from envgen_usd.errors import EnvgenError
from envgen_usd.recipe.build_options import BuildOptions
from envgen_usd.recipe.environment_build import build


@pytest.fixture(scope="module")
def road(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("road") / "tiny.xodr"
    path.write_text(TINY_ROAD, encoding="utf-8")
    return path


def run(*arguments: object) -> None:
    result = CliRunner().invoke(app, [str(argument) for argument in arguments])
    assert result.exit_code == 0, result.output


def buildings(path: Path) -> dict[str, object]:
    city = read_city(path)
    return {b.id: b.attributes for b in city.of_kind("Building")}


def test_a_seed_and_a_network_give_the_buildings_of_the_build(road: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    build(BuildOptions(road, "1", "residential", out, seed=4, landuse="network", workers=1))
    path = tmp_path / "city.gml"
    choice = ("--landuse", "network", "--seed", 4)
    run("citygml", road, "--out", path, "--lod", "3.3", *choice)
    assert buildings(path) == buildings(out / "city.gml")
    assert buildings(path)
    run("citygml", road, "--out", tmp_path / "rules.gml", "--lod", "3.3", "--seed", 4)
    assert set(buildings(path)) != set(buildings(tmp_path / "rules.gml"))


def test_a_given_city_replaces_generated_buildings(road: Path, tmp_path: Path) -> None:
    run("citygml", road, "--out", tmp_path / "a.json", "--lod", "1.0", "--seed", 1)
    known = json.loads((tmp_path / "a.json").read_text("utf-8"))["CityObjects"]
    known = {name for name, item in known.items() if item["type"] == "Building"}
    run("citygml", road, "--out", tmp_path / "b.gml", "--city", tmp_path / "a.json", "--seed", 2)
    assert set(buildings(tmp_path / "b.gml")) == known != set()
    content = (tmp_path / "a.json").read_bytes()
    with pytest.raises(EnvgenError, match=r"a\.json: is what the command reads"):
        app(["citygml", str(road), "--city", f"{tmp_path}/a.json", "--out", f"{tmp_path}/a.json"])
    assert (tmp_path / "a.json").read_bytes() == content


def test_strictly_every_issue_is_an_error(tmp_path: Path) -> None:
    """A broken line without the length of its dashes is used with an issue, a solid one without."""
    road = write_short_road(tmp_path / "short.xodr")
    run("citygml", road, "--out", tmp_path / "a.gml")
    with pytest.raises(EnvgenError, match=r"accepts none; road_mark.size, 1 times: road/lanes: "):
        app(["citygml", str(road), "--out", str(tmp_path / "b.gml"), "--strict"])
    solid = tmp_path / "solid.xodr"
    solid.write_text(road.read_text("utf-8").replace('type="broken"', 'type="solid"'))
    run("citygml", solid, "--out", tmp_path / "c.gml", "--strict")
