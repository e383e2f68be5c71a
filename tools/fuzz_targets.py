"""What is fuzzed: seeds, and functions that read a file as a command would.

Seeds of each kind lie in `fuzz_seeds`; files of the corpus are added where it is there.
"""

import shutil
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib import resources
from pathlib import Path

import numpy as np
import rasterio
from rasterio.transform import from_origin

from envgen_usd.assets.asset_catalogue import scan_library
from envgen_usd.assets.library_check import check_library
from envgen_usd.chunks import chunks_of_points
from envgen_usd.city.plots.given_buildings import GivenBuildings
from envgen_usd.city.plots.separate_solids import with_parts
from envgen_usd.citygml.city_validation import geometry_issues
from envgen_usd.citygml.feature_references import reference_issues
from envgen_usd.citygml.read import read_city
from envgen_usd.cityjson.cityjson_validation import cityjson_issues
from envgen_usd.cityjson.read import read_cityjson
from envgen_usd.environment_files import environments_folder, read_profile
from envgen_usd.errors import EnvgenError
from envgen_usd.exchange.carla.carla_export import export_carla
from envgen_usd.exchange.environment_export import export_gltf
from envgen_usd.exchange.stage_package import package_environment
from envgen_usd.landuse.given_landuse import read_given_landuse
from envgen_usd.landuse.osm_landuse import rasterise_osm, read_osm
from envgen_usd.layers.flat_stage import flatten_stage
from envgen_usd.opendrive.features.road_features import road_features
from envgen_usd.opendrive.reader import read_network
from envgen_usd.opendrive.surface import build_surface
from envgen_usd.places.osm_place import read_osm_place
from envgen_usd.recipe.build_options import demo_road
from envgen_usd.recipe.dataset_recipe import read_recipe
from envgen_usd.recipe.environment_check import library_environment_faults
from envgen_usd.render.cameras.camera_pose import Pose, look_at
from envgen_usd.render.cameras.sensor_rig import read_rig
from envgen_usd.render.frames.frame_export import render_frames
from envgen_usd.terrain.dem_geotiff import read_dem
from envgen_usd.traffic.open_scenario.scenario_file import ScenarioFile
from envgen_usd.traffic.open_scenario.scenario_play import play
from envgen_usd.traffic.traces.esmini_csv import read_csv_trace
from envgen_usd.traffic.traces.sumo_fcd import read_fcd

_SEEDS = Path(__file__).parent / "fuzz_seeds"
_FOLDERS: list[tempfile.TemporaryDirectory[str]] = []
LARGEST_SEED = 60_000
"""Bytes of a seed of text; larger ones make a round slower."""
_PAYLOAD = "assets/bench/bench/payload/steel.usdc"
_TOP = """#usda 1.0
(
    metersPerUnit = 1
    subLayers = [@./stage.usda@]
    upAxis = "Z"
)
def Xform "Bench" (payload = @./parts/bench.usdc@)
{
    double3 xformOp:translate = (0, 7, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
"""
LONGEST = 20.0
"""Seconds that a scenario plays."""


@dataclass(frozen=True)
class Target:
    """A kind of input.

    Attributes:
        seeds: Files or folders to change.
        read: Reads one as a command would.
    """

    seeds: Sequence[Path]
    read: Callable[[Path], object]


def _seed_folder() -> Path:
    """A folder that is there until the process ends."""
    _FOLDERS.append(tempfile.TemporaryDirectory(prefix="envgen-seed-"))
    return Path(_FOLDERS[-1].name)


def _files(folder: Path, *patterns: str, most: int = LARGEST_SEED) -> list[Path]:
    found = (path for pattern in patterns for path in sorted(folder.rglob(pattern)))
    return [path for path in found if path.is_file() and path.stat().st_size <= most]


def opendrive(shared: Path) -> Target:
    """Road files, up to the surface and its features."""

    def read(path: Path) -> None:
        network = read_network(path)
        build_surface(network)
        road_features(network)

    return Target([demo_road("straight"), *_files(shared / "corpus", "*.xodr")], read)


def _cities(shared: Path, *patterns: str, seed: Path) -> Target:
    def read(path: Path) -> None:
        if path.suffix in {".json", ".jsonl"}:
            cityjson_issues(path)
            city = read_cityjson(path)
        else:
            geometry_issues(path)
            reference_issues(path)
            city = read_city(path)
        GivenBuildings(replace(city, objects=tuple(map(with_parts, city.objects)))).check()

    return Target([seed, *_files(shared / "citymodels", *patterns, most=150_000)], read)


def citygml(shared: Path) -> Target:
    """City models, checked and read as buildings of a map."""
    return _cities(shared, "*.gml", "*.xml", seed=_SEEDS / "house.gml")


def cityjson(shared: Path) -> Target:
    """City models as JSON."""
    return _cities(shared, "*.json", "*.jsonl", seed=_SEEDS / "house.json")


def osm(shared: Path) -> Target:
    """Extracts of OpenStreetMap, as landuse and as places."""

    def read(path: Path) -> None:
        for _ in rasterise_osm(read_osm(path)):
            pass
        read_osm_place(path)

    seeds = _files(shared / "osm", "*.osm", most=200_000)
    return Target([_SEEDS / "town.osm", *seeds], read)


def geotiff(_: Path) -> Target:
    """Rasters of heights and of landuse under the straight road."""
    surface = build_surface(read_network(demo_road("straight")))
    chunks = chunks_of_points(surface.vertices, 100.0)
    folder = _seed_folder()
    seeds = []
    rng = np.random.default_rng(0)
    place = from_origin(-300.0, 300.0, 10.0, 10.0)
    for name, values, more in (
        ("dem_float32.tif", rng.normal(size=(60, 110)).astype(np.float32), {"compress": "deflate"}),
        ("dem_tiled.tif", rng.integers(0, 9, (64, 112)).astype(np.int16), {"tiled": True}),
        ("landuse.tif", rng.integers(0, 6, (60, 110)).astype(np.uint8), {"compress": "lzw"}),
    ):
        sizes = {"blockxsize": 16, "blockysize": 16} if "tiled" in more else {}
        height, width = values.shape
        with rasterio.open(
            folder / name, "w", driver="GTiff", width=width, height=height, count=1,
            dtype=values.dtype, transform=place, **more, **sizes,
        ) as file:  # fmt: skip
            file.write(values, 1)
        seeds.append(folder / name)

    def read(path: Path) -> None:
        if path.name.startswith("dem"):
            read_dem(path, surface)(surface.vertices[:, :2])
        else:
            provider = read_given_landuse(path, surface, chunks)
            provider.generate(surface, chunks, read_profile("1", "residential"), 0)

    return Target(seeds, read)


def toml(_: Path) -> Target:
    """Environments, recipes of data sets and camera rigs."""
    renders = Path(str(resources.files("envgen_usd.renders")))
    environments = sorted(environments_folder().glob("*/*.toml"))
    recipes, rigs = _files(renders / "recipes", "*.toml"), _files(renders / "rigs", "*.toml")
    folder = _seed_folder()
    seeds = []
    for kind, paths in (("area", environments), ("recipe", recipes), ("rig", rigs)):
        for path in paths:
            target = folder / f"{kind}_{path.parent.name}_{path.name}"
            seeds.append(Path(shutil.copy(path, target)))

    def read(path: Path) -> None:
        if path.name.startswith("area"):
            country = path.parent / "country_x"
            country.mkdir()
            shutil.copy(path, country / "area.toml")
            read_profile("x", "area", path.parent)
        elif path.name.startswith("recipe"):
            read_recipe(path)
        else:
            read_rig(str(path))

    return Target(seeds, read)


def traces(shared: Path) -> Target:
    """Floating car data, logs and scenarios."""
    surface = build_surface(read_network(demo_road("straight")))

    def read(path: Path) -> None:
        if path.suffix == ".csv":
            read_csv_trace(path)
        elif path.suffix == ".xosc":
            play(ScenarioFile(path), surface.lanes, surface.roads, LONGEST)
        else:
            read_fcd(path)

    seeds = [
        _SEEDS / "fcd.xml",
        _SEEDS / "log.csv",
        _SEEDS / "list.csv",
        _SEEDS / "drive.xosc",
    ]
    return Target([*seeds, *_files(shared / "corpus", "*.xosc")], read)


def assets(_: Path) -> Target:
    """Small asset libraries, read and checked."""
    library = Path(str(resources.files("envgen_usd.asset_library")))
    folder = _seed_folder() / "library"
    kinds = ("bench", "bollard", "hydrant")
    for kind in kinds:
        shutil.copytree(library / "assets" / kind, folder / "assets" / kind)
    for place in ("materials", "environments"):
        (folder / place).mkdir()
    for path in sorted((library / "materials").glob("*.usda"))[:6]:
        shutil.copy(path, folder / "materials")

    def read(path: Path) -> None:
        catalogue, _ = scan_library(path)
        library_environment_faults(catalogue)
        check_library(catalogue)

    return Target([folder], read)


def _stage_seeds() -> list[Path]:
    """A stage of text, and a folder with one that has a binary layer."""
    folder = _seed_folder() / "stage"
    payload = Path(str(resources.files("envgen_usd.asset_library"))) / _PAYLOAD
    (folder / "parts").mkdir(parents=True)
    shutil.copy(_SEEDS / "stage.usda", folder)
    shutil.copy(payload, folder / "parts" / "bench.usdc")
    (folder / "top.usda").write_text(_TOP)
    return [_SEEDS / "stage.usda", folder]


def _stage_of(path: Path) -> Path:
    """The stage of a changed seed."""
    return path / "top.usda" if path.is_dir() else path


def stages(_: Path) -> Target:
    """Stages that are rendered: a frame of 48 x 32 pixels."""
    rig = _SEEDS / "rig.toml"
    pose = Pose(look_at(np.array([0.0, 0.0, 1.5]), np.array([0.0, 10.0, 1.5])))

    def read(path: Path) -> None:
        outputs = ("rgb", "semantic", "instance", "depth", "boxes")
        render_frames(
            _stage_of(path),
            path.parent / "frames",
            rig=str(rig),
            poses=[pose],
            outputs=outputs,
            cache=False,
        )

    return Target(_stage_seeds(), read)


def exports(_: Path) -> Target:
    """Stages that are exported, packed and flattened."""
    road = demo_road("straight")

    def read(path: Path) -> None:
        stage, out = _stage_of(path), path.parent
        faults = []
        for write in (
            lambda: export_gltf(stage, out / "gltf"),
            lambda: export_gltf(stage, out / "only", metadata_kind="only"),
            lambda: export_carla(stage, out / "carla", road=road),
            lambda: package_environment(stage, out / "package"),
            lambda: flatten_stage(stage, out / "flat.usda", deinstance=True),
        ):
            try:
                write()
            except EnvgenError as error:
                faults.append(error)
        if faults:
            raise faults[0]

    return Target(_stage_seeds(), read)


TARGETS: Mapping[str, Callable[[Path], Target]] = {
    each.__name__: each
    for each in (opendrive, citygml, cityjson, osm, geotiff, toml, traces, assets, stages, exports)
}
"""Target by name; called with the folder of the corpus, which may be missing."""
