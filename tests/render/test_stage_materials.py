"""Materials of a stage."""

import numpy as np
import pytest
from PIL import Image
from pxr import Gf, Sdf, Sdr, Usd, UsdShade

from envgen_usd.render.stage.stage_materials import MaterialTable

TYPES = Sdf.ValueTypeNames


class Look:
    """A material of a stage in memory."""

    def __init__(self, image):
        self.stage = Usd.Stage.CreateInMemory()
        self.material = UsdShade.Material.Define(self.stage, "/look")
        self.surface = self.shader("surface", "UsdPreviewSurface")
        self.material.CreateSurfaceOutput().ConnectToSource(
            self.surface.ConnectableAPI(), "surface"
        )
        self.image = str(image)

    def shader(self, name, kind):
        shader = UsdShade.Shader.Define(self.stage, f"/look/{name}")
        shader.CreateIdAttr(kind)
        return shader

    def texture(self, name, output, usd_type, **inputs):
        """Connects an input of the surface to an image."""
        texture = self.shader(f"{name}_image", "UsdUVTexture")
        texture.CreateInput("file", TYPES.Asset).Set(self.image)
        for key, value in inputs.items():
            kind = TYPES.Token if isinstance(value, str) else TYPES.Float4
            texture.CreateInput(key, kind).Set(value)
        self.surface.CreateInput(name, usd_type).ConnectToSource(texture.ConnectableAPI(), output)
        return texture

    def read(self):
        table = MaterialTable(Usd.TimeCode.Default())
        return table.materials[table.index(self.material)], table.issues


@pytest.fixture
def look(tmp_path):
    Image.new("RGBA", (2, 2)).save(tmp_path / "image.png")
    return Look(tmp_path / "image.png")


def test_inputs_that_a_stage_leaves_out_are_those_of_the_usd_specification(look):
    material, issues = look.read()
    node = Sdr.Registry().GetShaderNodeByIdentifier("UsdPreviewSurface")
    names = node.GetShaderInputNames()
    default = {name: node.GetShaderInput(name).GetDefaultValue() for name in names}
    assert material.diffuse == pytest.approx(tuple(default["diffuseColor"]))
    assert material.emissive == pytest.approx(tuple(default["emissiveColor"]))
    for name in ("roughness", "metallic", "opacity"):
        assert getattr(material, name) == pytest.approx(default[name])
    assert material.opacity_threshold == pytest.approx(default["opacityThreshold"])
    assert not issues


@pytest.mark.parametrize(("space", "is_srgb"), [("sRGB", True), ("raw", False)])
def test_an_image_has_the_colour_space_that_the_stage_names(look, space, is_srgb):
    look.texture("diffuseColor", "rgb", TYPES.Color3f, sourceColorSpace=space)
    look.texture("roughness", "g", TYPES.Float, sourceColorSpace=space)
    textures = look.read()[0].textures
    assert (textures["diffuse"].srgb, textures["roughness"].srgb) == (is_srgb, is_srgb)


@pytest.mark.parametrize("more", [{}, {"sourceColorSpace": "auto"}])
def test_colours_of_8_bits_are_srgb_where_the_stage_names_no_colour_space(look, more):
    look.texture("diffuseColor", "rgb", TYPES.Color3f, **more)
    assert look.read()[0].textures["diffuse"].srgb


def test_channel_wrapping_scale_and_bias_of_an_image(look):
    more = {"scale": Gf.Vec4f(2, 3, 4, 5), "bias": Gf.Vec4f(-1, -2, -3, -4)}
    look.texture("normal", "rgb", TYPES.Normal3f, wrapS="clamp", wrapT="repeat", **more)
    for name, output in (("roughness", "b"), ("opacity", "a")):
        look.texture(name, output, TYPES.Float, wrapS="repeat", wrapT="black")
    textures = look.read()[0].textures
    assert {name: each.channel for name, each in textures.items()} == {
        "normal": 0,
        "roughness": 2,
        "opacity": 3,
    }
    assert textures["normal"].repeat == (False, True)
    assert textures["opacity"].repeat == (True, False)
    assert (textures["normal"].scale, textures["normal"].bias) == ((2, 3, 4, 5), (-1, -2, -3, -4))
    assert (textures["opacity"].scale, textures["opacity"].bias) == ((1,) * 4, (0,) * 4)


def test_texture_coordinates_are_scaled_then_turned_then_moved(look):
    """The order of the UsdPreviewSurface specification; the angle counts counter-clockwise."""
    texture = look.texture("diffuseColor", "rgb", TYPES.Color3f)
    reader = look.shader("reader", "UsdPrimvarReader_float2")
    reader.CreateInput("varname", TYPES.String).Set("map")
    turned = look.shader("turned", "UsdTransform2d")
    turned.CreateInput("scale", TYPES.Float2).Set(Gf.Vec2f(2, 3))
    turned.CreateInput("rotation", TYPES.Float).Set(30.0)
    turned.CreateInput("translation", TYPES.Float2).Set(Gf.Vec2f(0.25, -0.5))
    turned.CreateInput("in", TYPES.Float2).ConnectToSource(reader.ConnectableAPI(), "result")
    texture.CreateInput("st", TYPES.Float2).ConnectToSource(turned.ConnectableAPI(), "result")
    material, _ = look.read()
    assert material.uv_name == "map"
    st = 0.7 + 0.4j
    expected = (st.real * 2 + st.imag * 3j) * np.exp(1j * np.pi / 6) + (0.25 - 0.5j)
    u, v = np.array(material.uv_transform) @ [st.real, st.imag, 1.0]
    assert complex(u, v) == pytest.approx(expected)


def test_an_image_that_does_not_exist_is_named(look):
    look.image = "nowhere.png"
    look.texture("diffuseColor", "rgb", TYPES.Color3f)
    material, issues = look.read()
    assert not material.textures
    (issue,) = issues
    assert issue.kind == "material.texture"
    assert "nowhere.png" in issue.message


@pytest.mark.parametrize("connected", [False, True])
def test_glass_is_named_since_it_is_drawn_as_solid(look, connected):
    """A cut-out has its opacity from an image, and is open where that says so."""
    if connected:
        look.texture("opacity", "a", TYPES.Float)
    else:
        look.surface.CreateInput("opacity", TYPES.Float).Set(0.25)
    issues = look.read()[1]
    assert [issue.kind for issue in issues] == ([] if connected else ["material.opacity"])
    assert all("0.25" in issue.message and issue.where == "/look" for issue in issues)
