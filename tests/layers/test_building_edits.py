"""A stronger layer edits a building: all that belongs to the building follows, or vanishes."""

from pathlib import Path

import numpy as np
import pytest
from pxr import Gf, Sdf, Usd, UsdGeom

from envgen_usd.errors import EnvgenError
from envgen_usd.render.cameras.camera_pose import Pose, look_at
from envgen_usd.render.cameras.camera_rig import Camera
from envgen_usd.render.drawing.drawn_frame import FrameRequest
from envgen_usd.render.opengl.gl_context import open_context
from envgen_usd.render.opengl.scene_tiles import pack
from envgen_usd.render.stage.stage_reader import read_scene

HOUSE = Sdf.Path("/World/chunk_0_0/Buildings/house_1_chunk_0_0")
CAMERA = Camera(width=320, height=240, fx=300.0, fy=300.0, cx=159.5, cy=119.5)
EYE = np.array([80.0, 90.0, 6.0])
TARGET = np.array([80.0, 112.0, 4.0])


@pytest.fixture(scope="module")
def shoot(stage_file, tmp_path_factory):
    """Renders the stage below a layer of edits; each pixel is (class, part, object)."""
    try:
        with open_context():
            pass
    except EnvgenError as error:
        pytest.skip(str(error))

    def shoot_(edit=None, shift=(0.0, 0.0, 0.0)):
        path = tmp_path_factory.mktemp("edits") / "edits.usda"
        layer = Sdf.Layer.CreateNew(str(path))
        layer.subLayerPaths.append(str(stage_file))
        stage = Usd.Stage.Open(layer)
        if edit is not None:
            edit(stage.GetPrimAtPath(HOUSE))
        scene = read_scene(stage)
        with open_context():
            from envgen_usd.render.drawing.render_passes import FrameRenderer  # noqa: PLC0415 - binds the platform

            pose = Pose(look_at(EYE + shift, TARGET + shift))
            frame = FrameRenderer(scene, pack(scene), CAMERA).draw(FrameRequest(pose))
        table = [(o.label, o.part, o.path) for o in scene.scene_objects]
        names = np.empty(len(table), dtype=object)
        names[:] = table
        return names[frame.scene_objects]

    return shoot_


def pixels_of(image, path=str(HOUSE)):
    return np.array([[pixel[2] == path for pixel in row] for row in image])


def parts_at(image, where):
    return {pixel[1] for pixel in image[where]}


def openings_at(image, where):
    return {part for part in parts_at(image, where) if part.startswith(("window", "door"))}


@pytest.fixture(scope="module")
def before(shoot):
    return shoot()


def test_the_camera_sees_walls_windows_and_doors_of_the_house(before):
    seen = parts_at(before, pixels_of(before))
    assert {"wall", "window_pane", "window_frame"} <= seen
    assert any(part.startswith("door") for part in seen)


def test_a_moved_building_takes_its_openings_along(before, shoot):
    """From a camera that moves along, every pixel of the building is what it was."""
    shift = np.array([3.0, -5.0, 200.0])

    def move(house):
        attribute = house.GetAttribute("xformOp:translate")
        attribute.Set(attribute.Get() + Gf.Vec3d(*shift))

    was = pixels_of(before)
    along = shoot(move, shift)
    same = np.array([a == b for a, b in zip(before[was], along[was], strict=True)])
    assert same.mean() > 0.995  # float32 points round the edges at other places
    left = shoot(move)
    assert not pixels_of(left).any()
    assert not openings_at(left, was)


@pytest.mark.parametrize(
    "edit",
    [lambda house: UsdGeom.Imageable(house).MakeInvisible(), lambda house: house.SetActive(False)],
    ids=["hidden", "deleted"],
)
def test_openings_vanish_with_their_building(before, shoot, edit):
    was = pixels_of(before)
    after = shoot(edit)
    assert not pixels_of(after).any()
    assert not openings_at(after, was)
    assert all(a == b for a, b in zip(before[~was], after[~was], strict=True))


def test_what_belongs_to_a_building_lies_below_it(stage_file):
    stage = Usd.Stage.Open(str(stage_file))
    children = stage.GetPrimAtPath(HOUSE.AppendChild("Props")).GetChildren()
    assert len(children) == 15
    for prim in children:
        assert prim.IsInstance()
        assert Usd.ModelAPI(prim).GetKind() == "subcomponent"
        assert set(prim.GetVariantSets().GetNames()) == set(
            prim.GetVariantSets().GetAllVariantSelections()
        )
        assert prim.GetAttribute("userProperties:category").Get() in {"window", "door"}
        assert prim.GetPrototype().GetChild("Geometry").GetChildren()
    others = stage.GetPrimAtPath("/World/chunk_0_0/Props").GetChildren()
    assert not [prim.GetPath() for prim in others if "house" in prim.GetName()]


def test_without_the_buildings_layer_no_opening_hangs_in_the_air(stage_file):
    stage = Usd.Stage.Open(str(stage_file))
    stage.MuteLayer(str(stage_file.parent / "layers" / "buildings.usda"))
    assert not [prim for prim in stage.Traverse() if "house" in str(prim.GetPath())]


def test_the_example_of_the_page_moves_hides_and_deletes(stage_file):
    page = Path(__file__).parents[2] / "docs" / "stage.md"
    text = page.read_text().split("```usda\n")[1].split("```")[0]
    layer = Sdf.Layer.CreateAnonymous(".usda")
    assert layer.ImportFromString(text.replace("my_town/stage.usda", str(stage_file)))
    edited, stage = Usd.Stage.Open(layer), Usd.Stage.Open(str(stage_file))
    window = HOUSE.GetParentPath().AppendPath("house_0_chunk_0_0/Props/house_0_chunk_0_0_o3")
    places = [
        UsdGeom.XformCache().GetLocalToWorldTransform(s.GetPrimAtPath(window)).ExtractTranslation()
        for s in (stage, edited)
    ]
    np.testing.assert_allclose(places[1] - places[0], (0, 13, 0), atol=1e-9)
    drawn = {prim.GetPath() for prim in edited.Traverse()}
    assert not [path for path in drawn if "house_2" in str(path)]
    hidden = edited.GetPrimAtPath(HOUSE.AppendPath("Props/house_1_chunk_0_0_o3"))
    assert UsdGeom.Imageable(hidden).ComputeVisibility() == UsdGeom.Tokens.invisible
