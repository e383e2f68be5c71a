"""The colours that CityGML files give materials are those of the library."""

import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from pxr import Usd, UsdShade

from envgen_usd.assets.asset_catalogue import read_catalogue
from envgen_usd.assets.textures.procedural_texture import to_srgb
from envgen_usd.citygml.appearance import appearance_text
from envgen_usd.environment_files import known_environments, read_profile
from envgen_usd.models.city_model import CityObject, ThematicSurface
from envgen_usd.models.polygon_arrays import Polygons

LIBRARY = Path(str(read_catalogue().folder))


def used() -> list[str]:
    """Materials of all environments."""
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
def test_colour_is_that_of_the_material(name: str) -> None:
    """The mean of its texture, or the uniform colour of a material without one."""
    square = Polygons.of_rings([np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])])
    surface = ThematicSurface("s", "WallSurface", square, 2, name)
    text = appearance_text(CityObject("b", "Building", {}, (surface,)))
    found = re.search(r"<app:diffuseColor>(.*?)</app:diffuseColor>", text)
    assert found is not None
    expected = to_srgb(reflectance(name)) / 255.0
    np.testing.assert_allclose([float(v) for v in found[1].split()], expected, atol=0.03)


def reflectance(name: str) -> np.ndarray:
    """Mean reflectance of red, green and blue, by OpenUSD alone."""
    stage = Usd.Stage.Open(str(LIBRARY / "materials" / f"{name}.usda"))
    colour = UsdShade.Shader(stage.GetPrimAtPath(f"/{name}/Surface")).GetInput("diffuseColor")
    if not colour.HasConnectedSource():
        return np.array(colour.Get())
    with Image.open(LIBRARY / "textures" / f"{name}_colour.jpg") as image:
        value = np.asarray(image.convert("RGB")) / 255.0
    linear = np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)
    return linear.mean(axis=(0, 1))
