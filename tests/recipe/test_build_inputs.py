"""What a build is given is checked before anything is made, with the library and environments."""

import re
import shutil
from importlib import resources
from pathlib import Path

import pytest

from envgen_usd.assets.asset_catalogue import read_catalogue
from envgen_usd.errors import EnvgenError
from envgen_usd.recipe.build_inputs import read_inputs, read_land_inputs
from envgen_usd.recipe.build_options import BuildOptions, demo_road
from envgen_usd.recipe.environment_check import library_environment_faults
from envgen_usd.recipe.map_land import read_road

SHIPPED = Path(str(resources.files("envgen_usd.asset_library")))
RIDERS = ("cyclist", "motorcyclist", "pedestrian")
VEHICLES = ("bicycle", "bus", "car", "motorcycle", "train", "truck")
SIGNS = ("traffic_light", "traffic_sign")
LEFT_OUT = (*RIDERS, *VEHICLES, *SIGNS)
"""Kinds with up to a hundred variants an asset: a check of them all takes most of the time."""


@pytest.fixture
def library(tmp_path: Path) -> Path:
    """A copy of the shipped library without some kinds; its pictures are the same files."""

    def copy(source: str, target: str) -> object:
        same = Path(source).parent.name == "textures"
        return Path(target).hardlink_to(source) if same else shutil.copy(source, target)

    ignored = shutil.ignore_patterns("roads", "signs", *LEFT_OUT)
    made = Path(shutil.copytree(SHIPPED, tmp_path / "library", ignore=ignored, copy_function=copy))
    tables = rf"^\[props\.({'|'.join((*LEFT_OUT, 'street_sign'))})[.\]].*?(?=^\[|\Z)"
    for file in made.glob("environments/*/*.toml"):
        text = re.sub(tables, "", file.read_text(), flags=re.DOTALL | re.MULTILINE)
        file.write_text(
            re.sub(r"^street_sign = .*$", "street_sign = 0.0", text, flags=re.MULTILINE)
        )
    return made


def options(tmp_path: Path, **others: Path) -> BuildOptions:
    road = demo_road("straight")
    return BuildOptions(road, "1", "residential", tmp_path / "out", **others)  # type: ignore[arg-type]


def test_a_file_among_the_chunks_is_refused_before_the_work(tmp_path: Path) -> None:
    chunks = tmp_path / "out" / "chunks"
    chunks.mkdir(parents=True)
    (chunks / ".left").touch()  # of a killed build, which the next one removes
    read_inputs(options(tmp_path))
    (chunks / "0_0").touch()
    with pytest.raises(EnvgenError, match=rf"^{chunks}/0_0: is a file among .*; remove it, or"):
        read_inputs(options(tmp_path))


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
    assert read_land_inputs(named).plots.rows == 1, "those that are named win"
    shutil.rmtree(library / "environments")
    assert read_land_inputs(options(tmp_path, library=library)).plots.rows == 1


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            "tree_broadleaf = 3",
            "tree_brodleaf = 3",
            "trees.assets: unknown asset 'tree_brodleaf'; known: ",
        ),
        ("virginia", "virgina", "street_lights.variants.design: unknown variant 'virgina'; known"),
        (" asphalt = 3.0", " asfalt = 3.0", "road.materials: unknown material 'asfalt'; known: "),
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


@pytest.mark.parametrize(
    ("asset", "change", "said"),
    [
        ("bin", ("metersPerUnit = 1", "metersPerUnit = 0.01"), "must be 1.0, but is 0.01"),
        ("bin", ('kind = "component"', 'kind = "group"'), "kind must be component, but is group"),
        ("tree_conifer", ("nominal_size = (", "nominal_size = (9"), "nominal_size"),
        ("bin", ("../payload/round.usdc", "/nowhere/round.usdc"), "leaves the library"),
    ],
)
def test_a_broken_asset_that_the_environment_uses_is_refused(
    tmp_path: Path, library: Path, asset: str, change: tuple[str, str], said: str
) -> None:
    (file,) = library.glob(f"assets/*/{asset}/usd/{asset}.usda")
    edit(file, *change)
    with pytest.raises(EnvgenError) as caught:
        read_inputs(options(tmp_path, library=library))
    message = str(caught.value)
    assert message.startswith(f"{file}")
    assert said in message
    assert "\n" not in message
    assert not (tmp_path / "out").exists()


def test_a_broken_asset_that_the_environment_does_not_use_is_none_of_its_business(
    tmp_path: Path, library: Path
) -> None:
    edit(library / "environments/country_1/residential.toml", "conifer = 1.0", "conifer = 0.0")
    file = library / "assets/tree/tree_conifer/usd/tree_conifer.usda"
    edit(file, 'kind = "component"', 'kind = "group"')
    assert read_inputs(options(tmp_path, library=library))[1].folder == library


def test_furniture_needs_an_asset_of_its_kind(tmp_path: Path, library: Path) -> None:
    shutil.rmtree(library / "assets" / "hydrant")
    with pytest.raises(EnvgenError, match=r"furniture\.hydrant: the library has no asset of the"):
        read_inputs(options(tmp_path, library=library))
    edit(library / "environments/country_1/residential.toml", "hydrant = 400.0", "hydrant = 0.0")
    assert read_inputs(options(tmp_path, library=library))


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("rows = 1", "rows = 0", "residential.toml: plots: rows: expected"),
        (
            "tree_broadleaf = 3",
            "tree_brodleaf = 3",
            "residential.toml: trees.assets: unknown asset",
        ),
        ("virginia", "virgina", "residential.toml: street_lights.variants.design: unknown variant"),
        (
            " asphalt = 3.0",
            " asfalt = 3.0",
            "residential.toml: road.materials: unknown material 'asfalt'",
        ),
    ],
)
def test_the_library_checks_its_environments(library: Path, old: str, new: str, said: str) -> None:
    catalogue = read_catalogue(library)
    assert library_environment_faults(catalogue) == ()
    file = library / "environments" / "country_1" / "residential.toml"
    edit(file, old, new)
    faults = library_environment_faults(catalogue)
    assert faults
    assert all(str(file) in fault for fault in faults)
    assert said in faults[0]


@pytest.mark.parametrize("tolerance", [0.0, -1.0, 2.0, float("nan")])
def test_a_tolerance_that_makes_no_sense(tolerance: float) -> None:
    with pytest.raises(EnvgenError, match=r"choose a value from 0\.001 m to 1 m"):
        read_road(demo_road("straight"), tolerance)
