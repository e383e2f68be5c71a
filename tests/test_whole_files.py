"""Files that appear whole or not at all, and what a full disk leaves behind."""

import os
import resource
import signal
import socket
import stat
import subprocess
import sys
import tempfile
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np
import pytest
import torch
from pxr import Sdf

from envgen_usd.assets.usd_files import new_layer, write_layer
from envgen_usd.chunks import HEIGHT_SAMPLES, LANDUSE_CELLS, Chunk
from envgen_usd.citygml.write import write_city
from envgen_usd.cityjson.write import write_cityjson
from envgen_usd.errors import EnvgenError
from envgen_usd.landuse.landuse_geotiff import write_landuse_map
from envgen_usd.landuse.network.model.generator import make_generator
from envgen_usd.landuse.network.model.network_config import NetworkConfig
from envgen_usd.landuse.network.training.trainer import TrainState
from envgen_usd.landuse.network.training.training_sheets import write_sheet
from envgen_usd.landuse.network.training.weights_file import write_state, write_weights
from envgen_usd.layers.usdz_package import write_package
from envgen_usd.models.city_model import City, CityObject
from envgen_usd.models.ground import HeightMap
from envgen_usd.models.landuse import LanduseMap
from envgen_usd.render.frames.image_files import write_depth, write_instances, write_png
from envgen_usd.terrain.heightmap_geotiff import write_heightmap
from envgen_usd.whole_files import (
    make_folder,
    remove_abandoned,
    shared_part_folder,
    temporary_folder,
    whole_file,
    write_whole,
)

CITY = City(tuple(CityObject(f"house_{i}", "Building") for i in range(300)))


def noise(*shape):
    return np.random.default_rng(0).integers(0, 200, shape)


def layer():
    made = new_layer("World")
    for number in noise(3000):
        Sdf.CreatePrimInLayer(made, f"/World/a{number}/b{number * 7919}")
    return made


def heightmap():
    return HeightMap(Chunk(0, 0), noise(HEIGHT_SAMPLES, HEIGHT_SAMPLES).astype(float))


def landuse():
    size = (LANDUSE_CELLS, LANDUSE_CELLS)
    return LanduseMap(Chunk(0, 0), noise(*size).astype(np.uint8) % 8, noise(*size))


def network():
    return make_generator(NetworkConfig(4, 2, head=(8, 8, 8), dim=8, heads=1, kind="unet"))


def state():
    return TrainState(0, {"weight": torch.rand(1000)}, {}, {}, {}, {})


WRITERS = {
    "a.txt": lambda path: write_whole(path, "x" * 10_000),
    "a.bin": lambda path: write_whole(path, b"x" * 10_000),
    "a.gml": lambda path: write_city(CITY, path),
    "a.json": lambda path: write_cityjson(CITY, path),
    "a.usda": lambda path: write_layer(layer(), path),
    "a.usdc": lambda path: write_layer(layer(), path),
    "a.usdz": lambda path: write_package(layer(), path),
    "height.tif": lambda path: write_heightmap(heightmap(), path),
    "landuse.tif": lambda path: write_landuse_map(landuse(), path),
    "a.png": lambda path: write_png(path, noise(99, 99).astype(np.uint8)),
    "instances.tif": lambda path: write_instances(path, noise(99, 99).astype(np.uint32)),
    "depth.tif": lambda path: write_depth(path, noise(99, 99).astype(np.float32)),
    "sheet.png": lambda path: write_sheet([[noise(99, 99, 3).astype(np.uint8)]], path),
    "a.safetensors": lambda path: write_weights(network(), path),
    "state.pt": lambda path: write_state(state(), path),
}


@contextmanager
def room_for(size):
    """No file of this process may grow beyond a number of bytes, as if the disk were full."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.mark.parametrize("missing", [0.9, 0.001])
@pytest.mark.parametrize("name", WRITERS)
def test_a_full_disk_names_the_file_and_keeps_the_old_one(tmp_path, name, missing):
    """Also where only the end is missing, of which GDAL and OpenUSD's packer say nothing."""
    path = tmp_path / name
    WRITERS[name](path)
    size = path.stat().st_size
    path.write_text("old")
    with room_for(size - max(1, int(size * missing))), pytest.raises(EnvgenError) as caught:
        WRITERS[name](path)
    (line,) = str(caught.value).splitlines()
    assert line.startswith(f"{path}: cannot be written: ")
    assert path.read_text() == "old"
    assert [file.name for file in tmp_path.iterdir()] == [name]


def test_the_message_tells_that_the_disk_is_full():
    with pytest.raises(EnvgenError, match=r"^/dev/full: .*: No space left on device\. Free space"):
        write_whole(Path("/dev/full"), "x" * 100_000)


@pytest.mark.parametrize("name", WRITERS)
@pytest.mark.parametrize("mask", [0o022, 0o027, 0o077])
def test_permissions_are_those_that_open_gives(tmp_path, name, mask):
    before = os.umask(mask)
    try:
        WRITERS[name](tmp_path / name)
        (tmp_path / "opened").write_text("")
    finally:
        os.umask(before)
    mode = (tmp_path / name).stat().st_mode
    assert oct(mode) == oct((tmp_path / "opened").stat().st_mode)
    assert stat.S_IMODE(mode) == 0o666 & ~mask


def test_an_existing_file_keeps_its_permissions_and_a_link_stays(tmp_path):
    file, link = tmp_path / "file", tmp_path / "link"
    file.write_text("old")
    file.chmod(0o600)
    link.symlink_to("file")
    write_whole(link, "new")
    assert link.is_symlink()
    assert file.read_text() == "new"
    assert stat.S_IMODE(file.stat().st_mode) == 0o600


def test_readers_see_the_old_file_until_the_end(tmp_path):
    path = tmp_path / "file"
    path.write_text("old")
    with whole_file(path) as part:
        part.write_text("new")
        assert path.read_text() == "old"
        assert part.name == path.name
    assert path.read_text() == "new"
    assert [file.name for file in tmp_path.iterdir()] == ["file"]


def test_many_files_share_a_folder_of_parts(tmp_path):
    names = ("a/file", "b/file", "b/other")
    with shared_part_folder(tmp_path / "out") as parts:
        for name in names:
            path = tmp_path / "out" / name
            make_folder(path.parent)
            with whole_file(path, within=parts) as part:
                part.write_text(name)
                assert not path.exists()
            with suppress(KeyError), whole_file(path, within=parts) as part:
                part.write_text("half")
                raise KeyError
            assert path.read_text() == name
    left = sorted(path.name for path in (tmp_path / "out").rglob("*"))
    assert left == ["a", "b", "file", "file", "other"]
    (tmp_path / "taken").write_text("")
    with (
        pytest.raises(EnvgenError, match="taken: cannot be written: "),
        shared_part_folder(tmp_path / "taken"),
    ):
        pass


@pytest.mark.parametrize("error", [KeyboardInterrupt(), KeyError(), FileNotFoundError(2, "", "/b")])
def test_what_is_not_about_writing_passes(tmp_path, error):
    def fill():
        with whole_file(tmp_path / "file") as part:
            part.write_text("half")
            raise error

    with pytest.raises(type(error)) as caught:
        fill()
    assert caught.value is error
    assert not any(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("no/file", "No such file or directory. Give a path in a folder that exists."),
        ("file/file", "Not a directory. Give a path in a folder that exists."),
        ("folder", "Is a directory. Give the path of a file, not of a folder."),
    ],
)
def test_a_place_that_takes_no_file_is_named_with_a_remedy(tmp_path, name, said):
    (tmp_path / "folder").mkdir()
    (tmp_path / "file").write_text("")
    with pytest.raises(EnvgenError) as caught:
        write_whole(tmp_path / name, "text")
    assert str(caught.value) == f"{tmp_path / name}: cannot be written: {said}"


def test_a_folder_that_a_file_is_in_the_way_of_is_named(tmp_path):
    make_folder(tmp_path / "a" / "b")
    make_folder(tmp_path / "a" / "b")
    (tmp_path / "a" / "file").write_text("")
    with pytest.raises(EnvgenError, match=r"file: cannot be written: File exists\. A file is in"):
        make_folder(tmp_path / "a" / "file")


WRITER = """
import sys, time
from pathlib import Path
from envgen_usd.whole_files import whole_file
with whole_file(Path(sys.argv[1])) as part:
    part.write_text("half")
    print("ready", flush=True)
    time.sleep(600)
"""


def test_only_what_ended_processes_of_this_machine_left_is_removed(tmp_path):
    """A process that is killed while it writes leaves a part; one that still writes keeps it."""
    (tmp_path / "images").mkdir()
    running = [
        subprocess.Popen(
            [sys.executable, "-c", WRITER, str(tmp_path / "images" / f"{name}.txt")],
            stdout=subprocess.PIPE,
        )
        for name in ("killed", "alive")
    ]
    assert all(each.stdout.readline() == b"ready\n" for each in running)
    running[0].kill()  # not waited for: it is a zombie, which no longer writes
    os.waitid(os.P_PID, running[0].pid, os.WEXITED | os.WNOWAIT)
    dead = f"{socket.gethostname()}.{running[0].pid}."
    elsewhere = tmp_path / f".envgen-usd.other.{dead}abc"
    elsewhere.mkdir()
    remove_abandoned(tmp_path)
    parts = [path for path in tmp_path.rglob(".envgen-usd.*") if path != elsewhere]
    assert elsewhere.is_dir()
    assert [path.name for part in parts for path in part.iterdir()] == ["alive.txt"]
    for each in running:
        each.kill()
        each.communicate()
    remove_abandoned(tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {"images", elsewhere.name}
    assert not list((tmp_path / "images").iterdir())


def test_an_interrupt_while_a_folder_is_made_leaves_none(tmp_path, monkeypatch):
    make = tempfile.mkdtemp

    def interrupted(*given, **named):
        made = make(*given, **named)
        signal.raise_signal(signal.SIGINT)
        return made

    monkeypatch.setattr(tempfile, "mkdtemp", interrupted)
    # Commands that other tests ran in this process have left their own.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt), temporary_folder(tmp_path, ".part."):
            pytest.fail("the interrupt was dropped")
    finally:
        signal.signal(signal.SIGINT, before)
    assert not list(tmp_path.iterdir())
