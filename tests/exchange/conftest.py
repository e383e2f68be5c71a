"""A small built environment, exported once."""

import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from tests.kept_work import kept

from envgen_usd.environment_files import environments_folder
from envgen_usd.exchange.environment_export import export_gltf
from envgen_usd.recipe.build_options import BuildOptions, demo_road
from envgen_usd.recipe.environment_build import build
from envgen_usd.recipe.traffic_build import add_traffic
from envgen_usd.traffic.traces.esmini_csv import read_csv_trace

LENGTH = "46"
"""Length of the road in metres."""
ACTORS = {
    "ahead": ("car", "4.4,1.8,1.5", 0.0, (10.0, -1.8, 8.0)),
    "late": ("car", "4.4,1.8,1.5", 1.0, (30.0, 1.8, -5.0)),
    "walker": ("pedestrian", "0.5,0.5,1.75", 0.0, (20.0, 4.5, 1.4)),
    "rider": ("bicycle", "1.8,0.6,1.7", 0.0, (37.0, -1.8, 3.0)),
}
"""Kind, size, first second, and x, y and speed along x of each actor of two seconds."""


@pytest.fixture(scope="session")
def environment(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A street with houses, trees and lights, and vehicles half on its sidewalk.

    Its land lies in four chunks.
    """
    return kept(tmp_path_factory, "exchange_environment", built_street)


def built_street(folder: Path) -> Path:
    text = (environments_folder() / "country_1" / "residential.toml").read_text()
    profile = folder / "environments" / "country_1" / "residential.toml"
    profile.parent.mkdir(parents=True)
    profile.write_text(re.sub(r"^raised = .*$", "raised = 1.0", text, flags=re.MULTILINE))
    text = demo_road("straight").read_text().replace('length="400"', f'length="{LENGTH}"')
    road = folder / "street.xodr"
    road.write_text(text)
    environments = folder / "environments"
    options = BuildOptions(
        road, "1", "residential", folder / "town", workers=1, environments=environments
    )
    build(options)
    return folder / "town"


@pytest.fixture(scope="session")
def exported(environment: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The environment's glTF files."""
    return kept(tmp_path_factory, "exchange_exported", lambda folder: gltf(environment, folder))


def gltf(stage: Path, folder: Path) -> Path:
    export_gltf(stage, folder / "gltf")
    return folder / "gltf"


@pytest.fixture(scope="session")
def busy(environment, tmp_path_factory) -> Path:
    """The street with actors that move, one of which comes later."""
    return kept(tmp_path_factory, "exchange_busy", lambda home: with_actors(environment, home))


def with_actors(environment: Path, home: Path) -> Path:
    folder = home / "town"
    shutil.copytree(environment, folder)
    rows = [
        f"{t:.1f},{name},{kind},{size},{x + speed * t:.3f},{y},{0.0 if speed > 0 else np.pi}"
        for name, (kind, size, begin, (x, y, speed)) in ACTORS.items()
        for t in np.arange(begin, 2.01, 0.1).tolist()
    ]
    trace = folder.parent / "trace.csv"
    trace.write_text("\n".join(["time,id,kind,length,width,height,x,y,h", *rows]) + "\n")
    add_traffic(folder, lambda: read_csv_trace(trace))
    return folder


@pytest.fixture(scope="session")
def files(busy, tmp_path_factory) -> Path:
    return kept(tmp_path_factory, "exchange_busy_gltf", lambda folder: gltf(busy, folder))
