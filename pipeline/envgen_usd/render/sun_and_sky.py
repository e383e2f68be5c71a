"""Sun and sky of a stage (UsdLux)."""

from collections.abc import Callable

import numpy as np
from pxr import Usd, UsdGeom, UsdLux

from envgen_usd.models.array_types import FloatArray
from envgen_usd.render.placed_parts import column_matrix
from envgen_usd.render.render_scene import Light
from envgen_usd.render.stage_traversal import world_matrix

_SUN_SHARE = (0.0, 8.0)
"""Least and largest ratio of sun irradiance to sky irradiance: an overcast and a clear day."""
_TOTAL = 1.0
"""Irradiance of sun and sky on the ground after exposure; a larger value brightens images."""
_LOW_SUN = 0.08


def read_light(stage: Usd.Stage, time: Usd.TimeCode) -> Light:
    """The first distant light as the sun, the first dome light as the sky, with a common exposure.

    Programs disagree on the unit of ``intensity``, so only colours and the ratio of sun to sky
    count. The exposure follows from the irradiance of the ground. A stage without lights gets a
    clear afternoon.
    """
    sun = _first(stage, UsdLux.DistantLight)
    sky = _first(stage, UsdLux.DomeLight)
    default = Light()
    if sun is None and sky is None:
        return default
    direction = np.array(default.sun_direction) if sun is None else _towards(stage, sun, time)
    sun_power, sky_power = _power(sun, time), _power(sky, time)
    height = max(float(direction[2]), _LOW_SUN)
    ratio = sun_power.max() / max(sky_power.max(), 1e-9)
    ratio = float(np.clip(ratio, *_SUN_SHARE)) if sky is not None else _SUN_SHARE[1]
    exposure = _TOTAL / (ratio * height + 1.0)
    return Light(
        sun_direction=_triple(direction),
        sun=_triple(_hue(sun_power) * ratio * exposure if sun is not None else np.zeros(3)),
        sky=_triple(_hue(sky_power) * exposure if sky is not None else np.full(3, exposure)),
    )


def _first(stage: Usd.Stage, kind: Callable[[Usd.Prim], object]) -> Usd.Prim | None:
    for prim in stage.Traverse():
        if kind(prim) and UsdGeom.Imageable(prim).ComputeVisibility() != "invisible":
            return prim
    return None


def _towards(stage: Usd.Stage, sun: Usd.Prim, time: Usd.TimeCode) -> FloatArray:
    """Direction to the sun: a distant light shines along its -z."""
    local = column_matrix(UsdGeom.Xformable(sun).ComputeLocalToWorldTransform(time))
    axis: FloatArray = world_matrix(stage)[:3, :3] @ local[:3, 2]
    unit: FloatArray = axis / np.linalg.norm(axis)
    return unit


def _power(prim: Usd.Prim | None, time: Usd.TimeCode) -> FloatArray:
    """Colour times intensity times 2^exposure: 3."""
    if prim is None:
        return np.zeros(3)
    api = UsdLux.LightAPI(prim)
    colour = np.array(api.GetColorAttr().Get(time), np.float64)
    if api.GetEnableColorTemperatureAttr().Get(time):
        kelvin = api.GetColorTemperatureAttr().Get(time)
        colour = colour * np.array(UsdLux.BlackbodyTemperatureAsRgb(kelvin))
    intensity = float(api.GetIntensityAttr().Get(time))
    power: FloatArray = colour * intensity * 2.0 ** float(api.GetExposureAttr().Get(time))
    return power


def _hue(power: FloatArray) -> FloatArray:
    hue: FloatArray = power / max(float(power.max()), 1e-9)
    return hue


def _triple(values: FloatArray) -> tuple[float, float, float]:
    return float(values[0]), float(values[1]), float(values[2])
