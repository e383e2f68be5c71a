from pathlib import Path

import pytest

from envgen_usd.errors import EnvgenError
from envgen_usd.profiles import environments_folder, known_environments, read_profile

# Table A1 of the article, as words.
TABLE_A1 = {
    "general ground type": ("green grass", "green grass", "green grass", "green grass"),
    "road markings": ("white", "white", "yellow", "yellow"),
    "plot size": ("medium", "long, narrow", "large", "medium"),
    "house size": (
        "large warehouses",
        "tall inner-city style",
        "large warehouses",
        "small rural",
    ),
    "house material": ("sheet metal", "red brick", "sheet metal", "flagstone"),
    "windows": ("few", "many", "few", "normal"),
    "ground type": ("rubble", "fit green grass", "rubble", "fit green grass"),
    "street light type": ("Virginia", "Virginia", "New York", "New York"),
    "tree density": ("low", "high", "low", "high"),
}
ORDER = [("1", "industrial"), ("1", "residential"), ("2", "industrial"), ("2", "residential")]


def test_environments_hold_the_articles_table() -> None:
    for column, (country, area) in enumerate(ORDER):
        expected = {name: row[column] for name, row in TABLE_A1.items()}
        assert dict(read_profile(country, area).description) == expected


def test_figures_agree_with_the_words() -> None:
    profiles = {key: read_profile(*key) for key in ORDER}
    for profile in profiles.values():
        words = profile.description
        assert profile.road.marking_colour == words["road markings"]
        design = words["street light type"].lower().replace(" ", "_")
        assert set(profile.street_lights.variants["design"]) == {design}
        assert set(profile.buildings.materials) & {
            words["house material"].replace(" ", "_"),
            "_".join(reversed(words["house material"].split())),
        }
    area = {key: sum(p.plots.frontage) * sum(p.plots.depth) for key, p in profiles.items()}
    assert area["2", "industrial"] > area["1", "industrial"] > area["2", "residential"]
    narrow = profiles["1", "residential"].plots
    assert narrow.depth[0] > 2 * narrow.frontage[1]
    windows = {key: sum(p.buildings.windows.spacing) for key, p in profiles.items()}
    assert windows["1", "residential"] < windows["2", "residential"] < windows["1", "industrial"]
    trees = {key: p.trees.density for key, p in profiles.items()}
    assert min(trees["1", "residential"], trees["2", "residential"]) > 3 * trees["1", "industrial"]


def test_a_new_environment_is_a_new_file(tmp_path: Path) -> None:
    source = environments_folder() / "country_1" / "residential.toml"
    (tmp_path / "country_moon").mkdir()
    (tmp_path / "country_moon" / "crater.toml").write_text(source.read_text())
    assert known_environments(tmp_path) == {"moon": ("crater",)}
    assert read_profile("moon", "crater", tmp_path).country == "moon"


@pytest.mark.parametrize(
    ("country", "area", "said"),
    [("9", "residential", "known: 1, 2"), ("1", "rural", "known: industrial, residential")],
)
def test_unknown_names_list_the_known_ones(country: str, area: str, said: str) -> None:
    with pytest.raises(EnvgenError, match=said):
        read_profile(country, area)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("density = 16.0", 'density = "many"', "trees: density: expected float, found 'many'"),
        ("frontage = [7.0, 11.0]", "frontage = [11.0, 7.0]", "frontage: expected a range"),
        ("rows = 1", "", "plots: missing rows"),
        ("rows = 1", "rows = 1\ncolour = 2", "unknown colour"),
        ("rows = 1", "rwos = 1", "plots: missing rows; unknown rwos; known: "),
        ('landuse = "lawn"', 'landuse = "sea"', "unknown landuse 'sea'; known: "),
        ("[terrain]", "[terrain", "cannot be read as TOML"),
    ],
)
def test_bad_files_say_where(tmp_path: Path, old: str, new: str, said: str) -> None:
    text = (environments_folder() / "country_1" / "residential.toml").read_text()
    assert old in text
    (tmp_path / "country_1").mkdir()
    (tmp_path / "country_1" / "residential.toml").write_text(text.replace(old, new))
    with pytest.raises(EnvgenError, match=said) as caught:
        read_profile("1", "residential", tmp_path)
    assert "residential.toml" in str(caught.value)
