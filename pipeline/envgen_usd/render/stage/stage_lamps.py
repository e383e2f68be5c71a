"""Reads lamps (UsdLux) as points with a beam."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pxr import Usd, UsdLux

from envgen_usd.models.array_types import FloatArray
from envgen_usd.render.render_scene import Lamps
from envgen_usd.render.stage.typed_values import BadValueError, number, numbers


@dataclass(frozen=True)
class Lamp:
    """A lamp in its own space; its beam points along -z.

    Attributes:
        power: 3, linear RGB: illuminance at distance 1 on the axis.
        grows: True if the power grows with the square of the lamp's scale.
        flat: True if the light falls with the cosine to the axis.
        edge: Cosine between the axis and the beam's edge; -1 without an edge.
    """

    power: FloatArray
    grows: bool
    flat: bool
    edge: float


def read_lamp(prim: Usd.Prim, time: Usd.TimeCode) -> Lamp | None:
    """Reads a sphere, disk, rectangle or cylinder light; `None` for any other prim.

    Its radiance is that of UsdLux: colour times intensity times 2^exposure, divided by the area
    with ``normalize``. Sun and sky are read by `sun_and_sky`.

    Raises:
        BadValueError: A size or its light is no finite number.
    """
    size = _size(prim, time)
    if size is None:
        return None
    seen, area, flat = size
    radiance = light_power(prim, time)
    normalized = bool(UsdLux.LightAPI(prim).GetNormalizeAttr().Get(time))
    if normalized:
        radiance = radiance / max(area, 1e-12)
    shaping = UsdLux.ShapingAPI(prim).GetShapingConeAngleAttr()
    cone = number(shaping, time) if shaping and shaping.HasValue() else 180.0
    edge = -1.0 if cone >= 180.0 else float(np.cos(np.radians(cone)))
    return Lamp(_finite(radiance * seen), not normalized, flat, edge)


def light_power(prim: Usd.Prim, time: Usd.TimeCode) -> FloatArray:
    """Returns colour times intensity times 2^exposure of a light: 3.

    Raises:
        BadValueError: One of them, or the product, is no finite number.
    """
    api = UsdLux.LightAPI(prim)
    colour = numbers(api.GetColorAttr(), time, 3)
    if api.GetEnableColorTemperatureAttr().Get(time):
        kelvin = number(api.GetColorTemperatureAttr(), time)
        colour = colour * np.array(UsdLux.BlackbodyTemperatureAsRgb(kelvin))
    exposure = number(api.GetExposureAttr(), time)
    with np.errstate(over="ignore"):
        power: FloatArray = colour * number(api.GetIntensityAttr(), time) * np.exp2(exposure)
    return _finite(power)


def _finite(power: FloatArray) -> FloatArray:
    if not np.isfinite(power).all():
        raise BadValueError("its light is not finite")
    return power


def _size(prim: Usd.Prim, time: Usd.TimeCode) -> tuple[float, float, bool] | None:
    """Returns the area seen along the axis, the whole area, and whether the light is flat."""
    if sphere := UsdLux.SphereLight(prim):
        radius = number(sphere.GetRadiusAttr(), time)
        return np.pi * radius**2, 4.0 * np.pi * radius**2, False
    if disk := UsdLux.DiskLight(prim):
        radius = number(disk.GetRadiusAttr(), time)
        return np.pi * radius**2, np.pi * radius**2, True
    if rect := UsdLux.RectLight(prim):
        area = number(rect.GetWidthAttr(), time) * number(rect.GetHeightAttr(), time)
        return area, area, True
    if tube := UsdLux.CylinderLight(prim):
        radius, length = (number(a, time) for a in (tube.GetRadiusAttr(), tube.GetLengthAttr()))
        return 2.0 * radius * length, 2.0 * np.pi * radius * length, False
    return None


def placed_lamps(found: Sequence[tuple[Lamp, FloatArray]]) -> Lamps:
    """Joins lamps with their placements (N x 4 x 4, to the world)."""
    placed = [_placed(lamp, matrices) for lamp, matrices in found]
    if not placed:
        return Lamps()
    columns = (np.concatenate(column) for column in zip(*placed, strict=True))
    return Lamps(*columns)


def _placed(lamp: Lamp, matrices: FloatArray) -> tuple[FloatArray, ...]:
    count = len(matrices)
    scale = np.cbrt(np.abs(np.linalg.det(matrices[:, :3, :3])))
    powers = lamp.power * (scale**2 if lamp.grows else np.ones(count))[:, None]
    axes = -matrices[:, :3, 2] / np.maximum(scale, 1e-12)[:, None]
    flat, edges = np.full(count, float(lamp.flat)), np.full(count, lamp.edge)
    return matrices[:, :3, 3], powers, axes, flat, edges
