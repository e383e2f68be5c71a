"""The colours that CityGML files give materials are those of the library."""

import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from envgen_usd.assets.asset_catalogue import read_catalogue
from envgen_usd.assets.textures.procedural_texture import to_srgb
from envgen_usd.citygml.appearance import appearance_text
from envgen_usd.environment_files import known_environments, read_profile
from envgen_usd.models.city_model import CityObject, ThematicSurface
from envgen_usd.models.polygon_arrays import Polygons

LIBRARY = Path(str(read_catalogue().folder))


def used() -> list[str]:
    """Materials of all environments that have a texture."""
    names: set[str] = {"marking_white", "marking_yellow", "asphalt_worn", "wood", "concrete"}
    for country, areas in known_environments().items():
        for area in areas:
            profile = read_profile(country, area)
            road, rules = profile.road, profile.buildings
            names |= {*road.materials, *road.sidewalk_materials, *road.kerb_materials}
            names |= {*rules.materials, *rules.roof_materials, *rules.flat_roof_materials}
            names |= {*profile.ground_materials.values()}
            names |= {*profile.enclosures.materials["hedge"]}
    return sorted(names)


@pytest.mark.parametrize("name", used())
def test_colour_is_the_mean_of_the_texture(name: str) -> None:
    square = Polygons.of_rings([np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])])
    surface = ThematicSurface("s", "WallSurface", square, 2, name)
    text = appearance_text(CityObject("b", "Building", {}, (surface,)))
    found = re.search(r"<app:diffuseColor>(.*?)</app:diffuseColor>", text)
    assert found is not None
    with Image.open(LIBRARY / "textures" / f"{name}_colour.jpg") as image:
        value = np.asarray(image.convert("RGB")) / 255.0
    linear = np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)
    expected = to_srgb(linear.mean(axis=(0, 1))) / 255.0
    np.testing.assert_allclose([float(v) for v in found[1].split()], expected, atol=0.03)
