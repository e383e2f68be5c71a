"""Prims as other programs write them: colours of solids, bindings by purpose, what is left out."""

import pytest
from pxr import Gf, Sdf, UsdGeom, UsdShade, UsdSkel, Vt

from envgen_usd.render.stage.stage_reader import read_scene

SOLIDS = ("Cube", "Sphere", "Cylinder", "Capsule", "Cone")


@pytest.mark.parametrize("kind", SOLIDS)
@pytest.mark.parametrize("inherited", [False, True])
def test_a_solid_has_its_display_colour(author, kind, inherited):
    """Linear 0.5, 0.1 and 1 are 187.5, 89.0 and 255 in sRGB (IEC 61966-2-1)."""
    write = author()
    solid = write.stage.DefinePrim("/World/group/solid", kind)
    holder = write.stage.GetPrimAtPath("/World/group") if inherited else solid
    colour = UsdGeom.PrimvarsAPI(holder).CreatePrimvar(
        "displayColor", Sdf.ValueTypeNames.Color3fArray, "constant"
    )
    colour.Set(Vt.Vec3fArray([Gf.Vec3f(0.5, 0.1, 1.0)]))
    (geometry,) = read_scene(write.stage).geometries
    assert geometry.colours.reshape(-1, 4).min(axis=0) == pytest.approx(
        (187.5, 89, 255, 255), abs=1
    )
    assert (geometry.colours == geometry.colours[0]).all()


def test_a_solid_with_a_colour_of_another_type_is_grey(author):
    write = author()
    solid = UsdGeom.Cube.Define(write.stage, "/World/solid")
    spec = write.stage.GetRootLayer().GetPrimAtPath(solid.GetPath())
    Sdf.AttributeSpec(spec, "primvars:displayColor", Sdf.ValueTypeNames.String).default = "red"
    scene = read_scene(write.stage)
    assert not [issue for issue in scene.issues if issue.kind != "stage.unlabelled"]
    assert len(set(map(tuple, scene.geometries[0].colours[:, :3].tolist()))) == 1


@pytest.mark.parametrize(
    ("purposes", "colour"),
    [
        (("allPurpose",), (0.1, 0.2, 0.3)),
        (("full",), (0.1, 0.2, 0.3)),
        (("preview",), (0.1, 0.2, 0.3)),
        (("preview", "full"), (0.4, 0.5, 0.6)),
        (("preview", "allPurpose"), (0.4, 0.5, 0.6)),
    ],
)
def test_a_binding_for_final_pictures_goes_before_one_for_previews(author, purposes, colour):
    """The n-th purpose has the n-th colour."""
    write = author()
    wall = write.square("/World/wall", 8.0, (-5, -5), (5, 5), label="building")
    api = UsdShade.MaterialBindingAPI.Apply(wall.GetPrim())
    for number, purpose in enumerate(purposes):
        rgb = tuple(0.1 + 0.3 * number + 0.1 * channel for channel in range(3))
        material = write.material(f"/World/look_{number}", colour=rgb)
        api.Bind(material, UsdShade.Tokens.fallbackStrength, getattr(UsdShade.Tokens, purpose))
    scene = read_scene(write.stage)
    (use,) = scene.uses
    material = scene.materials[scene.geometries[use.geometry].material]
    assert material.diffuse == pytest.approx(colour)


def test_what_is_not_drawn_as_it_is_meant_is_named(author):
    write = author()
    write.square("/World/wall", 8.0, (-5, -5), (5, 5), label="building")
    hair = UsdGeom.BasisCurves.Define(write.stage, "/World/hair")
    hair.CreatePointsAttr([(0, 0, 0), (1, 0, 0)])
    hair.CreateCurveVertexCountsAttr([2])
    guide = UsdGeom.BasisCurves.Define(write.stage, "/World/guide")
    guide.CreatePurposeAttr("guide")
    UsdSkel.Root.Define(write.stage, "/World/person")
    found = {issue.where: issue.kind for issue in read_scene(write.stage).issues}
    assert found == {"/World/hair": "stage.unsupported", "/World/person": "stage.skeleton"}
