"""Environments that are learnt of towns with known distributions, and what is built of them."""

import json
from dataclasses import replace

import numpy as np
import pytest
import shapely
from scipy.stats import spearmanr
from tests.kept_work import kept
from typer.testing import CliRunner

from envgen_usd.commands.command_line import app
from envgen_usd.environment_files import read_profile
from envgen_usd.errors import EnvgenError
from envgen_usd.models.distribution import Quantiles, mean_of
from envgen_usd.models.place import Houses, Place, Streets
from envgen_usd.places.building_figures import measure
from envgen_usd.places.environment_fit import LEAST_SAMPLES
from envgen_usd.places.osm_tags import SIDEWALK
from envgen_usd.recipe.environment_edits import read_environment
from envgen_usd.recipe.environment_learning import check_new_environment, learnt_environment
from envgen_usd.recipe.generated_town import generated_town
from envgen_usd.seeds import generator

WIDTH = 6.0
BLOCK = 110.0
"""Distance between parallel streets, metres."""
BASE = read_profile("2", "residential")


def town(houses_a_side: int = 16, rows: int = 3) -> Place:
    """Parallel streets with a house every 20 m on both sides.

    Widths are uniform from 8 to 14 m, depths are three quarters of them, setbacks from the
    carriageway uniform from 6 to 12 m, storeys 2 or 3.
    """
    draws = generator(0, "town")
    length = 20.0 * houses_a_side + 40.0
    shapes, storeys = [], []
    for row in range(rows):
        for side in (-1, 1):
            for number in range(houses_a_side):
                width, setback = draws.uniform(8, 14), draws.uniform(6, 12)
                x = 30.0 + 20.0 * number - width / 2
                near = row * BLOCK + side * (WIDTH / 2 + setback)
                shapes.append(shapely.box(x, near, x + width, near + side * 0.75 * width))
                storeys.append(float(draws.integers(2, 4)))
    ends = [shapely.LineString([(x, 0), (x, BLOCK * (rows - 1))]) for x in (0.0, length)]
    streets = [shapely.LineString([(0, BLOCK * r), (length, BLOCK * r)]) for r in range(rows)]
    lines = np.array([*streets, *ends], object)
    count, nothing = len(shapes), np.full(len(lines), np.nan)
    words = np.full(count, "", np.str_)
    return Place(
        "town.osm",
        Houses(
            np.array(shapes, object),
            np.full(count, np.nan),
            np.array(storeys),
            words,
            np.full(count, "residential"),
            np.array(["hipped", "gabled", "gabled", "flat"] * (count // 4), np.str_),
            words,
            words,
        ),
        Streets(lines, np.full(len(lines), WIDTH), np.zeros(len(lines), bool), nothing, nothing),
        np.empty((0, 2)),
        np.empty((0, 2)),
        np.empty(0, object),
        np.empty(0, np.str_),
    )


@pytest.fixture(scope="module")
def learnt(tmp_path_factory):
    return kept(tmp_path_factory, "learnt_town", lambda _: learnt_environment(town(), BASE))


def at(figure, share):
    assert isinstance(figure, Quantiles)
    return float(np.quantile(figure.quantiles, share))


def test_learnt_quantiles_are_those_of_the_town(learnt):
    buildings, plots = learnt.profile.buildings, learnt.profile.plots
    for share in (0.1, 0.5, 0.9):
        assert at(buildings.width, share) == pytest.approx(8 + 6 * share, abs=0.6)
        assert at(buildings.depth, share) == pytest.approx(0.75 * (8 + 6 * share), abs=0.5)
    assert at(plots.frontage, 0.5) == pytest.approx(20.0, abs=0.5)
    assert mean_of(buildings.storeys) == pytest.approx(2.5, abs=0.15)
    assert buildings.width.samples == len(town().houses)
    assert buildings.style == "detached"
    assert buildings.roofs == pytest.approx({"gabled": 0.5, "hipped": 0.25, "flat": 0.25})
    assert buildings.details.footprints == {"rectangle": 1.0}


def test_width_and_depth_of_a_house_belong_together(learnt):
    correlation = learnt.profile.buildings.correlation
    names = correlation.figures
    row = correlation.matrix[names.index("depth")]
    assert row[names.index("width")] > 0.9
    assert abs(correlation.matrix[names.index("setback")][names.index("width")]) < 0.2


def test_comments_of_values_say_whether_they_were_learnt(learnt):
    lines = {line.partition(" =")[0]: line for line in learnt.text.splitlines()}
    assert lines["setback"].partition("#")[2].startswith(" learned from town.osm: ")
    assert lines["inner"].endswith("# not learned: houses stand at streets alone")
    assert "learned not learned" not in learnt.text


def test_a_generated_town_has_the_figures_of_the_real_one(learnt):
    """Round trip: learn, write, read, generate, measure."""
    real = measure(town())
    made = measure(generated_town(town().streets, learnt.profile, 5))
    assert len(made.area) > 60
    for name, tolerance in (("area", 8.0), ("setback", 0.9), ("width", 1.0), ("height", 0.5)):
        first, second = (getattr(figures, name) for figures in (real, made))
        middle, found = (np.nanmedian(values) for values in (first, second))
        assert found == pytest.approx(middle, abs=tolerance), name
        spreads = [np.diff(np.nanquantile(values, (0.25, 0.75)))[0] for values in (first, second)]
        assert spreads[1] == pytest.approx(spreads[0], rel=0.35, abs=0.1), name
    assert spearmanr(made.width, made.depth).statistic > 0.8
    # The environment that it was learnt from makes another town.
    other = measure(generated_town(town().streets, BASE, 5))
    assert abs(np.nanmedian(other.setback) - np.nanmedian(real.setback)) > 1.5


def test_the_setback_begins_behind_sidewalk_and_verge():
    plain = learnt_environment(town(), BASE, rounds=0).profile
    before = SIDEWALK + mean_of(BASE.plots.verge)
    assert at(plain.buildings.setback, 0.5) == pytest.approx(9.0 - before, abs=0.4)


def test_too_few_samples_keep_the_value_and_say_so():
    few = town(houses_a_side=2, rows=4)
    assert len(few.houses) == 16 < LEAST_SAMPLES
    learnt = learnt_environment(few, BASE)
    assert learnt.profile.buildings.width == BASE.buildings.width
    assert learnt.profile.plots == BASE.plots
    assert learnt.profile.buildings.correlation is None
    assert learnt.town is None
    assert "# learned nothing from town.osm: 16 samples, 20 are needed" in learnt.text


def test_what_is_learnt_of_few_keeps_the_other_values(learnt):
    assert learnt.profile.trees == BASE.trees
    assert learnt.profile.street_trees == BASE.street_trees
    assert learnt.profile.buildings.materials == BASE.buildings.materials


def test_a_landuse_without_buildings_is_named():
    with pytest.raises(EnvgenError, match=r"town.osm: holds no industrial main building"):
        learnt_environment(town(), BASE, "industrial")


def test_only_free_places_of_environments_are_taken(tmp_path):
    check_new_environment(tmp_path / "country_x" / "area.toml")
    for wrong in ("x/area.toml", "country_/area.toml", "country_x/area.json"):
        with pytest.raises(EnvgenError, match=r"country_<name>/<area>\.toml"):
            check_new_environment(tmp_path / wrong)
    taken = tmp_path / "country_x" / "area.toml"
    taken.parent.mkdir()
    taken.write_text("", encoding="utf-8")
    with pytest.raises(EnvgenError, match="exists already"):
        check_new_environment(taken)
    (tmp_path / "file").write_text("", encoding="utf-8")
    with pytest.raises(EnvgenError, match="cannot be written"):
        check_new_environment(tmp_path / "file" / "country_x" / "area.toml")


def cityjson(folder, count=24):
    """Boxes in a row, 10 m wide, 8 m deep and 6.4 m high."""
    vertices, objects = [], {}
    for number in range(count):
        x, first = 15 * number, len(vertices)
        ring = [(x, 0), (x + 10, 0), (x + 10, 8), (x, 8)]
        vertices += [[*p, 0] for p in ring] + [[*p, 6.4] for p in ring]
        faces = [[3, 2, 1, 0], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]
        shell = [[[first + corner for corner in face]] for face in faces]
        objects[f"b{number}"] = {
            "type": "Building",
            "attributes": {"roofType": "1000"},
            "geometry": [{"type": "Solid", "lod": "1.2", "boundaries": [shell]}],
        }
    text = {
        "type": "CityJSON",
        "version": "2.0",
        "transform": {"scale": [0.1, 0.1, 0.1], "translate": [0, 0, 0]},
        "CityObjects": objects,
        "vertices": [[round(10 * value) for value in vertex] for vertex in vertices],
    }
    path = folder / "city.json"
    path.write_text(json.dumps(text), encoding="utf-8")
    return path


def run(*words):
    return CliRunner().invoke(app, ["environment", "learn", *map(str, words)])


def test_a_city_model_gives_sizes_and_a_build_uses_them(tmp_path):
    out = tmp_path / "envs" / "country_x" / "homes.toml"
    result = run(cityjson(tmp_path), "--out", out, "--base", "2/residential")
    assert result.exit_code == 0, result.output
    profile = read_environment(out)
    assert set(profile.buildings.depth.quantiles) == {8.0}
    assert set(profile.buildings.width.quantiles) == {10.0}
    assert set(profile.buildings.storeys.quantiles) == {2.0}
    assert profile.plots == BASE.plots
    assert profile.buildings.roofs == {"flat": 1.0}
    report = out.with_suffix(".html").read_text(encoding="utf-8")
    assert "24 real, 0 generated" in report
    road = tmp_path / "road.xodr"
    lane = '<lane id="-1" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane>'
    road.write_text(
        '<OpenDRIVE><header revMajor="1" revMinor="7"/><road id="1" length="120" junction="-1">'
        '<planView><geometry s="0" x="20" y="100" hdg="0" length="120"><line/></geometry>'
        '</planView><lanes><laneSection s="0"><center><lane id="0" type="none"/></center>'
        f"<right>{lane}</right></laneSection></lanes></road></OpenDRIVE>",
        encoding="utf-8",
    )
    words = ("--environments", out.parents[1], "--country", "x", "--area", "homes")
    stage = tmp_path / "built"
    plain = ("--no-pictures", "--workers", "1")
    built = CliRunner().invoke(
        app, ["build", str(road), *map(str, words), "--out", str(stage), *plain]
    )
    assert built.exit_code == 0, built.output
    assert (stage / "stage.usda").is_file()
    assert "Building" in built.output


def test_wrong_words_are_refused_before_the_place_is_read(tmp_path):
    out = tmp_path / "country_x" / "area.toml"
    for words, fault in (
        (("--base", "residential"), "COUNTRY/AREA"),
        (("--base", "9/residential"), "unknown country"),
    ):
        result = run(tmp_path / "none.osm", "--out", out, *words)
        assert isinstance(result.exception, EnvgenError)
        assert fault in str(result.exception)
    (tmp_path / "place.txt").write_text("", encoding="utf-8")
    result = run(tmp_path / "place.txt", "--out", out)
    assert "known endings" in str(result.exception)
    assert not out.parent.exists()


def test_nan_coordinates_of_a_city_model_are_refused(tmp_path):
    path = cityjson(tmp_path, 1)
    path.write_text(path.read_text(encoding="utf-8").replace("[0, 0, 64]", "[NaN, 0, 64]"))
    result = run(path, "--out", tmp_path / "country_x" / "area.toml")
    assert isinstance(result.exception, EnvgenError)
    assert "city.json" in str(result.exception)


def test_an_environment_follows_from_the_place_alone():
    """The order of the buildings decides nothing."""
    place = town()
    turned = replace(place, houses=place.houses.take(np.arange(len(place.houses))[::-1]))
    first, second = (learnt_environment(each, BASE, rounds=0) for each in (place, turned))
    assert first.text == second.text
    assert first.profile == second.profile
