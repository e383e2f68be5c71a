"""The materials of the library as data, and their UsdPreviewSurface networks."""

from dataclasses import dataclass

from pxr import Gf, Sdf

from envgen_usd.assets.prim_authoring import add_prim, set_attribute, set_label
from envgen_usd.assets.usd_files import new_layer

Colour = tuple[float, float, float]
Types = Sdf.ValueTypeNames


@dataclass(frozen=True)
class Pattern:
    """What the inputs of a Material say besides its shader (``asset_library/README.md``).

    Attributes:
        patch: Distance of the patches of texture bombing, repeats of the texture; 0 for none.
        turn: Largest turn of a patch, degrees.
        unit: Brick that no patch divides, share of the texture; (0, 0) for any shift.
        bond: Shift of every second course, share of a brick.
        lanes: Share to which tyre tracks, repairs, manholes and cracks show, 0 to 1.
        stains: Share to which spots on the ground show, 0 to 1.
        foot: Share to which dirt shows above the foot of walls, 0 to 1.
        streaks: Share to which streaks and soot show on walls, 0 to 1.
        paint: Share of road paint that traffic takes off, 0 to 1.
        tinted: True if each building tints it.
    """

    patch: float = 0.0
    turn: float = 0.0
    unit: tuple[float, float] = (0.0, 0.0)
    bond: float = 0.0
    lanes: float = 0.0
    stains: float = 0.0
    foot: float = 0.0
    streaks: float = 0.0
    paint: float = 0.0
    tinted: bool = False


@dataclass(frozen=True)
class MaterialLook:
    """A material of the library.

    Attributes:
        name: Name of the material, its file and its textures.
        colour: Linear reflectance without a texture.
        roughness: 0 to 1, without a roughness texture.
        metallic: 0 or 1, rarely in between.
        specular: Index of refraction of the surface.
        emission: Emitted radiance of a lamp; with its texture, that of its brightest texel.
        texture: Name of the colour's texture; empty for a uniform colour.
        relief: Name of the normals' and the roughness' textures.
        size: Side length of the texture, metres; texture coordinates are metres / size.
        maps: Textures besides the colour: ``normal``, ``roughness``, ``opacity`` and ``emission``.
        cut_out: Opacity threshold; 0 for an opaque material.
        lossless: True for a colour texture as PNG also without opacity: sharp edges.
        pattern: Texture bombing and wear.
    """

    name: str
    colour: Colour = (0.5, 0.5, 0.5)
    roughness: float = 0.8
    metallic: float = 0.0
    specular: float = 1.5
    emission: Colour = (0.0, 0.0, 0.0)
    texture: str = ""
    relief: str = ""
    size: float = 1.0
    maps: tuple[str, ...] = ()
    cut_out: float = 0.0
    lossless: bool = False
    pattern: Pattern = Pattern()


def material_layer(look: MaterialLook, textures: str) -> Sdf.Layer:
    """Authors a material as the default prim of a layer.

    Args:
        look: The material.
        textures: Relative path from the layer's file to the folder of textures.
    """
    layer = new_layer(look.name)
    prim = add_prim(layer, look.name, "Material")
    prim.customData["texture_size"] = look.size
    set_label(prim, "material", look.name)
    _pattern(prim, look.pattern)
    surface = _shader(prim, "Surface", "UsdPreviewSurface")
    output = set_attribute(prim, "outputs:surface", Types.Token, None)
    output.connectionPathList.explicitItems = [_output(surface, "surface", Types.Token)]
    _constants(surface, look)
    if look.texture:
        _textures(prim, surface, look, textures)
    return layer


def _pattern(material: Sdf.PrimSpec, pattern: Pattern) -> None:
    """Authors the inputs that differ from their default."""
    figures = {
        "bombing:patch": pattern.patch,
        "bombing:turn": pattern.turn,
        "bombing:bond": pattern.bond,
        "wear:lanes": pattern.lanes,
        "wear:stains": pattern.stains,
        "wear:foot": pattern.foot,
        "wear:streaks": pattern.streaks,
        "wear:paint": pattern.paint,
    }
    for name, figure in figures.items():
        if figure:
            set_attribute(material, f"inputs:{name}", Types.Float, figure)
    if any(pattern.unit):
        set_attribute(material, "inputs:bombing:unit", Types.Float2, Gf.Vec2f(*pattern.unit))
    if pattern.tinted:
        set_attribute(material, "inputs:tinted", Types.Bool, True)


def _shader(material: Sdf.PrimSpec, name: str, shader_id: str) -> Sdf.PrimSpec:
    prim = add_prim(material, name, "Shader")
    set_attribute(prim, "info:id", Types.Token, shader_id, uniform=True)
    return prim


def _output(shader: Sdf.PrimSpec, name: str, kind: Sdf.ValueTypeName) -> Sdf.Path:
    path = shader.path.AppendProperty(f"outputs:{name}")
    if f"outputs:{name}" not in shader.attributes:
        set_attribute(shader, f"outputs:{name}", kind, None)
    return path


def _constants(surface: Sdf.PrimSpec, look: MaterialLook) -> None:
    colour, emission = Gf.Vec3f(*look.colour), Gf.Vec3f(*look.emission)
    set_attribute(surface, "inputs:diffuseColor", Types.Color3f, colour)
    set_attribute(surface, "inputs:roughness", Types.Float, look.roughness)
    set_attribute(surface, "inputs:metallic", Types.Float, look.metallic)
    set_attribute(surface, "inputs:ior", Types.Float, look.specular)
    if any(look.emission):
        set_attribute(surface, "inputs:emissiveColor", Types.Color3f, emission)
    if look.cut_out:
        set_attribute(surface, "inputs:opacityThreshold", Types.Float, look.cut_out)


def _textures(
    material: Sdf.PrimSpec, surface: Sdf.PrimSpec, look: MaterialLook, folder: str
) -> None:
    reader = _shader(material, "Coordinates", "UsdPrimvarReader_float2")
    set_attribute(reader, "inputs:varname", Types.String, "st")
    st = _output(reader, "result", Types.Float2)
    ending = "png" if look.lossless or "opacity" in look.maps else "jpg"
    file = f"{folder}/{look.texture}_colour.{ending}"
    colour = _texture(material, "Colour", file, st, "sRGB")
    _connect(surface, "diffuseColor", Types.Color3f, _output(colour, "rgb", Types.Float3))
    if "opacity" in look.maps:
        _connect(surface, "opacity", Types.Float, _output(colour, "a", Types.Float))
    if "normal" in look.maps:
        normal = _texture(material, "Normal", f"{folder}/{look.relief}_normal.jpg", st, "raw")
        set_attribute(normal, "inputs:scale", Types.Float4, Gf.Vec4f(2, 2, 2, 1))
        set_attribute(normal, "inputs:bias", Types.Float4, Gf.Vec4f(-1, -1, -1, 0))
        _connect(surface, "normal", Types.Normal3f, _output(normal, "rgb", Types.Float3))
    if "roughness" in look.maps:
        rough = _texture(material, "Roughness", f"{folder}/{look.relief}_roughness.jpg", st, "raw")
        _connect(surface, "roughness", Types.Float, _output(rough, "r", Types.Float))
    if "emission" in look.maps:
        glow = _texture(material, "Emission", f"{folder}/{look.texture}_emission.jpg", st, "sRGB")
        set_attribute(glow, "inputs:scale", Types.Float4, Gf.Vec4f(*look.emission, 1))
        _connect(surface, "emissiveColor", Types.Color3f, _output(glow, "rgb", Types.Float3))


def _texture(
    material: Sdf.PrimSpec, name: str, file: str, st: Sdf.Path, space: str
) -> Sdf.PrimSpec:
    prim = _shader(material, name, "UsdUVTexture")
    set_attribute(prim, "inputs:file", Types.Asset, Sdf.AssetPath(file))
    set_attribute(prim, "inputs:sourceColorSpace", Types.Token, space)
    for side in ("wrapS", "wrapT"):
        set_attribute(prim, f"inputs:{side}", Types.Token, "repeat")
    _connect(prim, "st", Types.Float2, st)
    return prim


def _connect(shader: Sdf.PrimSpec, name: str, kind: Sdf.ValueTypeName, source: Sdf.Path) -> None:
    existing = shader.attributes.get(f"inputs:{name}")
    attribute = existing or set_attribute(shader, f"inputs:{name}", kind, None)
    attribute.connectionPathList.explicitItems = [source]
