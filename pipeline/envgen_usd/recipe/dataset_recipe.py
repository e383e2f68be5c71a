"""Reads and checks the recipe of a data set: what is built, drawn and written."""

import json
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field, replace
from importlib import resources
from pathlib import Path
from typing import Annotated, Any, TypeAlias

from msgspec import Meta

from envgen_usd import __version__
from envgen_usd.build_manifest import hash_bytes, hash_file
from envgen_usd.compressed_files import content_stem
from envgen_usd.datasets.formats.dataset_formats import check_formats
from envgen_usd.environment_files import read_profile
from envgen_usd.errors import EnvgenError
from envgen_usd.light.seasons import check_season
from envgen_usd.light.weather import RANDOM, read_weather
from envgen_usd.recipe.build_options import demo_road
from envgen_usd.render.cameras.camera_response import CAMERA, RESPONSES
from envgen_usd.render.cameras.sensor_rig import read_rig
from envgen_usd.render.frames.frame_folder import OUTPUTS
from envgen_usd.render.frames.scan_export import check_lidar_choice, rig_models
from envgen_usd.render.frames.scan_folder import LidarChoice
from envgen_usd.render.lidar.scan_files import KITTI
from envgen_usd.render.trajectories.trajectory import SPREAD, TRAFFIC, Trajectory
from envgen_usd.toml_files import is_there, read_toml
from envgen_usd.traffic.traces.sumo_run import sumo_home

STAGE_LIGHT = "stage"
"""Weather of a recipe that stands for the light of the stage."""
SHIPPED_ROADS = ("town", "straight")
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]*")
_ROUNDING = 1e-6
"""Largest error of a sum of shares; a larger value accepts sums that are farther from 1."""

Count: TypeAlias = Annotated[int, Meta(ge=1, le=1_000_000)]
Share: TypeAlias = Annotated[float, Meta(ge=0.0, le=1.0)]


@dataclass(frozen=True)
class RoadChoice:
    """A road of a recipe.

    Attributes:
        file: OpenDRIVE file, relative to the recipe, or the name of a shipped road.
        split: Split of all its frames; empty if its streets are shared out.
    """

    file: str
    split: str = ""


@dataclass(frozen=True)
class EnvironmentChoice:
    """An environment of a recipe.

    Attributes:
        country: Country of the environment, e.g. ``1``.
        area: Area type, e.g. ``residential``.
    """

    country: str
    area: str


@dataclass(frozen=True)
class TrafficChoice:
    """Moving actors of each town, from a simulation by SUMO.

    Attributes:
        vehicles: Number of vehicles; `None` follows from the length of the lanes.
        pedestrians: Number of people; `None` follows from the length of the sidewalks.
        seconds: Length of the simulation; later frames show its end.
    """

    vehicles: Annotated[int, Meta(ge=0)] | None = None
    pedestrians: Annotated[int, Meta(ge=0)] | None = None
    seconds: Annotated[float, Meta(ge=0.1, le=1e5)] = 60.0


@dataclass(frozen=True)
class DatasetRecipe:
    """A recipe as its file has it.

    Each road is built in each environment with each seed; each of these scenes is drawn in each
    weather with each rig.

    Attributes:
        road: Roads.
        environment: Environments.
        frames: Number of frames of a scene in a weather with a rig.
        seeds: Seeds of the scenes.
        weathers: Names of shipped weathers, ``random``, ``stage``, or TOML files.
        rigs: Names of shipped rigs, or TOML files.
        splits: Share of the streets of each split, by name; they add up to 1.
        outputs: Kinds of outputs.
        lidar_format: Files of the output ``lidar``: ``kitti``, ``npy`` or ``las``.
        lidar_motion: True if lidars scan from where the vehicle is at each shot.
        formats: Layouts of other data sets that are written, too; the frames do not follow from
            them.
        actors: Parked vehicles and standing people, where the environments have some.
        traffic: Moving actors; `None` for none.
        seed: Seed of what is drawn: places, light, camera, and which street is in which split.
        season: Season of the plants; empty for that of the weather.
        trajectory: ``spread``, ``drive``, ``all-lanes``, or ``traffic`` on towns with traffic.
        spacing: Distance of the frames of a drive, metres.
        response: ``camera`` or ``ideal``.
        range: Distance within which objects are drawn, metres.
    """

    road: tuple[RoadChoice, ...]
    environment: tuple[EnvironmentChoice, ...]
    frames: Count
    seeds: tuple[int, ...] = (0,)
    weathers: tuple[str, ...] = (RANDOM,)
    rigs: tuple[str, ...] = ("kitti_360",)
    splits: Mapping[str, Share] = field(default_factory=lambda: {"train": 1.0})
    outputs: tuple[str, ...] = ("rgb", "semantic", "instance", "depth", "objects")
    lidar_format: str = KITTI
    lidar_motion: bool = False
    formats: tuple[str, ...] = ()
    actors: bool = True
    traffic: TrafficChoice | None = None
    seed: int = 0
    season: str = ""
    trajectory: str = SPREAD
    spacing: Annotated[float, Meta(ge=0.001, le=1e6)] = 10.0
    response: str = CAMERA
    range: Annotated[float, Meta(ge=1.0, le=1e6)] = 1000.0

    @property
    def lidar(self) -> LidarChoice:
        """How lidars are scanned and written."""
        return LidarChoice(self.lidar_format, self.lidar_motion)


def known_recipes() -> tuple[str, ...]:
    """Names of the shipped recipes."""
    folder = resources.files("envgen_usd.renders") / "recipes"
    return tuple(sorted(each.name.removesuffix(".toml") for each in folder.iterdir()))


def recipe_file(name: str) -> Path:
    """File of a recipe: a path, or the name of a shipped recipe.

    Raises:
        EnvgenError: There is no such file, and no shipped recipe of the name.
    """
    if name.endswith(".toml") and is_there(Path(name)):
        return Path(name)
    if name in known_recipes():
        return Path(str(resources.files("envgen_usd.renders") / "recipes" / f"{name}.toml"))
    known = ", ".join(known_recipes())
    raise EnvgenError(f"{name}: no such recipe; give a .toml file, or a shipped one: {known}")


def read_recipe(path: Path) -> DatasetRecipe:
    """Reads a recipe, and checks all that it names before anything is built.

    Paths in the recipe become absolute.

    Raises:
        EnvgenError: A key or a value cannot be used; the message names the file and the key.
    """
    raw = read_toml(path, DatasetRecipe)
    recipe = _with_paths(raw, path.parent)
    _check_lists(recipe, path)
    _check_roads(recipe, path)
    _check_shares(recipe, path)
    for number, each in enumerate(recipe.environment):
        with _named(path, f"environment[{number}]"):
            read_profile(each.country, each.area)
    for number, name in enumerate(recipe.weathers):
        with _named(path, f"weathers[{number}]"):
            if name not in {RANDOM, STAGE_LIGHT}:
                read_weather(name)
    for number, name in enumerate(recipe.rigs):
        with _named(path, f"rigs[{number}]"):
            rig_models(read_rig(name), name, recipe.outputs)
    with _named(path, "lidar_format"):
        check_lidar_choice(recipe.lidar)
    with _named(path, "formats"):
        check_formats(recipe.formats, recipe.outputs, recipe.lidar_format)
    if recipe.traffic is not None:
        with _named(path, "traffic"):
            sumo_home()
            if recipe.traffic.vehicles == 0 and recipe.traffic.pedestrians == 0:
                raise EnvgenError("give at least one vehicle or pedestrian, or leave the table out")
    with _named(path, "trajectory"):
        Trajectory(recipe.trajectory, recipe.spacing).check()
        if recipe.trajectory == TRAFFIC and (
            recipe.traffic is None or recipe.traffic.vehicles == 0
        ):
            raise EnvgenError("traffic needs vehicles that move; add the table [traffic] with some")
    return recipe


def recipe_mark(recipe: DatasetRecipe) -> str:
    """Hash of all that the frames of a recipe follow from: its values and the files it names."""
    content = {f"file {n}": value for n, value in enumerate(recipe_files(recipe).values())}
    return hash_bytes(__version__, json.dumps(recipe_values(recipe) | content, sort_keys=True))


def recipe_files(recipe: DatasetRecipe) -> dict[str, str]:
    """SHA-256 of the files that a recipe names, and of the devices of its rigs, by their names."""
    files = [each.file for each in recipe.road]
    devices = [each.model for name in recipe.rigs for each in read_rig(name).lidar]
    files += [n for n in (*recipe.weathers, *recipe.rigs, *devices) if n.endswith(".toml")]
    hashes: dict[str, str] = {}
    for number, path in enumerate(map(Path, files)):
        name = path.name if path.name not in hashes else f"{path.name} ({number})"
        hashes[name] = hash_file(path)
    return hashes


def recipe_values(recipe: DatasetRecipe) -> dict[str, Any]:
    """The values of a recipe, with the names of files in place of their paths."""
    values = asdict(recipe)
    del values["formats"]
    if recipe.traffic is None:
        del values["traffic"]
    for road in values["road"]:
        road["file"] = Path(road["file"]).name
    for key in ("weathers", "rigs"):
        values[key] = [Path(name).stem for name in values[key]]
    return values


@contextmanager
def _named(path: Path, key: str) -> Iterator[None]:
    """Names file and key in errors of what a recipe names."""
    try:
        yield
    except EnvgenError as error:
        text = str(error).removeprefix("render: ")
        raise EnvgenError(f"{path}: {key}: {text}") from error


def _with_paths(recipe: DatasetRecipe, folder: Path) -> DatasetRecipe:
    """Files relative to the recipe become absolute; names of what is shipped stay."""

    def found(name: str) -> str:
        return str((folder / name).absolute()) if name.endswith(".toml") else name

    roads = [replace(each, file=str(_road_file(each.file, folder))) for each in recipe.road]
    return replace(
        recipe,
        road=tuple(roads),
        weathers=tuple(map(found, recipe.weathers)),
        rigs=tuple(map(found, recipe.rigs)),
    )


def _road_file(name: str, folder: Path) -> Path:
    return demo_road(name) if name in SHIPPED_ROADS else (folder / name).absolute()


def _check_lists(recipe: DatasetRecipe, path: Path) -> None:
    for key in ("road", "environment", "seeds", "weathers", "rigs", "outputs"):
        values = getattr(recipe, key)
        if not values:
            raise EnvgenError(f"{path}: {key}: expected at least one")
        twice = next((each for n, each in enumerate(values) if each in values[:n]), None)
        if twice is not None:
            raise EnvgenError(f"{path}: {key}: {_shown(twice)} stands twice")
    for key in ("weathers", "rigs"):
        stems = [Path(name).stem for name in getattr(recipe, key)]
        if len({stem.casefold() for stem in stems}) < len(stems):
            raise EnvgenError(f"{path}: {key}: two files have one name; rename one of them")
    unknown = sorted(set(recipe.outputs) - set(OUTPUTS))
    if unknown:
        raise EnvgenError(
            f"{path}: outputs: unknown {', '.join(unknown)}; known: {', '.join(OUTPUTS)}"
        )
    if recipe.response not in RESPONSES:
        known = ", ".join(RESPONSES)
        raise EnvgenError(f"{path}: response: unknown {recipe.response}; known: {known}")
    with _named(path, "season"):
        if recipe.season != RANDOM:
            check_season(recipe.season)


def _shown(value: object) -> str:
    if isinstance(value, RoadChoice | EnvironmentChoice):
        return ", ".join(filter(None, asdict(value).values()))
    return str(value)


def _check_roads(recipe: DatasetRecipe, path: Path) -> None:
    """Checks that the roads exist, differ, and have names that folders can have."""
    known: dict[str, int] = {}
    stems: dict[str, int] = {}
    for number, each in enumerate(recipe.road):
        key, file = f"{path}: road[{number}]", Path(each.file)
        if not is_there(file):
            shipped = ", ".join(SHIPPED_ROADS)
            raise EnvgenError(f"{key}: file: no road {file}; shipped roads: {shipped}")
        if each.split and each.split not in recipe.splits:
            splits = ", ".join(recipe.splits)
            raise EnvgenError(f"{key}: split: unknown {each.split}; splits: {splits}; add it there")
        earlier = known.setdefault(hash_file(file), number)
        if earlier != number:
            fault = f"is the road of road[{earlier}]; its streets would be in two splits"
            raise EnvgenError(f"{key}: file: {file.name} {fault}")
        if not _NAME.fullmatch(content_stem(file)):
            raise EnvgenError(f"{key}: file: {file.name}: expected letters, digits, - and _")
        if stems.setdefault(content_stem(file).casefold(), number) != number:
            fault = f"another road is called {content_stem(file)}; rename the file"
            raise EnvgenError(f"{key}: file: {fault}")


def _check_shares(recipe: DatasetRecipe, path: Path) -> None:
    for name in recipe.splits:
        if not _NAME.fullmatch(name):
            raise EnvgenError(f"{path}: splits: {name!r}: expected letters, digits, - and _")
    total = sum(recipe.splits.values())
    if abs(total - 1.0) > _ROUNDING:
        fault = "overlap" if total > 1.0 else "leave streets out"
        raise EnvgenError(f"{path}: splits: shares add up to {total:g}, so they {fault}; make it 1")
