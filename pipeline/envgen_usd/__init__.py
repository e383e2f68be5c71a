"""From an OpenDRIVE road to a labelled 3D environment in OpenUSD, with camera images and labels.

`__all__` lists the public API; `docs/api.md` shows examples. Other names may change between
versions. The first use of a name imports its module, so that commands start fast.
"""

import os
import sys
from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

# Threads of OpenBLAS, which NumPy starts on import, spin 0.06 CPU seconds for work before they
# sleep (2^26 ticks). The least value that it takes lets them sleep at once.
os.environ.setdefault("OPENBLAS_THREAD_TIMEOUT", "4")


def _name_schemas() -> None:
    """Names the schemas of our stages to OpenUSD, which reads the variable when it starts."""
    spec = find_spec("envgen_usd.schemas")
    folder = next(iter(spec.submodule_search_locations or []), "") if spec else ""
    known = os.environ.get("PXR_PLUGINPATH_NAME", "")
    if folder and folder not in known.split(os.pathsep):
        os.environ["PXR_PLUGINPATH_NAME"] = os.pathsep.join(filter(None, (known, folder)))
    if "pxr" in sys.modules:
        import_module("envgen_usd.assets.stage_schemas").register_schemas()


_name_schemas()

if TYPE_CHECKING:
    from envgen_usd.citygml.read import read_city
    from envgen_usd.citygml.write import write_city
    from envgen_usd.environment_files import known_environments, read_profile
    from envgen_usd.errors import EnvgenError, Issue, Severity
    from envgen_usd.models.city_model import City, CityObject
    from envgen_usd.models.road import RoadNetwork
    from envgen_usd.models.road_surface import RoadSurface
    from envgen_usd.opendrive.reader import read_network
    from envgen_usd.opendrive.surface import build_surface
    from envgen_usd.recipe.build_options import BuildOptions, demo_road
    from envgen_usd.recipe.built_environment import Environment, open_environment
    from envgen_usd.recipe.environment_build import BuildResult, build
    from envgen_usd.render.frames.frame_export import RenderResult, render_frames
    from envgen_usd.render.frames.frame_light import LightChoice
    from envgen_usd.render.frames.frame_set import Frame, FrameSet, read_frames
    from envgen_usd.render.frames.scan_folder import LidarChoice
    from envgen_usd.render.stage.stage_reader import open_stage
    from envgen_usd.render.stage.stage_scene import StageScene
    from envgen_usd.render.trajectories.trajectory import Trajectory

    __version__: str

_HOMES = {
    "BuildOptions": "recipe.build_options",
    "BuildResult": "recipe.environment_build",
    "City": "models.city_model",
    "CityObject": "models.city_model",
    "Environment": "recipe.built_environment",
    "EnvgenError": "errors",
    "Frame": "render.frames.frame_set",
    "FrameSet": "render.frames.frame_set",
    "Issue": "errors",
    "LidarChoice": "render.frames.scan_folder",
    "LightChoice": "render.frames.frame_light",
    "RenderResult": "render.frames.frame_export",
    "RoadNetwork": "models.road",
    "RoadSurface": "models.road_surface",
    "Severity": "errors",
    "StageScene": "render.stage.stage_scene",
    "Trajectory": "render.trajectories.trajectory",
    "build": "recipe.environment_build",
    "build_surface": "opendrive.surface",
    "demo_road": "recipe.build_options",
    "known_environments": "environment_files",
    "open_environment": "recipe.built_environment",
    "open_stage": "render.stage.stage_reader",
    "read_city": "citygml.read",
    "read_frames": "render.frames.frame_set",
    "read_network": "opendrive.reader",
    "read_profile": "environment_files",
    "render_frames": "render.frames.frame_export",
    "write_city": "citygml.write",
}
"""Public name to the module that defines it."""

__all__ = [
    "BuildOptions",
    "BuildResult",
    "City",
    "CityObject",
    "EnvgenError",
    "Environment",
    "Frame",
    "FrameSet",
    "Issue",
    "LidarChoice",
    "LightChoice",
    "RenderResult",
    "RoadNetwork",
    "RoadSurface",
    "Severity",
    "StageScene",
    "Trajectory",
    "__version__",
    "build",
    "build_surface",
    "demo_road",
    "known_environments",
    "open_environment",
    "open_stage",
    "read_city",
    "read_frames",
    "read_network",
    "read_profile",
    "render_frames",
    "write_city",
]


def __getattr__(name: str) -> Any:  # noqa: ANN401 - names of any type
    """Imports a public name at its first use."""
    if name == "__version__":
        from importlib.metadata import version  # noqa: PLC0415

        return version("envgen-usd")
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """Public names, for completion in a notebook."""
    return sorted(__all__)
