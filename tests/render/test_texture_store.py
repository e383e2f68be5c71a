"""Textures that an earlier run left ready for the GPU: same pictures, and never stale ones."""

import os

import numpy as np
import pytest
from PIL import Image

from envgen_usd.render.cameras.camera_pose import Pose, look_at
from envgen_usd.render.cameras.camera_rig import Camera
from envgen_usd.render.drawing.drawn_frame import FrameRequest
from envgen_usd.render.opengl.gl_context import open_context
from envgen_usd.render.opengl.scene_tiles import pack
from envgen_usd.render.stage import texture_images
from envgen_usd.render.stage.stage_scene import StageScene
from envgen_usd.render.user_cache import FOLDER

CAMERA = Camera(width=160, height=120, fx=150.0, fy=150.0, cx=79.5, cy=59.5)
POSE = Pose(look_at(np.array([0.0, -6.0, 2.0]), np.array([0.0, 0.0, 1.0])))


@pytest.fixture
def cache(tmp_path, monkeypatch, opengl):
    """Folder of the textures in the cache."""
    assert opengl
    monkeypatch.setenv(FOLDER, str(tmp_path / "cache"))
    return tmp_path / "cache" / "textures"


@pytest.fixture
def wall(author, tmp_path):
    """A stage of two walls: one with a texture, one with leaves that are cut out."""
    rng = np.random.default_rng(3)
    Image.fromarray(rng.integers(0, 255, (48, 32, 3), np.uint8)).save(tmp_path / "wall.png")
    Image.fromarray(rng.integers(0, 255, (64, 64, 4), np.uint8)).save(tmp_path / "leaf.png")
    write = author(tmp_path / "walls.usda")
    for name, cut, x in (("wall", 0.0, -3.0), ("leaf", 0.5, 0.5)):
        corners = [(x, 0, 0), (x + 2.5, 0, 0), (x + 2.5, 0, 2.5), (x, 0, 2.5)]
        mesh = write.mesh(f"/World/{name}", corners, [(0, 1, 2, 3)], label="building")
        write.uvs(mesh, [(0, 0), (3, 0), (3, 3), (0, 3)])
        write.bind(
            mesh.GetPrim(), write.material(f"/World/m_{name}", texture=f"./{name}.png", cut=cut)
        )
    write.stage.Save()
    return tmp_path / "walls.usda"


@pytest.fixture
def decoded(monkeypatch):
    """Counts how often an image is decoded."""
    counted = []
    original = texture_images._bottom_up

    def counting(image):
        counted.append(1)
        return original(image)

    monkeypatch.setattr(texture_images, "_bottom_up", counting)
    return counted


def picture(path, *, cache=True):
    scene = StageScene(path, cache=cache).near(np.zeros((1, 3)))
    with open_context():
        from envgen_usd.render.drawing.render_passes import FrameRenderer  # noqa: PLC0415 - binds the platform

        return FrameRenderer(scene, pack(scene), CAMERA).draw(FrameRequest(POSE)).radiance


def test_pictures_with_kept_textures_are_the_same_and_decode_nothing(wall, cache, decoded):
    plain = picture(wall, cache=False)
    assert not cache.exists()
    first, count = picture(wall), len(decoded)
    again = picture(wall)
    assert np.array_equal(first, plain)
    assert np.array_equal(again, plain)
    assert len(decoded) == count
    assert len(list(cache.iterdir())) == 2


def test_an_image_that_changes_is_decoded_anew(wall, cache):
    assert np.array_equal(picture(wall), picture(wall))
    image = wall.parent / "wall.png"
    before = picture(wall)
    pixels, state = np.array(Image.open(image)), image.stat()
    Image.fromarray(255 - pixels).save(image)
    os.utime(image, ns=(state.st_atime_ns, state.st_mtime_ns))
    after = picture(wall)
    assert np.array_equal(after, picture(wall, cache=False))
    assert not np.array_equal(after, before)
    assert len(list(cache.iterdir())) == 3


@pytest.mark.parametrize("length", [0, 5, 100])
def test_a_file_that_was_cut_off_is_written_again(wall, cache, length):
    before = picture(wall)
    whole = {file: file.read_bytes() for file in cache.iterdir()}
    for file, content in whole.items():
        file.write_bytes(content[:length])
    assert np.array_equal(picture(wall), before)
    assert {file: file.read_bytes() for file in cache.iterdir()} == whole
