"""Opens the optional package `mitsuba`."""

import subprocess
import sys
from importlib import import_module, util
from typing import Any

from envgen_usd.errors import EnvgenError

_VARIANTS = ("cuda_ad_rgb", "llvm_ad_rgb", "scalar_rgb")
"""Kinds of Mitsuba, the fastest first."""
_PROBE = (
    "import sys, mitsuba; mitsuba.set_variant(sys.argv[1]); scene = mitsuba.cornell_box();"
    " scene['sensor']['film']['width'] = scene['sensor']['film']['height'] = 4;"
    " mitsuba.render(mitsuba.load_dict(scene), spp=1).numpy()"
)


def open_mitsuba() -> Any:  # noqa: ANN401
    """Returns the module `mitsuba` with the fastest variant that runs here.

    Raises:
        EnvgenError: Mitsuba is missing, or no variant runs.
    """
    if util.find_spec("mitsuba") is None:
        raise EnvgenError(
            "render: --engine mitsuba needs Mitsuba 3; install it with"
            " `pip install 'envgen-usd[mitsuba]'`"
        )
    mitsuba = import_module("mitsuba")
    if mitsuba.variant() is None:
        mitsuba.set_variant(_running_variant())
    return mitsuba


def mitsuba_name() -> str:
    """Name, version and variant of the opened package."""
    mitsuba = open_mitsuba()
    return f"Mitsuba {mitsuba.__version__} ({mitsuba.variant()})"


def _running_variant() -> str:
    """Tries each variant in a process of its own: libraries that do not fit end the process."""
    for variant in _VARIANTS:
        probe = subprocess.run(
            [sys.executable, "-P", "-c", _PROBE, variant], capture_output=True, check=False
        )
        if probe.returncode == 0:
            return variant
    raise EnvgenError("render: no variant of Mitsuba runs here; reinstall its package")
