"""A build of a tiny road that several modules compare theirs with."""

from pathlib import Path

import pytest
from tests.kept_work import kept
from tests.short_roads import TINY_ROAD

from envgen_usd.recipe.build_options import BuildOptions
from envgen_usd.recipe.environment_build import BuildResult, build


def tiny_options(folder: Path, text: str = TINY_ROAD) -> BuildOptions:
    """A build in one process of a road file that is written into the folder."""
    road = folder / "small.xodr"
    road.write_text(text, encoding="utf-8")
    return BuildOptions(road, "1", "residential", folder / "out", workers=1)


@pytest.fixture(scope="session")
def tiny_build(tmp_path_factory: pytest.TempPathFactory) -> BuildResult:
    """The whole build of the tiny road, not interrupted; read only."""
    return kept(tmp_path_factory, "tiny_build", lambda folder: build(tiny_options(folder)))
