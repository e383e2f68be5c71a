"""A street on which actors move, built once, and traces for it."""

import shutil
from pathlib import Path

import pytest
from tests.kept_work import kept

from envgen_usd.recipe.build_options import BuildOptions, demo_road
from envgen_usd.recipe.environment_build import build

LENGTH = "60"
"""Length of the road in metres."""


@pytest.fixture(scope="session")
def street(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A level street of 60 m along x; read only."""
    return kept(tmp_path_factory, "traffic_street", built_street)


def built_street(folder: Path) -> Path:
    text = demo_road("straight").read_text().replace('length="400"', f'length="{LENGTH}"')
    road = folder / "street.xodr"
    road.write_text(text)
    build(BuildOptions(road, "1", "residential", folder / "town", workers=1))
    return folder / "town"


@pytest.fixture
def town(street, tmp_path) -> Path:
    """A copy of the street's build, which a test may change."""
    shutil.copytree(street, tmp_path / "town")
    return tmp_path / "town"
