"""Stages that the tests author themselves, and cameras that look at them."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux, UsdSemantics, UsdShade, Vt

from envgen_usd.errors import EnvgenError
from envgen_usd.render.cameras.camera_pose import Pose
from envgen_usd.render.cameras.camera_rig import Camera
from envgen_usd.render.drawing.drawn_frame import FrameRequest
from envgen_usd.render.opengl.gl_context import open_context
from envgen_usd.render.opengl.scene_tiles import pack
from envgen_usd.render.stage.stage_reader import read_scene


def counted_calls(monkeypatch, module, name):
    """A list that grows by an entry with each call of what a module has under a name."""
    counted = []
    original = getattr(module, name)

    def call(*given):
        counted.append(1)
        return original(*given)

    monkeypatch.setattr(module, name, call)
    return counted


@dataclass
class Author:
    """Writes prims in a few words."""

    stage: Usd.Stage

    def square(self, path, depth, low, high, *, label=None):
        """A square that faces a camera which looks along +y from the origin."""
        (x0, z0), (x1, z1) = low, high
        points = [(x0, depth, z0), (x1, depth, z0), (x1, depth, z1), (x0, depth, z1)]
        return self.mesh(path, points, [(0, 1, 2, 3)], label=label)

    def mesh(self, path, points, faces, *, label=None, subdivision="none"):
        mesh = UsdGeom.Mesh.Define(self.stage, path)
        mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(np.asarray(points, np.float32)))
        mesh.CreateFaceVertexCountsAttr([len(face) for face in faces])
        mesh.CreateFaceVertexIndicesAttr([index for face in faces for index in face])
        mesh.CreateSubdivisionSchemeAttr(subdivision)
        if label:
            self.label(mesh.GetPrim(), label)
        return mesh

    def box(self, path, low, high, *, label=None):
        (x0, y0, z0), (x1, y1, z1) = low, high
        points = [(x, y, z) for z in (z0, z1) for y in (y0, y1) for x in (x0, x1)]
        faces = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
        return self.mesh(path, points, faces, label=label)

    def label(self, prim, *tokens):
        UsdSemantics.LabelsAPI.Apply(prim, "class").CreateLabelsAttr(list(tokens))

    def kind(self, prim, kind):
        Usd.ModelAPI(prim).SetKind(kind)

    def material(self, path, *, colour=(0.5, 0.5, 0.5), texture=None, cut=0.0):
        material = UsdShade.Material.Define(self.stage, path)
        surface = UsdShade.Shader.Define(self.stage, f"{path}/surface")
        surface.CreateIdAttr("UsdPreviewSurface")
        surface.CreateInput("roughness", Sdf.ValueTypeNames.Float).Set(1.0)
        diffuse = surface.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f)
        diffuse.Set(Gf.Vec3f(*colour))
        material.CreateSurfaceOutput().ConnectToSource(surface.ConnectableAPI(), "surface")
        if texture is not None:
            reader = UsdShade.Shader.Define(self.stage, f"{path}/st")
            reader.CreateIdAttr("UsdPrimvarReader_float2")
            reader.CreateInput("varname", Sdf.ValueTypeNames.String).Set("st")
            image = UsdShade.Shader.Define(self.stage, f"{path}/image")
            image.CreateIdAttr("UsdUVTexture")
            image.CreateInput("file", Sdf.ValueTypeNames.Asset).Set(str(texture))
            image.CreateInput("st", Sdf.ValueTypeNames.Float2).ConnectToSource(
                reader.ConnectableAPI(), "result"
            )
            for name in ("wrapS", "wrapT"):
                image.CreateInput(name, Sdf.ValueTypeNames.Token).Set("repeat")
            diffuse.ConnectToSource(image.ConnectableAPI(), "rgb")
            if cut:
                opacity = surface.CreateInput("opacity", Sdf.ValueTypeNames.Float)
                opacity.ConnectToSource(image.ConnectableAPI(), "a")
                surface.CreateInput("opacityThreshold", Sdf.ValueTypeNames.Float).Set(cut)
        return material

    def bind(self, prim, material):
        UsdShade.MaterialBindingAPI.Apply(prim).Bind(material)

    def uvs(self, mesh, uvs, interpolation="vertex"):
        primvar = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar(
            "st", Sdf.ValueTypeNames.TexCoord2fArray, interpolation
        )
        primvar.Set(Vt.Vec2fArray.FromNumpy(np.asarray(uvs, np.float32)))

    def lane(self, path, name, points, successors=()):
        curves = UsdGeom.BasisCurves.Define(self.stage, path)
        curves.CreateTypeAttr("linear")
        curves.CreatePurposeAttr("guide")
        curves.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(np.asarray(points, np.float32)))
        curves.CreateCurveVertexCountsAttr([len(points)])
        prim = curves.GetPrim()
        prim.CreateAttribute("userProperties:lane_id", Sdf.ValueTypeNames.String).Set(name)
        listed = prim.CreateAttribute("userProperties:successors", Sdf.ValueTypeNames.StringArray)
        listed.Set(list(successors))

    def sun(self):
        light = UsdLux.DistantLight.Define(self.stage, "/World/Sun")
        light.CreateIntensityAttr(4.0)
        UsdGeom.Xformable(light).AddRotateXYZOp().Set(Gf.Vec3f(40.0, 20.0, 0.0))
        UsdLux.DomeLight.Define(self.stage, "/World/Sky").CreateIntensityAttr(1.0)


def new_author(path=None, *, metres=1.0, up="Z"):
    stage = Usd.Stage.CreateNew(str(path)) if path else Usd.Stage.CreateInMemory()
    UsdGeom.SetStageMetersPerUnit(stage, metres)
    UsdGeom.SetStageUpAxis(stage, up)
    world = UsdGeom.Xform.Define(stage, "/World")
    stage.SetDefaultPrim(world.GetPrim())
    return Author(stage)


@pytest.fixture
def author() -> Callable[..., Author]:
    """Makes an `Author` of a new stage, in memory or at a path."""
    return new_author


@pytest.fixture(scope="session")
def opengl() -> str:
    """Name of the OpenGL renderer; tests that draw are skipped where there is none."""
    try:
        with open_context() as renderer:
            return renderer
    except EnvgenError as error:
        pytest.skip(str(error))


@pytest.fixture
def small_camera() -> Camera:
    """A camera whose pixels are easy to work out."""
    return Camera(width=200, height=100, fx=100.0, fy=100.0, cx=99.5, cy=49.5)


@pytest.fixture
def shoot(opengl):
    """Draws one frame of a stage; also returns its scene objects."""
    assert opengl

    def draw(stage: Usd.Stage, camera: Camera, pose: Pose):
        scene = read_scene(stage)
        with open_context():
            from envgen_usd.render.drawing.render_passes import FrameRenderer  # noqa: PLC0415 - binds the platform

            frame = FrameRenderer(scene, pack(scene), camera).draw(FrameRequest(pose))
        return frame, scene.scene_objects

    return draw


@pytest.fixture
def ahead() -> Pose:
    """At the origin, looking along +y with +z up."""
    matrix = np.eye(4)
    matrix[:3, :3] = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]])
    return Pose(matrix)


@pytest.fixture
def street(tmp_path: Path) -> Path:
    """A road with ground, house, trees and lanes, each of its own class."""
    pixels = np.random.default_rng(1).integers(90, 140, (64, 64, 3)).astype(np.uint8)
    Image.fromarray(pixels).save(tmp_path / "asphalt.png")
    leaf = np.zeros((32, 32, 4), np.uint8)
    leaf[..., 1] = 120
    leaf[8:24, 8:24, 3] = 255
    Image.fromarray(leaf).save(tmp_path / "leaf.png")
    write = new_author(tmp_path / "street.usda")
    write.sun()
    asphalt = write.material("/World/Looks/asphalt", texture="./asphalt.png")
    grass = write.material("/World/Looks/grass", colour=(0.1, 0.25, 0.05))
    wall = write.material("/World/Looks/wall", colour=(0.6, 0.3, 0.2))
    leaves = write.material("/World/Looks/leaves", texture="./leaf.png", cut=0.5)
    strips = [("Road", "road", asphalt, -4, 4), ("Left", "terrain", grass, -60, -4)]
    strips += [("Right", "terrain", grass, 4, 60)]
    for name, label, look, low, high in strips:
        points = [(low, -20, 0), (high, -20, 0), (high, 200, 0), (low, 200, 0)]
        mesh = write.mesh(f"/World/{name}", points, [(0, 1, 2, 3)], label=label)
        write.uvs(mesh, np.array(points)[:, :2] / 2.0)
        write.bind(mesh.GetPrim(), look)
    for index in range(3):
        house = UsdGeom.Xform.Define(write.stage, f"/World/Houses/h{index}").GetPrim()
        write.kind(house, "component")
        write.label(house, "building")
        low, high = (8, 20 + 30 * index, 0), (18, 40 + 30 * index, 9)
        write.bind(write.box(f"/World/Houses/h{index}/walls", low, high).GetPrim(), wall)
    _add_trees(write, leaves)
    write.lane("/World/Lanes/a", "a", [(2, -20, 0), (2, 60, 0)], ["b"])
    write.lane("/World/Lanes/b", "b", [(2, 60, 0), (2, 200, 0)])
    write.stage.Save()
    return tmp_path / "street.usda"


def _add_trees(write: Author, leaves: UsdShade.Material) -> None:
    """Six instances of one class prim: a trunk (pole) and a leaf card (vegetation)."""
    source = write.stage.CreateClassPrim("/Tree")
    card = [(-2, 0, 1), (2, 0, 1), (2, 0, 5), (-2, 0, 5)]
    mesh = write.mesh("/Tree/leaves", card, [(0, 1, 2, 3)])
    mesh.CreateDoubleSidedAttr(True)
    write.uvs(mesh, [(0, 0), (1, 0), (1, 1), (0, 1)])
    write.bind(mesh.GetPrim(), write.material("/Tree/look", texture="./leaf.png", cut=0.5))
    write.box("/Tree/trunk", (-0.1, -0.1, 0), (0.1, 0.1, 1.5))
    assert leaves
    for index in range(6):
        tree = UsdGeom.Xform.Define(write.stage, f"/World/Trees/t{index}")
        tree.AddTranslateOp().Set(Gf.Vec3d(-8.0, 20.0 + 15 * index, 0.0))
        tree.GetPrim().GetInherits().AddInherit(source.GetPath())
        tree.GetPrim().SetInstanceable(True)
        write.kind(tree.GetPrim(), "component")
        write.label(tree.GetPrim(), "vegetation")
