"""The bytes of a build do not follow from where things lie in memory."""

import hashlib
import os
import subprocess
import sys

from tests.short_roads import TINY_ROAD

# OpenUSD keeps each token at an address of its own. Who sorts by address sorts by the order in
# which a process met them first.
BUILD = """
import random, sys
from pxr import Vt
names = "custom default typeName variability kind references inheritPaths instanceable".split()
names += "specifier variantSelection properties primChildren apiSchemas payload".split()
random.Random(int(sys.argv.pop(1))).shuffle(names)
first = [Vt.TokenArray([name, *(f"{name}{k}" for k in range(9))]) for name in names]
import runpy
runpy.run_module("envgen_usd", run_name="__main__")
"""


def layers(folder):
    """Hash of each layer of a build."""
    paths = [path for path in sorted(folder.rglob("*.usd*")) if "assets" not in path.parts]
    return {p.relative_to(folder): hashlib.sha256(p.read_bytes()).hexdigest() for p in paths}


def test_layers_have_the_same_bytes_in_each_process(tiny_build, tmp_path):
    road, out = tmp_path / "small.xodr", tmp_path / "out"
    road.write_text(TINY_ROAD, "utf-8")
    build = ["build", str(road), "--country", "1", "--area", "residential", "--workers", "1"]
    subprocess.run(
        [sys.executable, "-c", BUILD, "2", *build, "--out", str(out)],
        check=True,
        capture_output=True,
        env=os.environ | {"PYTHONHASHSEED": "2"},
        timeout=600,
    )
    expected = layers(tiny_build.stage.parent)
    assert len(expected) > 20
    assert layers(out) == expected
