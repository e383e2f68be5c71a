import json
import re
import tomllib
from collections.abc import Iterator
from copy import deepcopy
from dataclasses import MISSING, fields
from functools import reduce
from operator import getitem
from pathlib import Path

import pytest

from envgen_usd.environment_files import environments_folder, known_environments, read_profile
from envgen_usd.errors import EnvgenError
from envgen_usd.models.environment_profile import Profile

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
    [
        ("9", "residential", "known: 1, 2"),
        (
            "1",
            "rural",
            "known: agricultural, city_centre, harbour, industrial, residential, suburb",
        ),
    ],
)
def test_unknown_names_list_the_known_ones(country: str, area: str, said: str) -> None:
    with pytest.raises(EnvgenError, match=said):
        read_profile(country, area)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            "density = 16.0",
            'density = "many"',
            "trees: density: expected a number from 0 to 1000, not 'many'$",
        ),
        (
            "frontage = [7.0, 11.0]",
            "frontage = [11.0, 7.0]",
            r"plots: frontage: expected a range \[low, high\] of numbers from 2 to 500, not "
            r"\[11.0, 7.0\]$",
        ),
        ("rows = 1", "rows = 1.5", "plots: rows: expected a whole number from 1 to 10, not 1.5$"),
        ("rows = 1", "rows = true", "plots: rows: expected a whole number from 1 to 10, not true$"),
        ("[description]", "terrain = 1\n[description]", "cannot be read as TOML"),
        (
            'style = "row"',
            'style = "rows"',
            "style: expected one of detached, hall, row, not 'rows'",
        ),
        ('colour = "white"', "colour = 1", "road: marking_colour: expected a text, not 1$"),
        ("mansard = 0.7", "dome = 0.7", "roofs: unknown dome; known: barrel, flat, gabled, "),
        (
            "hedge = 0.5",
            'hedge = "tall"',
            "kinds.hedge: expected a number from 0 to .*, not 'tall'",
        ),
        ("{ bitumen = 1.0 }", "{}", "materials: expected at least 1 with a weight above 0"),
        (
            "{ bitumen = 1.0 }",
            "{ bitumen = 0 }",
            "materials: expected at least 1 with a weight",
        ),
        ("bench = 120.0", "bench = 0.5", "furniture: bench: expected 0 or at least 1, not 0.5"),
        ("rows = 1", "", "plots: missing rows"),
        ("rows = 1", "rows = 1\ncolour = 2", "unknown colour"),
        ("rows = 1", "rwos = 1", "plots: missing rows; unknown rwos; known: "),
        (
            'landuse = "lawn"',
            'landuse = "sea"',
            "plots: landuse: expected one of unknown, road, .*wood, .*quay, road_end, not 'sea'",
        ),
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


def figures(table: object, place: tuple[str | int, ...] = ()) -> Iterator[tuple[str | int, ...]]:
    """Places of all numbers below a table of a TOML file."""
    entries = table.items() if isinstance(table, dict) else enumerate(table)
    for key, value in entries:
        if isinstance(value, dict | list):
            yield from figures(value, (*place, key))
        elif isinstance(value, int | float):
            yield (*place, key)


SHIPPED = environments_folder() / "country_1" / "residential.toml"
PROFILE = tomllib.loads(SHIPPED.read_text())
FIGURES = list(figures(PROFILE))


def test_the_figures_are_all_there() -> None:
    """What follows would pass if it had nothing to look at."""
    assert len(FIGURES) > 100
    assert ("plots", "frontage", 1) in FIGURES
    assert ("trees", "variants", "shape", "lime") in FIGURES


@pytest.mark.parametrize("place", FIGURES, ids=lambda place: ".".join(map(str, place)))
def test_a_figure_out_of_its_range_is_refused(tmp_path: Path, place: tuple[str | int, ...]) -> None:
    """In one line that names the file, the table and the key."""
    *way, last = place
    names = [name for name in place if isinstance(name, str)]
    table, rest = names[0], [re.escape(name) for name in names[1:]]
    (tmp_path / "country_1").mkdir()
    file = tmp_path / "country_1" / "residential.toml"
    start = rf"{re.escape(str(file))}: {table}[.:] ?{'[.:] ?'.join(rest)}: expected "
    others = "".join(text for key, text in NEEDED.items() if key != table)
    profile = {table: deepcopy(PROFILE[table])}
    for value in ("nan", "inf", "-inf", "1e9", "-1e9"):
        reduce(getitem, way, profile)[last] = Figure(value)
        file.write_text(f"{others}{table} = {toml(profile[table])}\n")
        with pytest.raises(EnvgenError) as caught:
            read_profile("1", "residential", tmp_path)
        (line,) = str(caught.value).splitlines()
        assert re.match(start, line), value


class Figure(str):
    """A number as it stands in a file."""

    __slots__ = ()


def toml(value: object) -> str:
    """Tables as inline tables, which hold all that an environment needs."""
    if isinstance(value, Figure):
        return str(value)
    if isinstance(value, dict):
        entries = [f"{json.dumps(key)} = {toml(item)}" for key, item in value.items()]
        return f"{{ {', '.join(entries)} }}"
    if isinstance(value, list):
        return f"[{', '.join(map(toml, value))}]"
    return json.dumps(value)


NEEDED = {
    field.name: f"{field.name} = {toml(PROFILE[field.name])}\n"
    for field in fields(Profile)
    if field.name in PROFILE and field.default is MISSING and field.default_factory is MISSING
}
"""The text of each table without which no file is read; the others would only take time."""
