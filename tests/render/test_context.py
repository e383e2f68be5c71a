"""Which OpenGL is used, and what is said where there is none."""

import ctypes
import hashlib
import os
import subprocess
import sys

import pytest

from envgen_usd.errors import EnvgenError
from envgen_usd.render.opengl.gl_context import choose_platform, devices_in_order

RENDER = """
import sys
from pathlib import Path
from envgen_usd.errors import EnvgenError
from envgen_usd.render.frames.frame_export import render_frames
try:
    print(render_frames(Path(sys.argv[1]), Path(sys.argv[2]), 1).renderer)
except EnvgenError as error:
    sys.exit(str(error))
"""


def _render(platform, street, out):
    environment = {**os.environ, "PYOPENGL_PLATFORM": platform}
    command = [sys.executable, "-c", RENDER, str(street), str(out)]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    if done.returncode:
        pytest.skip(f"{platform}: {done.stderr.strip().splitlines()[-1]}")
    files = "semantic/000000.png", "instance/000000.tif"
    return {name: hashlib.sha256((out / name).read_bytes()).hexdigest() for name in files}


def test_without_any_library_the_error_names_the_packages(monkeypatch):
    def nothing(name, *args, **kwargs):
        raise OSError(name, args, kwargs)

    monkeypatch.delenv("PYOPENGL_PLATFORM", raising=False)
    monkeypatch.setattr(ctypes, "CDLL", nothing)
    with pytest.raises(EnvgenError, match=r"libegl1 libgl1-mesa-dri.*libosmesa6"):
        choose_platform()


def test_what_the_user_asks_for_is_used(monkeypatch):
    monkeypatch.setenv("PYOPENGL_PLATFORM", "osmesa")
    assert choose_platform() == "osmesa"


def test_egl_and_osmesa_give_the_same_labels(street, tmp_path):
    egl = _render("egl", street, tmp_path / "egl")
    assert egl == _render("osmesa", street, tmp_path / "osmesa")


@pytest.mark.parametrize(
    ("visible", "first"),
    [(None, 0), ("", 0), ("1", 2), ("1,0", 2), ("0", 1), ("7", 0), ("GPU-5", 0)],
)
def test_the_gpu_that_a_cluster_gives_is_the_first_choice(monkeypatch, visible, first):
    """EGL lists all devices, here one of another maker and two of CUDA, in an order of its own."""
    monkeypatch.delenv("CUDA_VISIBLE_DEVICES", raising=False)
    if visible is not None:
        monkeypatch.setenv("CUDA_VISIBLE_DEVICES", visible)
    order = devices_in_order(range(3), [None, 0, 1])
    assert order[0] == first
    assert sorted(order) == [0, 1, 2]
