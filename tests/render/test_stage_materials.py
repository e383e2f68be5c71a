"""Materials of a stage."""

import pytest
from pxr import Sdr, Usd, UsdShade

from envgen_usd.render.stage_materials import MaterialTable


def test_inputs_that_a_stage_leaves_out_are_those_of_the_usd_specification():
    stage = Usd.Stage.CreateInMemory()
    material = UsdShade.Material.Define(stage, "/look")
    surface = UsdShade.Shader.Define(stage, "/look/surface")
    surface.CreateIdAttr("UsdPreviewSurface")
    material.CreateSurfaceOutput().ConnectToSource(surface.ConnectableAPI(), "surface")
    table = MaterialTable(Usd.TimeCode.Default())
    look = table.materials[table.index(material)]
    node = Sdr.Registry().GetShaderNodeByIdentifier("UsdPreviewSurface")
    default = {
        name: node.GetShaderInput(name).GetDefaultValue() for name in node.GetShaderInputNames()
    }
    assert look.diffuse == pytest.approx(tuple(default["diffuseColor"]))
    assert look.emissive == pytest.approx(tuple(default["emissiveColor"]))
    for name in ("roughness", "metallic", "opacity"):
        assert getattr(look, name) == pytest.approx(default[name])
    assert look.opacity_threshold == pytest.approx(default["opacityThreshold"])
    assert not table.issues
