"""Materials of a stage as BSDFs of Mitsuba."""

from typing import Any, TypeAlias

import numpy as np

from envgen_usd.models.array_types import ByteArray
from envgen_usd.render.opengl.shader_looks import cut_threshold
from envgen_usd.render.render_scene import Floats, Material, Texture
from envgen_usd.render.stage.texture_images import read_texture

Plugin: TypeAlias = dict[str, Any]

COLOURS = "vertex_color"
"""Mesh attribute of linear colours."""
_THROUGH = 0.5
"""Light that a leaf transmits, as a share of the light that it reflects, as in the shaders."""
_MOST_LIGHT = 0.98
"""Largest share of the light that a leaf reflects and transmits together."""


class TracerMaterials:
    """Converts materials; each image is read once."""

    def __init__(self, mitsuba: Any) -> None:  # noqa: ANN401 - the module has no stubs here
        """Sets the module, whose variant is chosen already."""
        self._mitsuba = mitsuba
        self._images: dict[Texture, ByteArray] = {}

    def bsdf(self, material: Material) -> Any:  # noqa: ANN401
        """Makes a BSDF: that of UsdPreviewSurface, cut out as in the shaders.

        UsdPreviewSurface says nothing of light through leaves: cut-outs let through half of what
        they reflect. Normal maps are left out: where one looks along a surface, they turn normals
        away from the eye, and Mitsuba 3.6 shows such places black. Grass in the distance would lose
        a third of its light.
        """
        leaf = cut_threshold(material) > 0.0
        plugin = self._leaf(material) if leaf else self._surface(material)
        if not leaf:
            plugin = {"type": "twosided", "bsdf": plugin}
        if leaf:
            plugin = {"type": "mask", "opacity": self._cut(material), "bsdf": plugin}
        return self._mitsuba.load_dict(plugin)

    def radiance(self, material: Material, unit: float) -> Plugin | None:
        """The light that a surface emits; `None` for none.

        Args:
            material: The material.
            unit: Radiance of a surface with an emission of 1.
        """
        emitted = np.array(material.emissive, np.float32) * np.float32(unit)
        if emitted.max() <= 0.0:
            return None
        glow = material.textures.get("emissive")
        if glow is None:
            return {"type": "rgb", "value": emitted.tolist()}
        encoded = (self._image(glow)[..., :3] / np.float32(255.0)).astype(np.float32)
        return self._bitmap((linear(encoded) if glow.srgb else encoded) * emitted, glow, raw=True)

    def _surface(self, material: Material) -> Plugin:
        rough = material.textures.get("roughness")
        roughness: Any = max(material.roughness, 0.02)
        if rough is not None:
            values = self._image(rough)[..., rough.channel, None]
            roughness = self._bitmap(values, rough, raw=True)
        return {
            "type": "principled",
            "base_color": self._colour(material),
            "roughness": roughness,
            "metallic": material.metallic,
        }

    def _leaf(self, material: Material) -> Plugin:
        both = 1.0 + _THROUGH
        return {
            "type": "principledthin",
            "base_color": self._colour(material, both),
            "roughness": max(material.roughness, 0.02),
            "diff_trans": 2.0 * _THROUGH / both,
            "spec_trans": 0.0,
        }

    def _colour(self, material: Material, factor: float = 1.0) -> Plugin:
        base = material.textures.get("diffuse")
        if material.vertex_colour:
            return {"type": "mesh_attribute", "name": COLOURS}
        if base is None:
            level = np.minimum(np.array(material.diffuse) * factor, _MOST_LIGHT)
            return {"type": "rgb", "value": level.tolist()}
        image = self._image(base)[..., :3]
        if factor == 1.0:
            return self._bitmap(image, base, raw=not base.srgb)
        encoded = (image / np.float32(255.0)).astype(np.float32)
        values = linear(encoded) if base.srgb else encoded
        level = np.minimum(values * np.float32(factor), np.float32(_MOST_LIGHT))
        return self._bitmap(level, base, raw=True)

    def _cut(self, material: Material) -> Plugin:
        texture = material.textures["opacity"]
        image = self._image(texture)[..., texture.channel, None]
        kept = (image >= 255.0 * cut_threshold(material)).astype(np.float32)
        return self._bitmap(kept, texture, raw=True)

    def _image(self, texture: Texture) -> ByteArray:
        if texture not in self._images:
            self._images[texture] = read_texture(texture)
        return self._images[texture]

    def _bitmap(self, pixels: ByteArray | Floats, texture: Texture, *, raw: bool) -> Plugin:
        return {
            "type": "bitmap",
            "bitmap": self._mitsuba.Bitmap(np.array(pixels, order="C")),
            "raw": raw,
            "wrap_mode": "repeat" if all(texture.repeat) else "clamp",
        }


def linear(encoded: Floats) -> Floats:
    """Returns the linear values of sRGB-encoded ones (IEC 61966-2-1)."""
    steep = ((encoded + np.float32(0.055)) / np.float32(1.055)) ** np.float32(2.4)
    values: Floats = np.where(encoded <= 0.04045, encoded / np.float32(12.92), steep)
    return values
