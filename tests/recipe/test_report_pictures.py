"""The report shows the town, or says why it does not."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from tests.kept_work import kept

from envgen_usd.errors import EnvgenError
from envgen_usd.label_taxonomy import label
from envgen_usd.recipe import report_pictures
from envgen_usd.recipe.build_options import BuildOptions, demo_road
from envgen_usd.recipe.environment_build import build
from envgen_usd.render.opengl.gl_context import open_context


@pytest.fixture(scope="module")
def town(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return kept(tmp_path_factory, "report_town", built_street)


def built_street(folder: Path) -> Path:
    road = folder / "street.xodr"
    road.write_text(demo_road("straight").read_text().replace('length="400"', 'length="46"'))
    return build(BuildOptions(road, "1", "residential", folder / "out", workers=1)).stage.parent


def copied(town: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(town, tmp_path / "town"))


def test_the_report_shows_the_town(town, tmp_path):
    try:
        with open_context():
            pass
    except EnvgenError as error:
        pytest.skip(str(error))
    folder = copied(town, tmp_path)
    report = folder / "report.html"
    assert report_pictures.add_pictures(folder / "stage.usda", report) == ""
    page = report.read_text()
    files = sorted(path.name for path in (folder / "report").iterdir())
    assert len(files) == 6
    assert all(f'src="report/{name}"' in page for name in files)
    seen = {
        "birds-eye": ("building", "vegetation", "terrain"),
        "street": ("road", "sidewalk", "building"),
    }
    for view, names in seen.items():
        image = Image.open(folder / "report" / f"{view}_semantic_colour_0.jpg")
        for name in names:
            near = np.abs(np.asarray(image, int) - label(name).colour).max(axis=-1) < 12
            assert near.mean() > 0.002, (view, name)
    rgb = np.asarray(Image.open(folder / "report" / "street_rgb_0.jpg"))
    assert rgb.std() > 20
    assert not [path for path in folder.iterdir() if path.name.startswith(".envgen")]


def test_without_opengl_the_report_says_so(town, tmp_path, monkeypatch):
    def refuse(*_args, **_more):
        raise EnvgenError("render: no OpenGL context")

    monkeypatch.setattr(report_pictures, "render_frames", refuse)
    folder = copied(town, tmp_path)
    report = folder / "report.html"
    assert "no OpenGL" in report_pictures.add_pictures(folder / "stage.usda", report)
    page = report.read_text()
    assert "No pictures of the town: render: no OpenGL context" in page
    assert "<h2>Made</h2>" in page
