"""Sun, sky and air of a stage (UsdLux)."""

import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pxr import Sdf, Usd, UsdGeom, UsdLux
from scipy.ndimage import map_coordinates

from envgen_usd.errors import EnvgenError, Issue, Severity
from envgen_usd.light.radiance_map import read_radiance_map
from envgen_usd.light.sky import make_atmosphere
from envgen_usd.light.sky_directions import ground_illuminance, sky_directions, sky_places
from envgen_usd.light.weather import Moment, read_weather
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.atmosphere import Atmosphere
from envgen_usd.render.stage.placed_parts import column_matrix
from envgen_usd.render.stage.resolved_files import read_resolved
from envgen_usd.render.stage.stage_lamps import light_power
from envgen_usd.render.stage.stage_traversal import world_matrix
from envgen_usd.render.stage.typed_values import BadValueError, number

VISIBILITY, WETNESS, RAIN = "envgen:visibility", "envgen:wetness", "envgen:rain"
"""Attributes of the prim above the lights: metres, share of the ground under water, mm/h."""
_CLEAR_AIR = 40_000.0
"""Visibility in metres of a stage that gives none."""
_STRONGEST_SUN = 8.0
"""Largest ratio of the sun's irradiance to the sky's."""
_PLAIN_ROWS = 8
"""Rows of the map of a sky without a texture."""
_AFTERNOON = (0.4, -0.5, 0.768)
"""Direction to the sun on a stage without lights."""


def read_light(stage: Usd.Stage, time: Usd.TimeCode) -> tuple[Atmosphere, list[Issue]]:
    """The first distant light as the sun, the first dome light as the sky.

    Programs disagree on the unit of ``intensity``, so only colours, the texture of the sky and the
    ratio of sun to sky count. A distant light with ``normalize`` gives its irradiance; without it,
    as many programs write it, its intensity is taken as irradiance over pi. A stage without lights
    gets a clear afternoon. A light whose power or axes are no finite numbers is left out, and so
    are further suns and skies; each is an issue.
    """
    issues: list[Issue] = []
    found = _lights(stage)
    sun, sky = (_usable(stage, _first(lights), time, issues) for lights in found)
    issues += (issue for lights in found for issue in _unused(lights))
    if sun is None and sky is None:
        clear = Moment.drawn(read_weather("clear"))
        return make_atmosphere(clear, np.array(_AFTERNOON), np.random.default_rng(0), 64), issues
    direction = np.array(_AFTERNOON) if sun is None else _towards(stage, sun, time)
    dome = np.ones((_PLAIN_ROWS, 2 * _PLAIN_ROWS, 3), np.float32)
    if sky is not None:
        dome = _dome(stage, sky, time, issues)
    power = _power(sun, time) * (1.0 if _is_normalized(sun, time) else np.pi)
    of_sky = ground_illuminance(dome)
    if sky is not None and of_sky.max() > 0.0:
        power = power * min(1.0, _STRONGEST_SUN * of_sky.max() / max(power.max(), 1e-9))
    light = sun or sky
    assert light is not None
    air = light.GetParent()
    return Atmosphere(
        sun_direction=direction,
        sun=power,
        sky=dome,
        visibility=_number(air, VISIBILITY, time, _CLEAR_AIR),
        wetness=_number(air, WETNESS, time, 0.0),
        lamp_unit=1.0,
        rain=_number(air, RAIN, time, 0.0),
    ), issues


def has_light(stage: Usd.Stage) -> bool:
    """True if the loaded part of a stage has a visible sun or sky."""
    return any(_lights(stage))


def _lights(stage: Usd.Stage) -> tuple[list[Usd.Prim], list[Usd.Prim]]:
    """The visible distant lights and dome lights."""
    suns: list[Usd.Prim] = []
    skies: list[Usd.Prim] = []
    for prim in stage.Traverse():
        if not prim.HasAPI("LightAPI"):
            continue
        if UsdGeom.Imageable(prim).ComputeVisibility() == UsdGeom.Tokens.invisible:
            continue
        if prim.IsA("DistantLight"):
            suns.append(prim)
        if prim.IsA("DomeLight"):
            skies.append(prim)
    return suns, skies


def _first(lights: list[Usd.Prim]) -> Usd.Prim | None:
    return lights[0] if lights else None


def _unused(lights: list[Usd.Prim]) -> Iterator[Issue]:
    """Issues of the lights after the first."""
    for light in lights[1:]:
        text = f"a stage has one {light.GetTypeName()}, and {lights[0].GetPath()} is the first"
        where = str(light.GetPath())
        yield Issue("light.unused", Severity.WARNING, where, text, "left out; hide one of them")


def _usable(
    stage: Usd.Stage, light: Usd.Prim | None, time: Usd.TimeCode, issues: list[Issue]
) -> Usd.Prim | None:
    """The light, `None` if its power or its axes are no finite numbers."""
    if light is None:
        return None
    try:
        light_power(light, time)
        _axes(stage, light, time)
    except BadValueError as error:
        where = str(light.GetPath())
        issues.append(Issue("light.value", Severity.WARNING, where, str(error), "left out"))
        return None
    return light


def _number(prim: Usd.Prim, name: str, time: Usd.TimeCode, otherwise: float) -> float:
    try:
        return number(prim.GetAttribute(name), time) if prim.HasAttribute(name) else otherwise
    except BadValueError:
        return otherwise


def _axes(stage: Usd.Stage, prim: Usd.Prim, time: Usd.TimeCode) -> FloatArray:
    """Rotation from the light's axes to the world, 3 x 3.

    Raises:
        BadValueError: It is not finite, or an axis has no length.
    """
    local = column_matrix(UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(time))
    turned = (world_matrix(stage) @ local)[:3, :3]
    lengths = np.linalg.norm(turned, axis=0)
    if not (np.isfinite(lengths) & (lengths > 0.0)).all():
        raise BadValueError("its axes are not finite, or have no length")
    axes: FloatArray = turned / lengths
    return axes


def _towards(stage: Usd.Stage, sun: Usd.Prim, time: Usd.TimeCode) -> FloatArray:
    """Direction to the sun: a distant light shines along its -z."""
    direction: FloatArray = _axes(stage, sun, time)[:, 2]
    return direction


def _is_normalized(sun: Usd.Prim | None, time: Usd.TimeCode) -> bool:
    return sun is not None and bool(UsdLux.LightAPI(sun).GetNormalizeAttr().Get(time))


def _power(prim: Usd.Prim | None, time: Usd.TimeCode) -> FloatArray:
    return np.zeros(3) if prim is None else light_power(prim, time)


def _read_image(path: str) -> NDArray[np.float32]:
    """Reads a texture by its resolved path, perhaps inside a package."""
    with tempfile.NamedTemporaryFile(suffix=".exr") as file:
        file.write(read_resolved(path))
        file.flush()
        return read_radiance_map(Path(file.name))


def _dome(
    stage: Usd.Stage, sky: Usd.Prim, time: Usd.TimeCode, issues: list[Issue]
) -> NDArray[np.float32]:
    """The radiance of a dome light, as a sky map."""
    power = _power(sky, time)
    asset = UsdLux.DomeLight(sky).GetTextureFileAttr().Get(time)
    path = asset.resolvedPath if isinstance(asset, Sdf.AssetPath) else ""
    plain = np.broadcast_to(power, (_PLAIN_ROWS, 2 * _PLAIN_ROWS, 3)).astype(np.float32)
    if not isinstance(asset, Sdf.AssetPath) or not asset.path:
        return plain
    try:
        if not path:
            raise FileNotFoundError("no such file")
        image = _read_image(path)
    except (OSError, ValueError, EnvgenError) as error:
        text, action = f"{asset.path}: {error}", "the sky has a single colour"
        issues.append(Issue("light.texture", Severity.WARNING, str(sky.GetPath()), text, action))
        return plain
    rows = max(len(image), _PLAIN_ROWS)
    # A dome light is y-up and its map OpenEXR's; a sky map is the same turned to z-up.
    local = sky_directions(rows) @ _axes(stage, sky, time)
    turned = np.stack([local[..., 0], -local[..., 2], local[..., 1]], axis=-1)
    places = np.moveaxis(sky_places(turned, len(image)), -1, 0)
    places[1] *= image.shape[1] / (2 * len(image))
    wrapped = np.concatenate([image[:, -1:], image, image[:, :1]], axis=1)
    places[1] += 1.0
    values = [map_coordinates(wrapped[..., k], places, order=1, mode="nearest") for k in range(3)]
    dome: NDArray[np.float32] = (np.stack(values, axis=-1) * power).astype(np.float32)
    return dome
