"""Writes sun, sky and air: the layer `atmosphere.usda` with a variant for each weather."""

from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path

import numpy as np
from pxr import Gf, Sdf

from envgen_usd.assets.prim_authoring import add_prim, set_attribute, set_pose
from envgen_usd.assets.usd_files import new_layer, write_layer
from envgen_usd.light.radiance_map import write_radiance_map
from envgen_usd.light.sky import make_atmosphere, sun_behind_clouds
from envgen_usd.light.weather import Moment, Weather, read_weathers
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.atmosphere import STAGE_UNIT, Atmosphere
from envgen_usd.seeds import generator
from envgen_usd.whole_files import make_folder

NAME = "atmosphere"
SET = "weather"
"""Variant set of the environment prim; one variant for each file in `renders/weathers`."""
DEFAULT = "clear"
SKIES = "skies"
"""Folder of the sky maps beside the stage."""
_ROWS = 256
"""Rows of a sky map; a larger value gives sharper clouds and larger files."""
_AZIMUTH = 215.0
"""Azimuth of the sun, degrees clockwise from north (+y)."""
_ANGLE = 0.53
"""Angular diameter of the sun, degrees."""
_DRAWS = 16
"""Patterns of clouds among which a weather's is chosen; a larger value shows the sun more often."""
_KEPT = 20
"""Skies that a process keeps for other stages of its seed; each takes 1.6 MB."""
_CLOSED = 0.7
"""Share of a closed layer of clouds from which on nobody expects the sun."""
_DOME_STOPS = 2
"""Stops that a dome light has as intensity and gives back as exposure.

By UsdLux they cancel. Cycles reads a distant light with four times its intensity, and a dome light
without its exposure, when Blender 5.0 imports a stage. Sun and sky then agree there, too.
"""


def write_atmosphere(folder: Path, seed: int) -> None:
    """Writes ``layers/atmosphere.usda`` and ``skies/<weather>.exr``.

    Args:
        folder: Output folder of the stage.
        seed: Random seed of the clouds.

    Raises:
        EnvgenError: A file cannot be written.
    """
    make_folder(folder / SKIES)
    skies = {name: _sky(name, weather, seed) for name, weather in read_weathers().items()}
    for name, atmosphere in skies.items():
        write_radiance_map(folder / SKIES / f"{name}.exr", atmosphere.sky / STAGE_UNIT)
    write_layer(_layer(skies), folder / "layers" / f"{NAME}.usda")


@lru_cache(maxsize=_KEPT)
def _sky(name: str, weather: Weather, seed: int) -> Atmosphere:
    """The middle of a weather's ranges, with clouds that hide the sun least.

    Objects would have no shadows in a low sun if a cloud happened to hide it for good.
    """
    elevation, azimuth = np.radians(np.mean(weather.elevation)), np.radians(_AZIMUTH)
    level = np.cos(elevation)
    sun = np.array([level * np.sin(azimuth), level * np.cos(azimuth), np.sin(elevation)])
    moment = Moment.drawn(weather)
    draws = _DRAWS if sun[2] > 0.0 and moment.overcast < _CLOSED else 1
    hidden = [
        sun_behind_clouds(moment, sun, generator(seed, NAME, name, number), _ROWS)
        for number in range(draws)
    ]
    best = int(np.argmin(hidden))
    return make_atmosphere(moment, sun, generator(seed, NAME, name, best), _ROWS)


def _layer(skies: Mapping[str, Atmosphere]) -> Sdf.Layer:
    layer = new_layer("World")
    world = add_prim(layer, "World", specifier=Sdf.SpecifierOver)
    environment = add_prim(world, "Environment", "Scope")
    environment.variantSetNameList.prependedItems = [SET]
    environment.variantSelections[SET] = DEFAULT
    weathers = Sdf.VariantSetSpec(environment, SET)
    for name, atmosphere in skies.items():
        _add_lights(Sdf.VariantSpec(weathers, name).primSpec, name, atmosphere)
    return layer


def _add_lights(prim: Sdf.PrimSpec, name: str, atmosphere: Atmosphere) -> None:
    types = Sdf.ValueTypeNames
    visibility, wetness = atmosphere.visibility, atmosphere.wetness
    set_attribute(prim, "envgen:visibility", types.Float, visibility, custom=True)
    set_attribute(prim, "envgen:wetness", types.Float, wetness, custom=True)
    set_attribute(prim, "envgen:rain", types.Float, atmosphere.rain, custom=True)
    sun = add_prim(prim, "Sun", "DistantLight")
    strength = float(atmosphere.sun.max()) / STAGE_UNIT
    hue = atmosphere.sun / max(float(atmosphere.sun.max()), 1e-9)
    set_attribute(sun, "inputs:angle", types.Float, _ANGLE)
    # With `normalize`, the intensity is the irradiance of a surface that faces the sun.
    set_attribute(sun, "inputs:normalize", types.Bool, True)
    set_attribute(sun, "inputs:intensity", types.Float, strength)
    set_attribute(sun, "inputs:color", types.Color3f, Gf.Vec3f(*hue.tolist()))
    set_pose(sun, rotate=_turn_to(atmosphere.sun_direction))
    sky = add_prim(prim, "Sky", "DomeLight")
    set_attribute(sky, "inputs:intensity", types.Float, 2.0**_DOME_STOPS)
    set_attribute(sky, "inputs:exposure", types.Float, -float(_DOME_STOPS))
    texture = Sdf.AssetPath(f"../{SKIES}/{name}.exr")
    set_attribute(sky, "inputs:texture:file", types.Asset, texture)
    set_attribute(sky, "inputs:texture:format", types.Token, "latlong")
    # A dome light is y-up.
    set_pose(sky, rotate=np.array([90.0, 0.0, 0.0]))


def _turn_to(direction: FloatArray) -> FloatArray:
    """Angles of rotateXYZ (degrees) that turn +z, against which the light shines, to a vector."""
    elevation = np.degrees(np.arcsin(np.clip(direction[2], -1.0, 1.0)))
    azimuth = np.degrees(np.arctan2(direction[0], direction[1]))
    return np.array([90.0 - elevation, 0.0, 180.0 - azimuth])
