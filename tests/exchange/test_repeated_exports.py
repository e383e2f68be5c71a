"""Exports into the folder of an earlier one: every object shows its own image."""

import pytest
from PIL import Image

from envgen_usd.errors import EnvgenError
from envgen_usd.exchange.carla.carla_export import export_carla
from envgen_usd.exchange.environment_export import export_gltf
from envgen_usd.exchange.exported_files import gltf_header
from envgen_usd.exchange.stage_package import package_environment
from envgen_usd.recipe.build_options import demo_road

RED, GREEN, BLUE = (200, 30, 20), (20, 160, 40), (30, 40, 210)
PROP = """#usda 1.0
(
    defaultPrim = "Root"
    metersPerUnit = 1
    upAxis = "Z"
)
def Xform "Root"
{
    def Mesh "quad" (prepend apiSchemas = ["MaterialBindingAPI"])
    {
        int[] faceVertexCounts = [4]
        int[] faceVertexIndices = [0, 1, 2, 3]
        point3f[] points = [(0, 0, 0), (SIZE, 0, 0), (SIZE, 0, SIZE), (0, 0, SIZE)]
        texCoord2f[] primvars:st = [(0, 0), (1, 0), (1, 1), (0, 1)] (interpolation = "vertex")
        rel material:binding = </Root/LOOK>
    }
    def Material "LOOK"
    {
        token outputs:surface.connect = </Root/LOOK/Surface.outputs:surface>
        def Shader "Surface"
        {
            uniform token info:id = "UsdPreviewSurface"
            color3f inputs:diffuseColor.connect = </Root/LOOK/Image.outputs:rgb>
            token outputs:surface
        }
        def Shader "Image"
        {
            uniform token info:id = "UsdUVTexture"
            asset inputs:file = @./brick.png@
            float3 outputs:rgb
        }
    }
}
"""
STAGE = """#usda 1.0
(
    defaultPrim = "World"
    metersPerUnit = 1
    upAxis = "Z"
)
def Xform "World" (kind = "assembly")
{
    def Xform "A" (kind = "group")
    {
        def "prop" (payload = @a/prop.usda@)
        {
        }
    }
    def Xform "B" (kind = "group")
    {
        def "prop" (payload = @b/prop.usda@)
        {
        }
    }
    def Xform "C" (kind = "group")
    {
        def "prop" (instanceable = true
            references = @c/prop.usda@)
        {
        }
    }
}
"""


def write_prop(folder, size="2", look=""):
    folder.mkdir(exist_ok=True)
    text = PROP.replace("SIZE", size).replace("LOOK", look or f"look_of_{folder.name}")
    (folder / "prop.usda").write_text(text)


def paint(folder, colour):
    Image.new("RGB", (8, 8), colour).save(folder / "brick.png")


@pytest.fixture
def stage(tmp_path):
    """Three props, each with an image of the same name; two lie in payloads, one is an instance."""
    for name, colour in (("a", RED), ("b", BLUE), ("c", GREEN)):
        write_prop(tmp_path / name)
        paint(tmp_path / name, colour)
    (tmp_path / "stage.usda").write_text(STAGE)
    return tmp_path / "stage.usda"


def gltf(stage):
    return export_gltf(stage, stage.parent / "gltf")


def carla(stage):
    return export_carla(stage, stage.parent / "carla", road=demo_road("straight"))


def colours(result):
    """Colours of the images that each file shows."""
    found = {}
    for path in result.files:
        images = [path.parent / each["uri"] for each in gltf_header(path).get("images", [])]
        found[path.stem] = {Image.open(image).getpixel((0, 0))[:3] for image in images}
    return found


EXPORT = pytest.mark.parametrize("export", [gltf, carla])


def all_of(found):
    return set().union(*found.values())


@EXPORT
def test_a_file_that_is_kept_keeps_its_image(export, stage):
    """The image of B took the name of that of A, whose file was kept."""
    before = colours(export(stage))
    assert all_of(before) == {RED, GREEN, BLUE}
    write_prop(stage.parent / "b", "3")
    again = export(stage)
    assert colours(again) == before
    if export is gltf:
        assert again.kept == 2
        assert [each for each in before.values() if len(each) != 1] == []


@EXPORT
@pytest.mark.parametrize("name", ["a", "c"])
def test_an_image_that_is_painted_anew_is_written_anew(export, name, stage):
    """Images in payloads and instances were not looked at, and CARLA kept every old image."""
    export(stage)
    paint(stage.parent / name, (1, 2, 3))
    again = export(stage)
    others = {"a": {GREEN, BLUE}, "c": {RED, BLUE}}[name]
    assert all_of(colours(again)) == {(1, 2, 3)} | others
    assert len([*(again.folder / "textures").iterdir()]) == 3  # nothing old is left
    if export is gltf:
        assert again.kept == 2
    assert export(stage).kept == len(again.files)


@EXPORT
@pytest.mark.parametrize("damage", [bytes.fromhex("00"), None])
def test_an_image_that_is_damaged_is_written_again(export, damage, stage):
    first = export(stage)
    before, images = colours(first), sorted((first.folder / "textures").iterdir())
    contents = [image.read_bytes() for image in images]
    if damage is None:
        images[0].unlink()
    else:
        images[0].write_bytes(damage + contents[0][1:])
    assert colours(export(stage)) == before
    assert [image.read_bytes() for image in images] == contents


def test_what_others_put_beside_the_images_stays(stage):
    result = gltf(stage)
    (result.folder / "textures" / "mine_too.png").write_bytes(b"mine")
    gltf(stage)
    assert (result.folder / "textures" / "mine_too.png").read_bytes() == b"mine"


def test_a_package_holds_the_materials_of_payloads_and_no_old_ones(stage):
    target = stage.parent / "town"
    first = package_environment(stage, target, road=demo_road("straight"))
    assert set(first.materials) == {"look_of_a", "look_of_b", "look_of_c"}
    assert first.issues == ()
    (target / "materials" / "mine.xomp").write_text("mine")
    write_prop(stage.parent / "b", look="another")
    second = package_environment(stage, target)
    files = {path.name for path in (target / "materials").iterdir()}
    names = {"look_of_a", "another", "look_of_c"}
    made = {f"{name}{end}" for name in names for end in (".xomp", "_camera_brdf.xompt")}
    assert files == {"mine.xomp", *made}
    (issue,) = second.issues
    assert (issue.kind, issue.where) == ("package.road", "town.xodr")


def test_materials_of_one_name_that_differ_are_named(stage):
    write_prop(stage.parent / "b", look="look_of_a")
    result = package_environment(stage, stage.parent / "town")
    (issue,) = result.issues
    assert (issue.kind, issue.where) == ("package.material", "look_of_a")


@pytest.mark.parametrize("write", [export_carla, package_environment])
def test_the_road_is_that_of_the_build_below_an_artists_stage(write, environment, tmp_path):
    """The artist's layer lies beside the folder of the build, whose manifest was not found."""
    edits = tmp_path / "edits.usda"
    edits.write_text(f"#usda 1.0\n(\n    subLayers = [@{environment}/stage.usda@]\n)\n")
    with pytest.raises(EnvgenError, match="is not the road of"):
        write(edits, tmp_path / "out", road=demo_road("town"))
    assert not (tmp_path / "out").exists()
