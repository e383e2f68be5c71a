"""What the page on the asset library shows works as it stands there."""

import re
import shutil
import tomllib
from importlib import resources
from pathlib import Path

import pytest
from pxr import Sdf
from typer.testing import CliRunner

from envgen_usd.assets.asset_catalogue import read_catalogue
from envgen_usd.assets.library_check import check_library
from envgen_usd.commands.command_line import app
from envgen_usd.environment_files import read_profile
from envgen_usd.layers.prop_distributions import distributions

SHIPPED = Path(str(resources.files("envgen_usd.asset_library")))


def page_blocks(language: str) -> list[str]:
    text = (SHIPPED / "README.md").read_text(encoding="utf-8")
    return re.findall(rf"```{language}\n(.*?)```", text, flags=re.DOTALL)


@pytest.fixture(scope="module")
def blocks() -> list[str]:
    """Pieces of USD on the page: interface, payload, a variant more, a layer on a stage."""
    return page_blocks("usda")


@pytest.fixture
def library(tmp_path: Path, blocks: list[str]) -> Path:
    interface, payload, variant, _ = blocks
    for part in ("materials", "textures"):
        shutil.copytree(SHIPPED / part, tmp_path / part)
    folder = tmp_path / "assets" / "bin" / "crate"
    start = interface.index('        "green" {')
    grown = interface[:start] + variant + interface[start:]
    for name, text in (("usd", grown), ("payload", payload)):
        (folder / name).mkdir(parents=True)
        (folder / name / "crate.usda").write_text(text, encoding="utf-8")
    return tmp_path


def test_the_example_is_a_sound_asset_with_two_variants(library: Path) -> None:
    catalogue = read_catalogue(library)
    assert catalogue.assets["crate"].variants == {"colour": ("green", "grey")}
    assert check_library(catalogue) == ()


def test_it_takes_turns_with_the_shipped_one(library: Path) -> None:
    shutil.copytree(SHIPPED / "assets", library / "assets", dirs_exist_ok=True)
    found = distributions(read_profile("1", "residential"), read_catalogue(library))["bin"]
    assert found.assets == {"bin": 1.0, "crate": 1.0}


def test_the_layer_on_top_picks_a_variant_that_there_is(blocks: list[str]) -> None:
    layer = Sdf.Layer.CreateAnonymous(".usda")
    assert layer.ImportFromString(blocks[3])
    prim = layer.GetPrimAtPath("/World/chunk_0_0/Props/tree_3_chunk_0_0")
    for name, variant in dict(prim.variantSelections).items():
        assert variant in read_catalogue().assets["tree_broadleaf"].variants[name]
    assert layer.pseudoRoot.GetInfo("upAxis") == "Z"


def test_the_guide_runs_from_an_empty_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All steps before the build, as they stand on the page."""
    monkeypatch.chdir(tmp_path)
    script, counts = page_blocks("python")[0], page_blocks("csv")[0]
    Path("counts.csv").write_text(counts, encoding="utf-8")
    steps = page_blocks("sh")[0].splitlines()
    for step in steps[: next(n for n, line in enumerate(steps) if " build " in line)]:
        program, *words = step.split()
        if program == "python":
            exec(compile(script, words[0], "exec"), {})
            continue
        done = CliRunner().invoke(app, words, catch_exceptions=False)
        assert done.exit_code == 0, f"{step}: {done.output}"
    assert done.output.endswith("assets, 0 findings\n")
    assert (tmp_path / "sheet.png").stat().st_size > 10_000
    environment = tmp_path / "lib/environments/country_1/residential.toml"
    data = tomllib.loads(environment.read_text(encoding="utf-8"))
    bench = data["props"]["bench"]
    assert bench["assets"] == {"bench": 1.0, "trough": 2.0}
    assert bench["variants"]["finish"] == {"plain": 1.0, "painted": 1.0}
    assert data["furniture"]["bench"] == 15.0
    catalogue = read_catalogue(tmp_path / "lib")
    assert catalogue.assets["trough"].variants == {"finish": ("painted", "plain")}
