"""How much light of a lidar comes back from the surfaces of a scene."""

from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Annotated

import numpy as np
from msgspec import Meta
from numpy.typing import NDArray

from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.render.render_scene import Floats, Material, Scene
from envgen_usd.render.stage.texture_images import read_texture
from envgen_usd.toml_files import read_toml

_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
"""Weights of linear red, green and blue (ITU-R BT.709)."""
_RETRO_COSINE = np.float32(np.cos(np.radians(40.0)))
"""Cosine of the angle up to which retro-reflectors work; a larger value is a narrower angle."""

Share = Annotated[float, Meta(ge=0.0, le=1.0)]


@dataclass(frozen=True)
class LidarSurface:
    """What comes back from a class, or from a part of its objects.

    Attributes:
        label: Name of the class.
        reflectance: Diffuse reflectance in the near infrared, 0 to 1.
        part: Name of the part; empty for all parts without a figure of their own.
        colour: Share of the reflectance that is the luminance of the material's colour instead.
        slope: Angle of the microfacets of Oren and Nayar, degrees; 0 is a Lambertian surface.
        retro: Factor of retro-reflectors; 1 for none.
    """

    label: str
    reflectance: Share
    part: str = ""
    colour: Share = 0.0
    slope: Annotated[float, Meta(ge=0.0, le=60.0)] = 0.0
    retro: Annotated[float, Meta(ge=1.0, le=10000.0)] = 1.0


@dataclass(frozen=True)
class _Surfaces:
    surface: tuple[LidarSurface, ...]


class SurfaceTable:
    """Reflectance of a scene's surfaces; a surface is a kind of object of a material."""

    def __init__(self, scene: Scene) -> None:
        """Looks up the kind of each scene object and the luminance of each material."""
        rows = {(row.label, row.part): number for number, row in enumerate(_rows())}
        rest = rows["void", ""]
        kinds = [
            rows.get((each.label, each.part), rows.get((each.label, ""), rest))
            for each in scene.scene_objects
        ]
        self._kinds: NDArray[np.uint8] = np.array(kinds, np.uint8)
        bright = np.array([luminance(material) for material in scene.materials])
        self._reflectances = np.array(
            [row.reflectance * (1.0 - row.colour) + row.colour * bright for row in _rows()],
            np.float32,
        ).reshape(len(_rows()), len(bright))
        slopes = np.radians([row.slope for row in _rows()])
        level, grazing = oren_nayar(slopes)
        self._level, self._grazing = level.astype(np.float32), grazing.astype(np.float32)
        self._retro = np.array([row.retro for row in _rows()], np.float32)

    def backscatter(
        self, scene_objects: NDArray[np.uint32], materials: IntArray, cosines: Floats
    ) -> Floats:
        """Light that comes back, as a share of that of a white board that faces the sensor.

        Args:
            scene_objects: N, index of the scene object of each hit.
            materials: N, index of its material.
            cosines: N, cosine of the angle of incidence, 0 to 1.

        Returns:
            N, above 1 for retro-reflectors.
        """
        kinds = self._kinds[scene_objects]
        share = self._level[kinds] * cosines + self._grazing[kinds] * (1.0 - cosines * cosines)
        retro = self._retro[kinds]
        share = np.where((retro > 1.0) & (cosines > _RETRO_COSINE), retro, share)
        result: Floats = self._reflectances[kinds, materials] * share
        return result


def oren_nayar(slopes: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Factors of the cosine and of the squared sine of the incidence in what comes straight back.

    The qualitative model of Oren and Nayar (SIGGRAPH 1994) for a viewer at the light: ``A + B sin t
    tan t``, times the cosine of the light's incidence.

    Args:
        slopes: Standard deviations of the angle of the microfacets, radians.
    """
    square = slopes * slopes
    return 1.0 - 0.5 * square / (square + 0.33), 0.45 * square / (square + 0.09)


def luminance(material: Material) -> float:
    """Luminance of a material's colour, the mean over its texture, linear, 0 to 1."""
    texture = material.textures.get("diffuse")
    if texture is None:
        return float(np.clip(np.array(material.diffuse) @ _LUMINANCE, 0.0, 1.0))
    pixels = read_texture(texture)[::4, ::4, :3].reshape(-1, 3)
    values = pixels.astype(np.float64) / 255.0
    linear = np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)
    mean = (linear if texture.srgb else values).mean(axis=0)
    return float(mean @ _LUMINANCE)


@cache
def _rows() -> tuple[LidarSurface, ...]:
    file = resources.files("envgen_usd.renders") / "lidar_surfaces.toml"
    return read_toml(file, _Surfaces).surface
