import dataclasses
from pathlib import Path

import numpy as np
import pytest
import torch

from envgen_usd.chunks import Chunk
from envgen_usd.errors import EnvgenError
from envgen_usd.geometry.road_outline import Outline
from envgen_usd.landuse.network.data.height_sample import HEIGHT_CONDITIONS
from envgen_usd.landuse.network.heights.height_evaluation import (
    by_height_network,
    by_membrane,
    height_windows,
    score_heights,
)
from envgen_usd.landuse.network.model.generator import make_generator
from envgen_usd.landuse.network.model.network_config import NetworkConfig
from envgen_usd.landuse.network.shipped_weights import SHIPPED_HEIGHTS, find_height_weights
from envgen_usd.landuse.network.tasks.height_task import HEIGHT_FIELDS
from envgen_usd.landuse.network.training.weights_file import read_network, write_weights
from envgen_usd.models.land_rules import TerrainRules
from envgen_usd.recipe.build_options import BuildOptions, demo_road
from envgen_usd.recipe.map_land import given_land, read_road, terrain_file
from envgen_usd.terrain.heightmaps import build_heightmaps

TINY = NetworkConfig(
    HEIGHT_FIELDS,
    HEIGHT_CONDITIONS,
    head=(8, 8, 8),
    dim=8,
    heads=2,
    style=8,
    mapping=1,
    refine=(8, 8, 8, 8),
    target="height",
)
OPTIONS = BuildOptions(demo_road("straight"), "1", "residential", Path("out"))
RULES = TerrainRules(0.0, 120.0, 0.5)


def test_a_road_is_laid_into_the_land_of_a_network(tmp_path):
    torch.manual_seed(0)
    path = tmp_path / "height.safetensors"
    write_weights(make_generator(TINY), path)
    options = dataclasses.replace(OPTIONS, terrain_network=path)
    _, surface = read_road(options.road, options.tolerance)
    low = np.floor(surface.vertices[:, :2].min(axis=0) / 200).astype(int)
    chunks = [Chunk(int(low[0]) + n, int(low[1])) for n in (0, 1)]
    land = given_land(options, surface, chunks)
    maps = build_heightmaps(surface, chunks, RULES, 0, land)
    west, east = (maps[chunk].heights for chunk in chunks)
    assert np.array_equal(west[:, -1], east[:, 0])
    assert np.ptp(west) > 0.1  # it is not the ground that the road alone tells
    x, y = chunks[0].corner_axes()
    places = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    distance, foot = Outline.of(surface).nearest(places)
    near = distance < 0.3
    assert np.allclose(west.ravel()[near], foot[near, 2], atol=0.3)


def test_land_comes_from_one_source(tmp_path):
    assert terrain_file(OPTIONS) is None
    dem = dataclasses.replace(OPTIONS, heightmap=tmp_path / "dem.tif")
    assert terrain_file(dem) == tmp_path / "dem.tif"
    missing = dataclasses.replace(OPTIONS, terrain_network=tmp_path / "no.safetensors")
    with pytest.raises(EnvgenError, match="no such file"):
        terrain_file(missing)
    both = dataclasses.replace(dem, terrain_network=tmp_path)
    with pytest.raises(EnvgenError, match="exclude"):
        terrain_file(both)


def test_land_of_the_shipped_network_passes_by_the_road():
    options = dataclasses.replace(OPTIONS, terrain_network=Path("shipped"))
    assert terrain_file(options).is_file()
    _, surface = read_road(options.road, options.tolerance)
    low = np.floor(surface.vertices[:, :2].min(axis=0) / 200).astype(int)
    land = given_land(
        options,
        surface,
        [Chunk(*low.tolist())],
    )
    lines = surface.vertices[:: max(1, len(surface.vertices) // 50)]
    assert np.allclose(land(lines), lines[:, 2], atol=3.0)


def test_the_shipped_network_knows_more_than_the_ground_between_roads():
    """On generated hills, where it was not trained: measured 14 % less."""
    windows = height_windows(16, 3)
    network = read_network(find_height_weights(SHIPPED_HEIGHTS), "height")
    made, known = (score_heights(windows, way) for way in (by_height_network(network), by_membrane))
    assert made.rmse < 0.95 * known.rmse
