"""Materials of a stage: UsdPreviewSurface networks as `Material` records."""

from dataclasses import replace
from typing import Any

import numpy as np
from pxr import Sdf, Usd, UsdShade

from envgen_usd.errors import Issue, Severity
from envgen_usd.render.render_scene import Bombing, Material, Texture, Wear
from envgen_usd.render.stage.typed_values import BadValueError, like

_INPUTS = {
    "diffuse": "diffuseColor",
    "emissive": "emissiveColor",
    "normal": "normal",
    "roughness": "roughness",
    "opacity": "opacity",
}
_CHANNELS = {"r": 0, "g": 1, "b": 2, "a": 3}
_PLAIN = Material(vertex_colour=True)


class MaterialTable:
    """All looks so far, each once, whatever its path; index 0 is the look of unbound geometry."""

    def __init__(self, time: Usd.TimeCode) -> None:
        """Starts with the plain material; values are read at `time`."""
        self.materials: list[Material] = [_PLAIN]
        self.issues: list[Issue] = []
        self._time = time
        self._by_path: dict[Sdf.Path, int] = {}

    @property
    def names(self) -> dict[int, str]:
        """Name of the first material of each look, by its index; the look of none has none."""
        names: dict[int, str] = {}
        for path, index in self._by_path.items():
            names.setdefault(index, str(path.name))
        names.pop(0, None)
        return names

    def index(self, material: UsdShade.Material | None) -> int:
        """Index of a bound material in `materials`; 0 for `None`."""
        if not material:
            return 0
        path = material.GetPath()
        if path not in self._by_path:
            self._by_path[path] = self._add(material)
        return self._by_path[path]

    def _add(self, material: UsdShade.Material) -> int:
        shader = _surface(material)
        if shader is None or shader.GetShaderId() != "UsdPreviewSurface":
            self._report("material.unsupported", material, "has no UsdPreviewSurface; drawn grey")
            return 0
        look = replace(self._read(shader), **self._appearance(material))
        if look.opacity < 1.0 and "opacity" not in look.textures:
            text = f"has an opacity of {look.opacity:g}; drawn and labelled as solid"
            self._report("material.opacity", material, text)
        if look not in self.materials:
            self.materials.append(look)
        return self.materials.index(look)

    def _read(self, shader: UsdShade.Shader) -> Material:
        sources = {name: _source(shader, usd) for name, usd in _INPUTS.items()}
        textures: dict[str, Texture] = {}
        uv_name, uv_transform = _PLAIN.uv_name, _PLAIN.uv_transform
        for name, source in sources.items():
            if source is None or _id(source[0]) != "UsdUVTexture":
                continue
            texture = self._texture(*source, colour=name in {"diffuse", "emissive"})
            if texture is not None:
                textures[name] = texture
                uv_name, uv_transform = self._coordinates(source[0], uv_name)
        diffuse = sources["diffuse"]
        emissive = self._value(shader, "emissiveColor", (0.0, 0.0, 0.0))
        if "emissive" in textures:
            # Radiances exceed what a texel holds, so the scale stays a factor.
            emissive = textures["emissive"].scale[:3]
            textures["emissive"] = replace(textures["emissive"], scale=(1.0, 1.0, 1.0, 1.0))
        return Material(
            diffuse=self._value(shader, "diffuseColor", (0.18, 0.18, 0.18)),
            emissive=emissive,
            roughness=self._value(shader, "roughness", 0.5),
            metallic=self._value(shader, "metallic", 0.0),
            opacity=self._value(shader, "opacity", 1.0),
            opacity_threshold=self._value(shader, "opacityThreshold", 0.0),
            textures=textures,
            vertex_colour=diffuse is not None and _id(diffuse[0]).startswith("UsdPrimvarReader"),
            uv_name=uv_name,
            uv_transform=uv_transform,
        )

    def _appearance(self, material: UsdShade.Material) -> dict[str, Any]:
        """What the inputs of a material say besides its surface shader."""
        ground: float = self._given(material, "wear:of_ground", 1.0)
        walls: float = self._given(material, "wear:of_walls", 1.0)
        amounts = {"lanes": ground, "stains": ground, "paint": ground}
        amounts |= {"foot": walls, "streaks": walls}
        size = material.GetPrim().GetCustomDataByKey("texture_size")
        return {
            "size": float(size) if isinstance(size, int | float) and size > 0 else 1.0,
            "bombing": Bombing(
                self._given(material, "bombing:patch", 0.0),
                float(np.radians(self._given(material, "bombing:turn", 0.0))),
                self._given(material, "bombing:unit", (0.0, 0.0)),
                self._given(material, "bombing:bond", 0.0),
            ),
            "wear": Wear(
                **{
                    name: amount * self._given(material, f"wear:{name}", 0.0)
                    for name, amount in amounts.items()
                }
            ),
            "tinted": self._given(material, "tinted", False),
        }

    def _given(self, material: UsdShade.Material, name: str, default: Any) -> Any:  # noqa: ANN401
        """The constant value of a material's own input."""
        attribute = material.GetPrim().GetAttribute(f"inputs:{name}")
        return self._typed(attribute, default) if attribute else default

    def _texture(self, shader: UsdShade.Shader, output: str, *, colour: bool) -> Texture | None:
        asset = self._value(shader, "file", None)
        path = asset.resolvedPath if isinstance(asset, Sdf.AssetPath) else ""
        if not path:
            self._report("material.texture", shader, f"texture {asset} does not exist; left out")
            return None
        space = self._value(shader, "sourceColorSpace", "auto")
        wraps = [self._value(shader, name, "repeat") for name in ("wrapS", "wrapT")]
        return Texture(
            path=path,
            srgb=space == "sRGB" or (space == "auto" and colour),
            repeat=(wraps[0] not in {"clamp", "black"}, wraps[1] not in {"clamp", "black"}),
            channel=_CHANNELS.get(output, 0),
            scale=self._value(shader, "scale", (1.0, 1.0, 1.0, 1.0)),
            bias=self._value(shader, "bias", (0.0, 0.0, 0.0, 0.0)),
        )

    def _coordinates(
        self, texture: UsdShade.Shader, default: str
    ) -> tuple[str, tuple[tuple[float, float, float], tuple[float, float, float]]]:
        """Name of the primvar behind a texture's ``st``, and the transform between them."""
        source, matrix = _source(texture, "st"), np.eye(2, 3)
        if source is not None and _id(source[0]) == "UsdTransform2d":
            matrix = self._transform(source[0])
            source = _source(source[0], "in")
        name = default if source is None else self._value(source[0], "varname", default)
        (a, b, x), (c, d, y) = matrix.tolist()
        return name, ((a, b, x), (c, d, y))

    def _transform(self, shader: UsdShade.Shader) -> np.ndarray[Any, np.dtype[np.float64]]:
        """UsdTransform2d: in * scale, then rotated (degrees), then translated."""
        angle = np.radians(self._value(shader, "rotation", 0.0))
        cosine, sine = np.cos(angle), np.sin(angle)
        scale = np.array(self._value(shader, "scale", (1.0, 1.0)))
        shift = np.array(self._value(shader, "translation", (0.0, 0.0)))
        turn = np.array([[cosine, -sine], [sine, cosine]])
        return np.column_stack((turn * scale, shift))

    def _value(self, shader: UsdShade.Shader, name: str, default: Any) -> Any:  # noqa: ANN401
        """The constant value of an input, through the material's interface if connected."""
        shader_input = shader.GetInput(name)
        if not shader_input:
            return default
        for attribute in UsdShade.Utils.GetValueProducingAttributes(shader_input):
            if UsdShade.Utils.GetType(attribute.GetName()) == UsdShade.AttributeType.Input:
                return self._typed(attribute, default)
        return default

    def _typed(self, attribute: Usd.Attribute, default: Any) -> Any:  # noqa: ANN401
        """The value of an attribute; the default without one, or for one of another type."""
        try:
            return like(attribute.Get(self._time), default)
        except BadValueError as error:
            message = f"{attribute.GetName()} {error}; {default} is used"
            self._report("material.value", attribute.GetPrim(), message)
            return default

    def _report(self, kind: str, prim: Any, message: str) -> None:  # noqa: ANN401
        self.issues.append(Issue(kind, Severity.WARNING, str(prim.GetPath()), message))


def _surface(material: UsdShade.Material) -> UsdShade.Shader | None:
    source = material.ComputeSurfaceSource()
    shader = source[0] if isinstance(source, tuple) else source
    return shader if shader else None


def _source(shader: UsdShade.Shader, name: str) -> tuple[UsdShade.Shader, str] | None:
    """The shader connected to an input, and its output's name."""
    shader_input = shader.GetInput(name)
    if not shader_input:
        return None
    for attribute in UsdShade.Utils.GetValueProducingAttributes(shader_input):
        if UsdShade.Utils.GetType(attribute.GetName()) == UsdShade.AttributeType.Output:
            output = UsdShade.Output(attribute)
            return UsdShade.Shader(attribute.GetPrim()), str(output.GetBaseName())
    return None


def _id(shader: UsdShade.Shader) -> str:
    return str(shader.GetShaderId() or "")
