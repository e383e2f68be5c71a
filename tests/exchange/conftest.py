"""A small built environment, exported once."""

from pathlib import Path

import pytest

from envgen_usd.exchange.environment_export import export_gltf
from envgen_usd.recipe.build_options import BuildOptions, demo_road
from envgen_usd.recipe.environment_build import build

LENGTH = "60"
"""Length of the road in metres."""


@pytest.fixture(scope="session")
def environment(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A street of 60 m with houses, trees and lights."""
    folder = tmp_path_factory.mktemp("environment")
    text = demo_road("straight").read_text().replace('length="400"', f'length="{LENGTH}"')
    road = folder / "street.xodr"
    road.write_text(text)
    build(BuildOptions(road, "1", "residential", folder / "town", workers=1))
    return folder / "town"


@pytest.fixture(scope="session")
def exported(environment: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The environment's glTF files."""
    target = tmp_path_factory.mktemp("exported") / "gltf"
    export_gltf(environment, target)
    return target
