"""Files of other programs become assets: what arrives is compared with what went in."""

import json
import shutil
import struct
from importlib import resources
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image
from pxr import Gf, Sdf, Usd, UsdGeom, UsdSemantics, UsdShade, UsdUtils

from envgen_usd.assets.asset_catalogue import read_catalogue
from envgen_usd.assets.asset_import import ImportOptions, import_asset
from envgen_usd.assets.library_check import check_library
from envgen_usd.assets.library_drafts import new_library
from envgen_usd.errors import EnvgenError

SHIPPED = Path(str(resources.files("envgen_usd.asset_library")))
RED, GREEN = (200, 30, 20), (20, 160, 40)


@pytest.fixture
def library(tmp_path):
    """A library with a single asset, and the materials that it has."""
    folder = tmp_path / "library"
    for part in ("materials", "textures"):
        (folder / part).mkdir(parents=True)
    shutil.copytree(SHIPPED / "assets/bench", folder / "assets/bench")
    for name in ("metal_dark", "wood", "concrete"):
        shutil.copy(SHIPPED / f"materials/{name}.usda", folder / "materials")
        for path in SHIPPED.glob(f"textures/{name}_*"):
            shutil.copy(path, folder / "textures")
    return folder


@pytest.fixture
def picture():
    """Red in the upper half, green below."""
    pixels = np.full((64, 64, 3), GREEN, dtype=np.uint8)
    pixels[:32] = RED
    return Image.fromarray(pixels)


def crate(picture, **material):
    """A box of 0.6 x 1.2 x 0.4 (x, y up, z) whose texture runs upwards with y."""
    box = trimesh.creation.box((0.6, 1.2, 0.4))
    uv = np.stack([box.vertices[:, 0] + 0.5, (box.vertices[:, 1] + 0.6) / 1.2], axis=1)
    look = trimesh.visual.material.PBRMaterial(
        name="paint", baseColorTexture=picture, metallicFactor=0.0, roughnessFactor=0.4, **material
    )
    box.visual = trimesh.visual.TextureVisuals(uv=uv, material=look)
    return box


def write_glb(path, *meshes):
    scene = trimesh.Scene()
    for number, mesh in enumerate(meshes):
        scene.add_geometry(mesh, node_name=f"part{number}", geom_name=f"part{number}")
    path.write_bytes(scene.export(file_type="glb"))
    return path


def near_points(path):
    """Points of the only mesh of an asset."""
    stage = Usd.Stage.Open(str(path))
    (mesh,) = near_meshes(stage)
    return points_of(mesh)


def near_meshes(stage):
    prims = [prim for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)]
    return [UsdGeom.Mesh(p) for p in prims if UsdGeom.Imageable(p).ComputePurpose() != "proxy"]


def points_of(mesh):
    return np.array(mesh.GetPointsAttr().Get())


def colour_above(stage, mesh):
    """Colour of the texture at the highest and at the lowest corner of a mesh."""
    material, _ = UsdShade.MaterialBindingAPI(mesh).ComputeBoundMaterial()
    texture = UsdShade.Shader(stage.GetPrimAtPath(material.GetPath().AppendChild("Colour")))
    image = np.array(Image.open(texture.GetInput("file").Get().resolvedPath).convert("RGB"))
    st = UsdGeom.PrimvarsAPI(mesh).GetPrimvar("st")
    uv, corners = np.array(st.ComputeFlattened()), mesh.GetFaceVertexIndicesAttr().Get()
    height = points_of(mesh)[list(corners), 2]
    shown = []
    for at in (height.argmax(), height.argmin()):
        v = np.clip(uv[at, 1], 0.02, 0.98)
        shown.append(image[int((1.0 - v) * len(image)), 32].astype(int))
    return shown


def test_a_glb_stands_upright_in_metres_and_keeps_its_texture(library, picture, tmp_path):
    box = crate(picture).apply_translation([3.0, 5.0, -2.0])
    made = import_asset(write_glb(tmp_path / "crate.glb", box), library, ImportOptions("bench"))
    # Its front, +z in glTF, faces +x: depth, width, height.
    assert made.size == pytest.approx((0.4, 0.6, 1.2), abs=1e-3)
    stage = Usd.Stage.Open(str(library / made.path))
    (mesh,) = near_meshes(stage)
    points = points_of(mesh)
    np.testing.assert_allclose(points.min(axis=0), [-0.2, -0.3, 0.0], atol=1e-5)
    np.testing.assert_allclose(points.max(axis=0), [0.2, 0.3, 1.2], atol=1e-5)
    above, below = colour_above(stage, mesh)
    np.testing.assert_allclose(above, RED, atol=12)
    np.testing.assert_allclose(below, GREEN, atol=12)
    assert check_library(read_catalogue(library)) == ()


def test_the_front_of_a_gltf_faces_plus_x(library, tmp_path):
    """A cone whose tip points along +z of glTF."""
    tip = trimesh.creation.cone(radius=0.2, height=1.0)
    made = import_asset(write_glb(tmp_path / "arrow.glb", tip), library, ImportOptions("bench"))
    points = near_points(library / made.path)
    ahead = points[points[:, 0] > 0.4]
    assert np.ptp(ahead, axis=0).max() < 0.01, "the tip"
    turned = ImportOptions("bench", name="turned", turn=90.0)
    made = import_asset(tmp_path / "arrow.glb", library, turned)
    points = near_points(library / made.path)
    assert np.ptp(points[points[:, 1] > 0.4], axis=0).max() < 0.01


def test_faces_look_outwards(library, picture, tmp_path):
    made = import_asset(
        write_glb(tmp_path / "crate.glb", crate(picture)), library, ImportOptions("bench")
    )
    stage = Usd.Stage.Open(str(library / made.path))
    (mesh,) = near_meshes(stage)
    corners = np.array(mesh.GetFaceVertexIndicesAttr().Get()).reshape(-1, 3)
    solid = trimesh.Trimesh(points_of(mesh), corners, process=False)
    assert solid.volume == pytest.approx(0.6 * 1.2 * 0.4, rel=1e-4)
    stated = UsdGeom.PrimvarsAPI(mesh).GetPrimvar("normals").ComputeFlattened()
    normals = np.array(stated).reshape(-1, 3, 3).mean(axis=1)
    assert (np.einsum("ij,ij->i", normals, solid.face_normals) > 0.9).all()


def test_labels_kind_and_relief_arrive(library, picture, tmp_path):
    bumps = Image.fromarray(np.full((16, 16, 3), (128, 128, 255), dtype=np.uint8))
    rough = Image.fromarray(np.full((16, 16, 3), (0, 128, 255), dtype=np.uint8))
    box = crate(picture, normalTexture=bumps, metallicRoughnessTexture=rough)
    box.visual.material.metallicFactor = 1.0
    file = write_glb(tmp_path / "crate.glb", box)
    made = import_asset(file, library, ImportOptions("planter", label="vegetation"))
    stage = Usd.Stage.Open(str(library / made.path))
    root = stage.GetDefaultPrim()
    assert Usd.ModelAPI(root).GetKind() == "component"
    for taxonomy in ("class", "cityscapes"):
        labels = UsdSemantics.LabelsAPI(root, taxonomy).GetLabelsAttr().Get()
        assert list(labels) == ["vegetation"]
    surface = stage.GetPrimAtPath(f"{root.GetPath()}/Materials/{made.materials[0]}")
    shader, _, _ = UsdShade.Material(surface).ComputeSurfaceSource()
    assert shader.GetInput("metallic").Get() == pytest.approx(1.0, abs=0.01)
    stated = Image.open(library / "textures" / f"{made.materials[0]}_roughness.jpg")
    assert np.array(stated).mean() == pytest.approx(0.4 * 128, abs=2)


def test_a_large_mesh_gets_a_far_geometry_of_its_shape(library, tmp_path):
    ball = trimesh.creation.icosphere(subdivisions=4, radius=0.7)
    file = write_glb(tmp_path / "ball.glb", ball)
    made = import_asset(file, library, ImportOptions("bin"))
    near, far = made.triangles
    assert near == len(ball.faces)
    assert 20 < far <= 120
    stage = Usd.Stage.Open(str(library / made.path))
    (mesh,) = near_meshes(stage)
    assert UsdGeom.Imageable(mesh).ComputePurpose() == "render"
    (target,) = mesh.GetPrim().GetRelationship("proxyPrim").GetTargets()
    coarse = UsdGeom.Mesh(stage.GetPrimAtPath(target))
    away = np.linalg.norm(points_of(coarse) - [0.0, 0.0, 0.7], axis=1)
    assert 0.5 < away.min() <= away.max() < 0.71


OBJ = """mtllib crate.mtl
o crate
v 0 0 0
v 100 0 0
v 100 0 50
v 0 0 50
v 0 200 0
v 100 200 0
v 100 200 50
v 0 200 50
usemtl steel
f 1 2 3 4
f 8 7 6 5
f 1 5 6 2
f 2 6 7 3
usemtl red
f 3 7 8 4
f 4 8 5 1
"""
MTL = "newmtl steel\nKd 0.5 0.5 0.5\nnewmtl red\nKd 1 0 0\n"


def test_an_obj_in_centimetres_is_named_and_scaled(library, tmp_path):
    (tmp_path / "crate.obj").write_text(OBJ)
    (tmp_path / "crate.mtl").write_text(MTL)
    made = import_asset(tmp_path / "crate.obj", library, ImportOptions("bin"))
    assert any("--scale 0.01" in issue.action for issue in made.issues)
    again = ImportOptions("bin", scale=0.01, replace=True)
    made = import_asset(tmp_path / "crate.obj", library, again)
    assert made.size == pytest.approx((0.5, 1.0, 2.0))
    assert not [issue for issue in made.issues if "--scale" in issue.action]
    assert made.materials == ("crate_red", "crate_steel")
    tall = ImportOptions("bin", height=1.1, replace=True)
    made = import_asset(tmp_path / "crate.obj", library, tall)
    assert made.size == pytest.approx((0.275, 0.55, 1.1))
    red = Usd.Stage.Open(str(library / "materials/crate_red.usda"))
    shader, _, _ = UsdShade.Material(red.GetDefaultPrim()).ComputeSurfaceSource()
    assert tuple(shader.GetInput("diffuseColor").Get()) == (1.0, 0.0, 0.0)


def usd_file(path, *, up="Y", metres=0.01):
    """A box of 60 x 120 x 40 units beside the origin, of two materials by subset."""
    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageUpAxis(stage, up)
    UsdGeom.SetStageMetersPerUnit(stage, metres)
    root = UsdGeom.Xform.Define(stage, "/Crate")
    stage.SetDefaultPrim(root.GetPrim())
    root.AddTranslateOp().Set((500, 0, 0))
    mesh = UsdGeom.Mesh.Define(stage, "/Crate/Body")
    box = trimesh.creation.box((60, 120, 40))
    mesh.CreatePointsAttr(box.vertices.tolist())
    mesh.CreateFaceVertexCountsAttr([3] * len(box.faces))
    mesh.CreateFaceVertexIndicesAttr(box.faces.reshape(-1).tolist())
    mesh.CreateSubdivisionSchemeAttr("none")
    for name, colour in (("a", (0.1, 0.2, 0.3)), ("b", (0.4, 0.5, 0.6))):
        material = UsdShade.Material.Define(stage, f"/Crate/{name}")
        shader = UsdShade.Shader.Define(stage, f"/Crate/{name}/surface")
        shader.CreateIdAttr("UsdPreviewSurface")
        shader.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f).Set(Gf.Vec3f(*colour))
        material.CreateSurfaceOutput().ConnectToSource(shader.ConnectableAPI(), "surface")
        if name == "a":
            UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(material)
            continue
        api = UsdShade.MaterialBindingAPI(mesh.GetPrim())
        subset = api.CreateMaterialBindSubset("top", [0, 1, 2, 3])
        UsdShade.MaterialBindingAPI.Apply(subset.GetPrim()).Bind(material)
    stage.Save()
    return path


@pytest.mark.parametrize("packed", [False, True])
def test_a_usd_file_keeps_subsets_and_units(packed, library, tmp_path):
    file = usd_file(tmp_path / "crate.usda")
    if packed:
        assert UsdUtils.CreateNewUsdzPackage(str(file), str(tmp_path / "crate.usdz"))
        file = tmp_path / "crate.usdz"
    made = import_asset(file, library, ImportOptions("bin"))
    assert made.size == pytest.approx((0.4, 0.6, 1.2), abs=1e-3)
    stage = Usd.Stage.Open(str(library / made.path))
    faces = {}
    for mesh in near_meshes(stage):
        material, _ = UsdShade.MaterialBindingAPI(mesh).ComputeBoundMaterial()
        faces[material.GetPrim().GetName()] = len(mesh.GetFaceVertexCountsAttr().Get())
    assert faces == {"crate_a": 8, "crate_b": 4}


@pytest.mark.parametrize("packed", [False, True])
def test_textures_of_usd_files_are_imported(packed, library, tmp_path):
    file, image = usd_file(tmp_path / "crate.usda"), tmp_path / "a.png"
    Image.new("RGB", (64, 64), (200, 30, 40)).save(image)
    stage = Usd.Stage.Open(str(file))
    texture = UsdShade.Shader.Define(stage, "/Crate/a/image")
    texture.CreateIdAttr("UsdUVTexture")
    texture.CreateInput("file", Sdf.ValueTypeNames.Asset).Set("./a.png")
    shader = UsdShade.Shader(stage.GetPrimAtPath("/Crate/a/surface"))
    shader.GetInput("diffuseColor").ConnectToSource(texture.ConnectableAPI(), "rgb")
    stage.Save()
    if packed:
        assert UsdUtils.CreateNewUsdzPackage(str(file), str(tmp_path / "crate.usdz"))
        file = tmp_path / "crate.usdz"
    import_asset(file, library, ImportOptions("bin"))
    with Image.open(library / "textures" / "crate_a_colour.jpg") as kept:
        assert np.asarray(kept).reshape(-1, 3).mean(axis=0) == pytest.approx((200, 30, 40), abs=2)


def textured_usd(folder, image):
    """A box whose first material has the colours of an image."""
    file = usd_file(folder / "crate.usda")
    stage = Usd.Stage.Open(str(file))
    texture = UsdShade.Shader.Define(stage, "/Crate/a/image")
    texture.CreateIdAttr("UsdUVTexture")
    texture.CreateInput("file", Sdf.ValueTypeNames.Asset).Set(f"./{image}")
    shader = UsdShade.Shader(stage.GetPrimAtPath("/Crate/a/surface"))
    shader.GetInput("diffuseColor").ConnectToSource(texture.ConnectableAPI(), "rgb")
    stage.Save()
    return file


def textured_obj(folder, image):
    """A box whose material has the colours of an image."""
    (folder / "two words.mtl").write_text(f"newmtl a\nKd 1 1 1\nmap_Kd {image}\n")
    box = trimesh.creation.box((0.6, 1.2, 0.4))
    lines = ["mtllib two words.mtl", "vt 0 0", "usemtl a"]
    lines[1:1] = [f"v {x} {y} {z}" for x, y, z in box.vertices]
    lines += [f"f {a + 1}/1 {b + 1}/1 {c + 1}/1" for a, b, c in box.faces]
    (folder / "crate.obj").write_text("\n".join(lines))
    return folder / "crate.obj"


def textured_gltf(folder, image):
    """A box whose material names an image beside the file."""
    whole = write_glb(folder / "whole.glb", crate(Image.new("RGB", (64, 64)))).read_bytes()
    length = struct.unpack_from("<I", whole, 12)[0]
    header = json.loads(whole[20 : 20 + length])
    header["buffers"][0]["uri"] = "crate.bin"
    header["images"] = [{"uri": image.replace(" ", "%20")}]
    (folder / "crate.bin").write_bytes(whole[28 + length :])
    (folder / "crate.gltf").write_text(json.dumps(header))
    return folder / "crate.gltf"


MADE = pytest.mark.parametrize("made", [textured_usd, textured_obj, textured_gltf])


@MADE
def test_a_grey_image_of_sixteen_bits_keeps_its_level(made, library, tmp_path):
    """It became white: 51,400 of 65,535 is 200 of 255."""
    Image.fromarray(np.full((64, 64), 51_400, np.uint16)).save(tmp_path / "grey level.png")
    asset = import_asset(made(tmp_path, "grey level.png"), library, ImportOptions("bin"))
    assert not [issue for issue in asset.issues if "grey level" in issue.where]
    (image,) = (library / "textures").glob("crate_*_colour.jpg")
    with Image.open(image) as kept:
        assert np.asarray(kept).mean() == pytest.approx(200, abs=2)


@MADE
@pytest.mark.parametrize("content", [None, b"", b"\x89PNG\r\n\x1a\n"])
def test_an_image_that_cannot_be_read_is_named(made, content, library, tmp_path):
    if content is not None:
        (tmp_path / "lost image.png").write_bytes(content)
    asset = import_asset(made(tmp_path, "lost image.png"), library, ImportOptions("bin"))
    said = "does not exist" if content is None else "cannot be read"
    (issue,) = [issue for issue in asset.issues if "lost image.png" in issue.where]
    assert said in issue.message


@pytest.mark.parametrize("made", [textured_obj, textured_gltf])
def test_an_image_outside_of_the_folder_is_named_and_not_read(made, library, tmp_path):
    (tmp_path / "model").mkdir()
    Image.new("RGB", (64, 64)).save(tmp_path / "out.png")
    asset = import_asset(made(tmp_path / "model", "../out.png"), library, ImportOptions("bin"))
    (issue,) = [issue for issue in asset.issues if "out.png" in issue.where]
    assert "outside of the folder" in issue.message
    assert not [*(library / "textures").glob("crate_*_colour.jpg")]


@pytest.mark.parametrize("name", [r"maps\red.png", "maps/red.png"])
def test_a_path_of_windows_is_followed(name, library, tmp_path):
    (tmp_path / "maps").mkdir()
    Image.new("RGB", (64, 64), RED).save(tmp_path / "maps/red.png")
    import_asset(textured_obj(tmp_path, name), library, ImportOptions("bin"))
    (image,) = (library / "textures").glob("crate_*_colour.jpg")
    with Image.open(image) as kept:
        assert np.asarray(kept).reshape(-1, 3).mean(axis=0) == pytest.approx(RED, abs=2)


def test_an_image_of_several_tiles_is_named(library, tmp_path):
    for tile in (1001, 1002):
        Image.new("RGB", (64, 64)).save(tmp_path / f"skin.{tile}.png")
    asset = import_asset(textured_usd(tmp_path, "skin.<UDIM>.png"), library, ImportOptions("bin"))
    (issue,) = [issue for issue in asset.issues if "<UDIM>" in issue.where]
    assert "tiles" in issue.message


def test_several_libraries_of_materials_in_a_line_are_found(library, tmp_path):
    (tmp_path / "crate.obj").write_text(OBJ.replace("mtllib crate.mtl", "mtllib b.mtl crate.mtl"))
    (tmp_path / "crate.mtl").write_text(MTL)
    (tmp_path / "b.mtl").write_text("newmtl other\nKd 1 1 1\n")
    asset = import_asset(tmp_path / "crate.obj", library, ImportOptions("bin", scale=0.01))
    assert not [issue for issue in asset.issues if "mtllib" in issue.where]


def test_names_that_no_file_can_have_are_named(library, tmp_path):
    (tmp_path / "crate.obj").write_text(OBJ.replace("crate.mtl", 300 * "a"))
    asset = import_asset(tmp_path / "crate.obj", library, ImportOptions("bin", scale=0.01))
    assert [issue for issue in asset.issues if f"mtllib {300 * 'a'}" in issue.where]
    file = textured_obj(tmp_path, 300 * "b")
    asset = import_asset(file, library, ImportOptions("bin", replace=True))
    (issue,) = [issue for issue in asset.issues if 300 * "b" in issue.where]
    assert "cannot be read" in issue.message


def test_a_flat_model_is_refused_by_its_name(library, tmp_path):
    square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n"
    (tmp_path / "sheet.obj").write_text(square)
    with pytest.raises(EnvgenError, match=r"sheet\.obj: is flat, "):
        import_asset(tmp_path / "sheet.obj", library, ImportOptions("bin"))
    assert not (library / "assets/bin/sheet").exists()


def test_a_subset_of_faces_that_are_not_there_is_named(library, tmp_path):
    file = usd_file(tmp_path / "crate.usda")
    stage = Usd.Stage.Open(str(file))
    UsdGeom.Subset(stage.GetPrimAtPath("/Crate/Body/top")).GetIndicesAttr().Set([0, 12])
    stage.Save()
    with pytest.raises(EnvgenError, match=r"crate\.usda: /Crate/Body/top: indices do not fit"):
        import_asset(file, library, ImportOptions("bin"))
    assert not (library / "assets/bin/crate").exists()


def test_a_z_up_usd_file_keeps_its_axes(library, tmp_path):
    file = usd_file(tmp_path / "crate.usda", up="Z", metres=0.01)
    made = import_asset(file, library, ImportOptions("bin"))
    assert made.size == pytest.approx((0.6, 1.2, 0.4), abs=1e-3)


def test_a_window_fills_the_unit_square_in_its_wall(library, picture, tmp_path):
    file = write_glb(tmp_path / "pane.glb", crate(picture))
    made = import_asset(file, library, ImportOptions("window", label="building"))
    points = near_points(library / made.path)
    np.testing.assert_allclose(points.min(axis=0), [0.0, 0.0, 0.0], atol=1e-5)
    np.testing.assert_allclose(points.max(axis=0), [1.0, 0.4, 1.0], atol=1e-5)


def damaged(tmp_path, picture):
    """Files that cannot become an asset, with what the message has to name."""
    (tmp_path / "text.glb").write_bytes(b"hello, this is no glTF")
    yield "text.glb", "text.glb: is no glTF 2.0 file"
    (tmp_path / "points.obj").write_text("v 0 0 0\nv 1 0 0\n")
    yield "points.obj", "holds no mesh with faces"
    (tmp_path / "index.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n")
    yield "index.obj", "index.obj"
    (tmp_path / "nan.obj").write_text("v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n")
    yield "nan.obj", "mesh '"
    (tmp_path / "line.obj").write_text("v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n")
    yield "line.obj", "no extent in two directions"
    (tmp_path / "text.usda").write_text("no usd")
    yield "text.usda", "text.usda: cannot be read as a USD file"
    (tmp_path / "crate.fbx").write_bytes(b"")
    yield "crate.fbx", "known: .glb"
    yield "none.glb", "no such file"
    whole = write_glb(tmp_path / "whole.glb", crate(picture)).read_bytes()
    (tmp_path / "cut.glb").write_bytes(whole[: len(whole) // 2])
    yield "cut.glb", "cut.glb: "
    length = struct.unpack_from("<I", whole, 12)[0]
    header = json.loads(whole[20 : 20 + length]) | {"extensionsRequired": ["KHR_draco"]}
    (tmp_path / "draco.gltf").write_text(json.dumps(header))
    yield "draco.gltf", "extensionsRequired KHR_draco"


def test_what_cannot_be_read_is_named_and_changes_nothing(library, picture, tmp_path):
    before = {path: path.stat().st_mtime_ns for path in library.rglob("*")}
    for name, said in damaged(tmp_path, picture):
        with pytest.raises(EnvgenError) as error:
            import_asset(tmp_path / name, library, ImportOptions("bin"))
        assert said in str(error.value)
        assert "\n" not in str(error.value)
        assert {path: path.stat().st_mtime_ns for path in library.rglob("*")}.keys() == (
            before.keys()
        ), name


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (ImportOptions("bench", name="bench"), "--replace"),
        (ImportOptions("bench", label="table"), "unknown label 'table'"),
        (ImportOptions("bench", scale=0.0), "scale 0.0"),
        (ImportOptions("bench", height=float("nan")), "height nan"),
        (ImportOptions("bench", up="x"), "up axis 'x'"),
        (ImportOptions("a bench"), "kind 'a bench'"),
        (ImportOptions("bench", name="../../bench"), r"name '\.\./\.\./bench'"),
    ],
)
def test_wrong_options_are_named(options, said, library, picture, tmp_path):
    file = write_glb(tmp_path / "crate.glb", crate(picture))
    with pytest.raises(EnvgenError, match=said):
        import_asset(file, library, options)


def test_a_folder_without_a_library_is_named(picture, tmp_path):
    file = write_glb(tmp_path / "crate.glb", crate(picture))
    with pytest.raises(EnvgenError, match="no asset library"):
        import_asset(file, tmp_path, ImportOptions("bench"))


def test_a_build_is_no_library_though_it_holds_assets(library, picture, tmp_path):
    file = write_glb(tmp_path / "crate.glb", crate(picture))
    (library / "manifest.json").write_text("{}")
    with pytest.raises(EnvgenError, match="a build, no asset library"):
        import_asset(file, library, ImportOptions("bench"))
    assert not (library / "assets/bench/crate").exists()


def test_a_new_library_is_the_shipped_one(tmp_path):
    new_library(tmp_path / "mine")
    mine, shipped = read_catalogue(tmp_path / "mine"), read_catalogue()
    assert mine.assets.keys() == shipped.assets.keys()
    assert mine.materials.keys() == shipped.materials.keys()
    assert (tmp_path / "mine/environments/country_1/residential.toml").is_file()
    with pytest.raises(EnvgenError, match="is not empty"):
        new_library(tmp_path / "mine")
