"""Files of a build are compared with what was written; a build repairs them."""

import shutil
from pathlib import Path

import pytest
from tests.recipe.conftest import tiny_options
from typer.testing import CliRunner

from envgen_usd.commands.command_line import app
from envgen_usd.errors import EnvgenError
from envgen_usd.recipe.environment_build import build
from envgen_usd.recipe.product_files import check_products


@pytest.fixture(scope="module")
def options(tiny_build, tmp_path_factory):
    """Of a build in a folder of its own, as tests damage it."""
    chosen = tiny_options(tmp_path_factory.mktemp("verify"))
    shutil.copytree(tiny_build.stage.parent, chosen.out)
    return chosen


@pytest.fixture(scope="module")
def built(options):
    return options.out


def verify(folder):
    return CliRunner().invoke(app, ["verify", str(folder)])


def flip_bit(path: Path) -> None:
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)


def test_an_untouched_build_is_whole(built):
    check = check_products(built)
    assert not check.faults
    assert not check.unknown
    # Whatever the build wrote for others to read is checked: stage, layers, chunks, pictures.
    written = [
        p for p in built.rglob("*") if p.suffix in {".usda", ".usdc", ".tif", ".gml", ".jpg"}
    ]
    reports = [p for p in written if "report" in p.parts]
    assert check.whole >= len(written) - len(reports) > 20
    assert verify(built).exit_code == 0


def test_each_damage_is_named_and_the_same_build_repairs_it(built, options):
    chunk = next(path.parent.name for path in built.glob("chunks/*/roads.usdc"))
    texture = next((built / "textures").glob("*.jpg")).relative_to(built)
    flip_bit(built / "chunks" / chunk / "roads.usdc")
    (built / "layers" / "props.usda").unlink()
    (built / texture).write_bytes(b"")
    (built / "layers" / "mine.usda").write_text("#usda 1.0\n")
    result = verify(built)
    assert result.exit_code == 1
    assert f"chunks/{chunk}/roads.usdc: differs from the written file" in result.output
    assert "layers/props.usda: is missing" in result.output
    assert f"{texture.as_posix()}: differs" in result.output
    assert "layers/mine.usda: is not in the manifest" in result.output
    assert "3 damaged, 1 others" in result.output
    (built / "layers" / "mine.usda").unlink()
    issues = build(options).issues
    named = {issue.where for issue in issues if issue.kind == "build.damaged"}
    assert named == {f"chunks/{chunk}/roads.usdc", "layers/props.usda", texture.as_posix()}
    assert verify(built).exit_code == 0
    assert not [issue for issue in build(options).issues if issue.kind == "build.damaged"]


def test_an_artists_layer_beside_the_stage_stays_the_artists(built, options):
    mine = built / "mine.usda"
    for text in ("#usda 1.0\n", '#usda 1.0\ndef "World"\n{\n}\n'):
        mine.write_text(text)
        build(options)
        result = verify(built)
        assert result.exit_code == 0, result.output
        assert mine.read_text() == text
        assert "0 damaged, 1 others" in result.output
    mine.unlink()


def test_folders_without_a_build_are_named(built, tmp_path):
    with pytest.raises(EnvgenError, match=r"has no manifest\.json"):
        check_products(tmp_path)
    shutil.copy(built / "manifest.json", tmp_path)
    assert not check_products(tmp_path).whole
    (tmp_path / "manifest.json").write_text("{")
    with pytest.raises(EnvgenError, match="not a manifest"):
        check_products(tmp_path)
