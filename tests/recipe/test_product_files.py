"""Files of a build are compared with what was written; a build repairs them."""

import shutil
from pathlib import Path

import pytest
from typer.testing import CliRunner

from envgen_usd.commands.command_line import app
from envgen_usd.errors import EnvgenError
from envgen_usd.recipe.build_options import BuildOptions
from envgen_usd.recipe.environment_build import build
from envgen_usd.recipe.product_files import check_products

ROAD = """<OpenDRIVE><header revMajor="1" revMinor="7"/><road id="7" length="30" junction="-1">
<planView><geometry s="0" x="185" y="200" hdg="0" length="30"><line/></geometry></planView>
<lanes><laneSection s="0"><center><lane id="0" type="none"/></center><right>
<lane id="-1" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane>
</right></laneSection></lanes></road></OpenDRIVE>"""
IN_NINE_CHUNKS = ROAD.replace('x="185" y="200"', 'x="90" y="90"')
"""The same road in the middle of a chunk, so that its land reaches into all around it."""


@pytest.fixture(scope="module")
def options(tmp_path_factory):
    folder = tmp_path_factory.mktemp("verify")
    road = folder / "small.xodr"
    road.write_text(ROAD, encoding="utf-8")
    return BuildOptions(road, "1", "residential", folder / "out", workers=1)


@pytest.fixture(scope="module")
def built(options):
    build(options)
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


def test_folders_without_a_build_are_named(built, tmp_path):
    with pytest.raises(EnvgenError, match=r"has no manifest\.json"):
        check_products(tmp_path)
    shutil.copy(built / "manifest.json", tmp_path)
    assert not check_products(tmp_path).whole
    (tmp_path / "manifest.json").write_text("{")
    with pytest.raises(EnvgenError, match="not a manifest"):
        check_products(tmp_path)
