"""A luminous plate whose halves differ."""

import numpy as np
from PIL import Image
from pxr import Sdf, UsdGeom, UsdShade


def add_half_lit_plate(stage, folder):
    """A plate at a height of 1 m; one half emits 0.2, the other a half of that."""
    pixels = np.full((8, 8, 3), 255, np.uint8)
    pixels[:, 4:] = 188  # 0.5 in sRGB
    picture = folder / "glow.png"
    Image.fromarray(pixels).save(picture)
    mesh = UsdGeom.Mesh.Define(stage, "/World/plate")
    mesh.CreatePointsAttr([(-3, -3, 1), (3, -3, 1), (3, 3, 1), (-3, 3, 1)])
    mesh.CreateFaceVertexCountsAttr([4])
    mesh.CreateFaceVertexIndicesAttr([0, 1, 2, 3])
    st = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar(
        "st", Sdf.ValueTypeNames.TexCoord2fArray, UsdGeom.Tokens.vertex
    )
    st.Set([(0, 0), (1, 0), (1, 1), (0, 1)])
    material = UsdShade.Material.Define(stage, "/World/glow")
    shader = UsdShade.Shader.Define(stage, "/World/glow/Surface")
    shader.CreateIdAttr("UsdPreviewSurface")
    shader.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f).Set((0, 0, 0))
    texture = UsdShade.Shader.Define(stage, "/World/glow/Emission")
    texture.CreateIdAttr("UsdUVTexture")
    texture.CreateInput("file", Sdf.ValueTypeNames.Asset).Set(str(picture))
    texture.CreateInput("sourceColorSpace", Sdf.ValueTypeNames.Token).Set("sRGB")
    texture.CreateInput("scale", Sdf.ValueTypeNames.Float4).Set((0.2, 0.2, 0.2, 1))
    out = texture.CreateOutput("rgb", Sdf.ValueTypeNames.Float3)
    shader.CreateInput("emissiveColor", Sdf.ValueTypeNames.Color3f).ConnectToSource(out)
    material.CreateSurfaceOutput().ConnectToSource(shader.ConnectableAPI(), "surface")
    UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(material)
