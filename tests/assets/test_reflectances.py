"""The colours of the shipped materials reflect as much light as measured materials do.

The ranges stand in the library's README with their sources; the images are those that ship.
"""

import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from envgen_usd.assets.asset_catalogue import read_catalogue

LIBRARY = Path(str(read_catalogue().folder))
UNMEASURED = {"bark", "car", "glass", "leaves", "needles", "forest", "wood", "roof", "hedge"}
"""Beginnings of the names of materials without a measured range."""


def ranges() -> dict[str, tuple[float, float]]:
    """Least and largest reflectance by material, from the page's table."""
    text = (LIBRARY / "README.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (`[^|]*) \| ([0-9.]+)–([0-9.]+) \|", text, flags=re.MULTILINE)
    return {
        name: (float(low), float(high))
        for names, low, high in rows
        for name in re.findall(r"`(\w+)`", names)
    }


def linear(name: str) -> np.ndarray:
    """Linear colours of a shipped texture, H x W x 3 (IEC 61966-2-1)."""
    with Image.open(LIBRARY / "textures" / f"{name}_colour.jpg") as image:
        value = np.asarray(image.convert("RGB")) / 255.0
    return np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)


@pytest.mark.parametrize(("name", "limits"), ranges().items())
def test_reflectance_is_in_the_measured_range(name, limits):
    luminance = linear(name).mean(axis=(0, 1)) @ np.array([0.2126, 0.7152, 0.0722])
    assert limits[0] <= luminance <= limits[1]


def test_every_building_and_road_material_has_a_range():
    textured = {
        path.name.removesuffix("_colour.jpg") for path in LIBRARY.glob("textures/*_colour.jpg")
    }
    measured = set(ranges())
    assert measured <= textured
    rest = textured - measured
    assert {name.split("_")[0] for name in rest} <= UNMEASURED


@pytest.mark.parametrize("name", sorted(ranges()))
def test_no_texture_has_a_seam(name):
    """Across the wrap of the shipped image neighbours differ no more than anywhere else."""
    colour = linear(name)
    for axis in (0, 1):
        steps = np.abs(np.diff(colour, axis=axis)).mean(axis=(1 - axis, 2))
        ends = np.take(colour, 0, axis) - np.take(colour, -1, axis)
        assert np.abs(ends).mean() <= steps.max() * 1.05


def test_footways_are_not_paler_than_roads():
    """CamVid's pavements are a little darker than its roads; a paler one would give it away."""
    assert linear("paving_asphalt").mean() < linear("asphalt").mean() < linear("paving_pale").mean()
