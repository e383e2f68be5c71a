"""Ground and road of built stages have no hole: the check of ``benchmarks/watertight.py``."""

import subprocess
import sys
from pathlib import Path

import pytest
from pxr import Usd

from envgen_usd.recipe.build_options import BuildOptions
from envgen_usd.recipe.environment_build import build

TOOL = Path(__file__).resolve().parents[1] / "benchmarks" / "watertight.py"
WIDTH = '<width sOffset="0" a="3.5" b="0" c="0" d="0"/>'
LANES = f"""<lanes><laneSection s="0">
  <left><lane id="1" type="driving">{WIDTH}</lane></left>
  <center><lane id="0" type="none"><roadMark sOffset="0" type="broken" width="0.12"/></lane>
  </center>
  <right><lane id="-1" type="driving">{WIDTH}</lane><lane id="-2" type="sidewalk">{WIDTH}
    <height sOffset="0" inner="0.12" outer="0.12"/></lane></right>
</laneSection></lanes>"""
RISE, HEIGHT = 100.0, 6.5
UP = f'c="{3 * HEIGHT / RISE**2}" d="{-2 * HEIGHT / RISE**3}"'
DOWN = f'c="{-3 * HEIGHT / RISE**2}" d="{2 * HEIGHT / RISE**3}"'


def road(id_, place, length, elevation=""):
    return f"""<road id="{id_}" name="" length="{length}" junction="-1">
      <planView><geometry s="0" {place} length="{length}"><line/></geometry></planView>
      <elevationProfile>{elevation}</elevationProfile>{LANES}</road>"""


def crossing() -> str:
    """A road over another one, and one that crosses it at its own height, over chunk borders."""
    over = (
        f'<elevation s="0" a="0" b="0" {UP}/><elevation s="100" a="{HEIGHT}" b="0" c="0" d="0"/>'
        f'<elevation s="130" a="{HEIGHT}" b="0" {DOWN}/>'
    )
    return f"""<OpenDRIVE><header revMajor="1" revMinor="8"/>
      {road(1, 'x="185" y="150" hdg="1.55"', 80)}
      {road(2, 'x="75" y="195" hdg="0.05"', 230, over)}
      {road(3, 'x="160" y="160" hdg="0.2"', 50)}</OpenDRIVE>"""


def built(path: Path, area: str, out: Path) -> Path:
    options = BuildOptions(
        path, "1", area, out, workers=1, embed_assets=False, metadata_only=True, actors=False
    )
    build(options)
    return out


def check(folder: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, str(TOOL), str(folder)], capture_output=True, text=True, check=False
    )


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    path = tmp_path_factory.mktemp("made") / "crossing.xodr"
    path.write_text(crossing(), encoding="utf-8")
    return built(path, "industrial", path.parent / "out")


def test_a_stage_with_a_bridge_has_no_hole(made):
    found = check(made)
    assert found.returncode == 0, found.stdout
    stage = Usd.Stage.Open(str(made / "stage.usda"))
    categories = {
        prim.GetAttribute("userProperties:category").Get() for prim in stage.TraverseAll()
    }
    assert "bridge" in categories


def test_a_missing_road_is_found(made):
    """The check itself sees what is wrong."""
    path = made / "stage.usda"
    text = path.read_text()
    stage = Usd.Stage.Open(str(path))
    roads = [prim for prim in stage.Traverse() if prim.GetName() == "Roads"]
    max(roads, key=lambda prim: len(prim.GetChildren())).SetActive(False)
    stage.GetRootLayer().Save()
    found = check(made)
    path.write_text(text)
    assert found.returncode == 1
    assert ", 0 open" not in found.stdout


@pytest.mark.long
def test_a_real_crossing_has_no_hole(corpus, tmp_path):
    road = corpus / "asam_osc" / "fabriksgatan.xodr"
    found = check(built(road, "residential", tmp_path / "out"))
    assert found.returncode == 0, found.stdout
