"""What a build is given is checked before anything is made, with the library and environments."""

import shutil
from importlib import resources
from pathlib import Path

import pytest

from envgen_usd.errors import EnvgenError
from envgen_usd.recipe.build_inputs import read_inputs
from envgen_usd.recipe.build_options import BuildOptions, demo_road
from envgen_usd.recipe.map_land import read_road

SHIPPED = Path(str(resources.files("envgen_usd.asset_library")))


@pytest.fixture
def library(tmp_path: Path) -> Path:
    """A copy of the shipped library, without its pictures."""
    ignored = shutil.ignore_patterns("textures", "roads")
    return Path(shutil.copytree(SHIPPED, tmp_path / "library", ignore=ignored))


def options(tmp_path: Path, **others: Path) -> BuildOptions:
    road = demo_road("straight")
    return BuildOptions(road, "1", "residential", tmp_path / "out", **others)  # type: ignore[arg-type]


def edit(path: Path, old: str, new: str) -> None:
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))


def test_a_librarys_own_environments_are_used(tmp_path: Path, library: Path) -> None:
    file = library / "environments" / "country_1" / "residential.toml"
    edit(file, "rows = 1", "rows = 2")
    assert read_inputs(options(tmp_path, library=library))[0].plots.rows == 2
    assert read_inputs(options(tmp_path))[0].plots.rows == 1
    others = SHIPPED / "environments"
    named = options(tmp_path, library=library, environments=others)
    assert read_inputs(named)[0].plots.rows == 1, "those that are named win"
    shutil.rmtree(library / "environments")
    assert read_inputs(options(tmp_path, library=library))[0].plots.rows == 1


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("tree_broadleaf", "tree_brodleaf", "trees.assets: unknown asset 'tree_brodleaf'; known: "),
        ("virginia", "virgina", "street_lights.variants.design: unknown variant 'virgina'; known"),
        ('"asphalt"', '"asfalt"', "road: unknown material 'asfalt'; known: "),
    ],
)
def test_what_the_library_lacks_is_said_with_the_environments_file(
    tmp_path: Path, library: Path, old: str, new: str, said: str
) -> None:
    file = library / "environments" / "country_1" / "residential.toml"
    edit(file, old, new)
    with pytest.raises(EnvgenError) as caught:
        read_inputs(options(tmp_path, library=library))
    assert str(caught.value).startswith(f"{file}: {said}")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("tolerance", [0.0, -1.0, 2.0, float("nan")])
def test_a_tolerance_that_makes_no_sense(tolerance: float) -> None:
    with pytest.raises(EnvgenError, match=r"choose a value from 0\.001 m to 1 m"):
        read_road(demo_road("straight"), tolerance)
