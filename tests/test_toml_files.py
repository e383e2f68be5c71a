"""TOML files as dataclasses: what is read, and what is refused with file, table and key."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from typing import Annotated, Literal

import pytest
from msgspec import Meta

from envgen_usd.errors import EnvgenError
from envgen_usd.toml_files import read_toml


class Colour(IntEnum):
    RED = 1
    DARK_RED = 2


@dataclass(frozen=True)
class Part:
    name: str
    colour: tuple[int, int, int] = (0, 0, 0)


@dataclass(frozen=True)
class Stove:
    heating: Literal["stove"]
    fuel: str = "wood"


@dataclass(frozen=True)
class Pump:
    heating: Literal["pump", "geothermal"]
    power: Annotated[float, Meta(ge=0.0)]


@dataclass(frozen=True)
class House:
    source: str
    width: tuple[float, float]
    free: float
    storeys: Annotated[int, Meta(ge=1)]
    paint: Colour
    roof: Literal["flat", "gabled"]
    weights: Annotated[Mapping[int, float], Meta(min_length=1)]
    part: tuple[Part, ...] = ()
    seen: bool = False
    heat: Stove | Pump | None = None
    place: tuple[float, float, float] | None = None
    floors: tuple[int, ...] = ()
    lamps: Annotated[tuple[tuple[float, float, float], ...], Meta(max_length=2)] = ()
    doors: tuple[str, ...] = ()

    def __post_init__(self):
        if self.free == 13:
            raise ValueError("free: expected another number than 13")


GOOD = """
width = [1, 2.5]
free = 3
storeys = 2
paint = "dark_red"
roof = "flat"
weights = { 4 = 1 }
"""


def read(folder, text):
    (folder / "house.toml").write_text(text)
    return read_toml(folder / "house.toml", House, source="here")


def test_values_have_the_annotated_types(tmp_path):
    text = f'{GOOD}seen = true\n[[part]]\nname = "a"\n[[part]]\nname = "b"\ncolour = [1, 2, 3]\n'
    house = read(tmp_path, text)
    parts = (Part("a"), Part("b", (1, 2, 3)))
    expected = House("here", (1.0, 2.5), 3.0, 2, Colour.DARK_RED, "flat", {4: 1.0}, parts, True)
    assert house == expected
    assert isinstance(house.free, float)
    assert isinstance(house.paint, Colour)


def test_a_union_is_told_apart_by_its_first_field(tmp_path):
    text = GOOD.replace("free = 3", "free = 3\nplace = [1, 2, 3]\nheat = { %s }")
    stove = read(tmp_path, text.replace("%s", 'heating = "stove"'))
    pump = read(tmp_path, text.replace("%s", 'heating = "geothermal", power = 2'))
    assert (stove.heat, stove.place) == (Stove("stove"), (1.0, 2.0, 3.0))
    assert pump.heat == Pump("geothermal", 2.0)
    assert read(tmp_path, GOOD).heat is None


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("free = 3", "", "missing free"),
        ("free = 3", 'fere = 3\nsource = "there"', "missing free; unknown fere, source; known: "),
        ("free = 3", "free = nan", "free: expected a number, not nan"),
        ("free = 3", "free = -inf", "free: expected a number, not -inf"),
        ("free = 3", "free = true", "free: expected a number, not true"),
        ("free = 3", "free = 13", "free: expected another number than 13"),
        ("storeys = 2", "storeys = 0", "storeys: expected a whole number of at least 1, not 0"),
        ("storeys = 2", "storeys = 2.0", "storeys: expected a whole number of at least 1, not 2.0"),
        ("[1, 2.5]", "[2.5, 1]", "width: expected a range [low, high] of numbers, not [2.5, 1]"),
        ("[1, 2.5]", "[1, nan]", "width: expected a range [low, high] of numbers, not [1, nan]"),
        ("[1, 2.5]", "[1]", "width: expected a range [low, high] of numbers, not [1]"),
        ("[1, 2.5]", "1", "width: expected a range [low, high] of numbers, not 1"),
        ('"dark_red"', '"blue"', "paint: expected one of red, dark_red, not 'blue'"),
        ('"dark_red"', "2", "paint: expected one of red, dark_red, not 2"),
        ('"flat"', '"round"', "roof: expected one of flat, gabled, not 'round'"),
        ("{ 4 = 1 }", "4", "weights: expected a table, not 4"),
        ("{ 4 = 1 }", "{}", "weights: expected at least 1 with a weight above 0"),
        ("{ 4 = 1 }", "{ 4 = 0 }", "weights: expected at least 1 with a weight above 0"),
        ("{ 4 = 1 }", '{ 4 = "a" }', "weights.4: expected a number, not 'a'"),
        ("{ 4 = 1 }", "{ a = 1 }", "weights: unknown a; known: a whole number"),
        ("free = 3", "free = 3\npart = 1", "part[0]: expected a table, not 1"),
        ("free = 3", "free = 3\nseen = 1", "seen: expected true or false, not 1"),
        ("free = 3", "free = 3\nheat = 1", "heat: expected a table, not 1"),
        ("free = 3", "free = 3\nheat = {}", "heat: missing heating; known: stove, pump, geother"),
        (
            "free = 3",
            'free = 3\nheat = { heating = "sun" }',
            "heat: heating: expected one of stove, pump, geothermal, not 'sun'",
        ),
        (
            "free = 3",
            'free = 3\nheat = { heating = "stove", power = 1 }',
            "heat: unknown power; known: heating, fuel",
        ),
        (
            "free = 3",
            'free = 3\nheat = { heating = "pump", power = -1 }',
            "heat: power: expected a number of at least 0, not -1",
        ),
        ("free = 3", "free = 3\nplace = [1, 2]", "place: expected 3 numbers, not [1, 2]"),
        ("free = 3", 'free = 3\nfloors = "x"', "floors: expected a list of whole numbers, not 'x'"),
        ("free = 3", "free = 3\nfloors = [1, 2.5]", "floors[1]: expected a whole number, not 2.5"),
        ("free = 3", "free = 3\nfloors = [true]", "floors[0]: expected a whole number, not true"),
        (
            "free = 3",
            "free = 3\nfloors = {}",
            "floors: expected a list of whole numbers, not a tab",
        ),
        (
            "free = 3",
            "free = 3\nfloors = 2026-01-01",
            "floors: expected a list of whole numbers, not",
        ),
        ("free = 3", "free = 3\ndoors = 2", "doors: expected a list of texts, not 2"),
        ("free = 3", "free = 3\nlamps = [[1, 2]]", "lamps[0]: expected 3 numbers, not [1, 2]"),
        (
            "free = 3",
            "free = 3\nlamps = [[1, 2, 3], [1, 2, 3], [1, 2, 3]]",
            "lamps: expected a list of items, each 3 numbers, at most 2, not",
        ),
        ("{ 4 = 1 }", "{ 4 = 1 }\n[[part]]", "part[0]: missing name"),
        ("{ 4 = 1 }", "{ 4 = 1 }\n[[part]]\nname = 1", "part[0]: name: expected a text, not 1"),
        (
            "{ 4 = 1 }",
            '{ 4 = 1 }\n[[part]]\nname = "a"\ncolour = [1, 2]',
            "part[0]: colour: expected 3 whole numbers, not [1, 2]",
        ),
    ],
)
def test_what_does_not_fit_is_named_in_one_line(tmp_path, old, new, said):
    assert old in GOOD
    with pytest.raises(EnvgenError, match=re.escape(said)) as caught:
        read(tmp_path, GOOD.replace(old, new))
    assert str(caught.value).startswith(f"{tmp_path / 'house.toml'}: {said}")
    assert len(str(caught.value).splitlines()) == 1


@pytest.mark.parametrize("content", [b"width = [", b"a = '\xff'", b"a = 1\na = 2"])
def test_a_file_that_is_no_toml_is_named(tmp_path, content):
    path = tmp_path / "house.toml"
    path.write_bytes(content)
    with pytest.raises(EnvgenError, match=r"house\.toml: cannot be read as TOML: "):
        read_toml(path, House)


def test_a_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(EnvgenError, match=r"no\.toml: cannot be read: No such file"):
        read_toml(tmp_path / "no.toml", House)
