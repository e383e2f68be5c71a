"""Options of a build, and of its land."""

from dataclasses import KW_ONLY, dataclass, fields
from importlib import resources
from pathlib import Path

from envgen_usd.executors.executor import Executor, executor_named

TOLERANCES = (0.001, 1.0)
"""Smallest and largest chord error of a road's surface, metres; vertices lie on a grid of 1 mm."""

ROAD_FILE = "road.xodr"
"""Name of the road file that a build makes of a map, in its output folder."""


@dataclass(frozen=True)
class LandOptions:
    """Options of the land around a road.

    Attributes:
        road: OpenDRIVE file.
        country: Country of the environment, e.g. ``1``.
        area: Area type, e.g. ``residential``.
        seed: Random seed of all draws.
        tolerance: Largest distance between the road's curves and its surface, metres.
        landuse: ``rules``, ``network``, or a GeoTIFF with `LanduseClass` values.
        landuse_network: Weights for ``network``; `None` means the shipped weights.
        heightmap: GeoTIFF with ground heights; `None` means that heights follow from the road.
        terrain_network: Weights of a network of heights; its terrain replaces `heightmap`.
        city: CityGML or CityJSON file; its buildings replace generated buildings.
        city_offset: Metres to the east and to the north by which `city` is moved; a third number
            moves it upwards, and its buildings are not set onto the ground.
        environments: Folder of environments; `None` means those of the library, or else the shipped
            ones.
        library: Folder of the asset library; `None` means the shipped library.
        osm: OpenStreetMap extract that `road` was made from; `None` means that `road` was given.
        bbox: West, south, east and north end of the part of `osm` that is taken, degrees; empty:
            all of it.
        lanelet2: Lanelet2 map that `road` was made from; `None` means that it was not.
        max_area: Largest extent of the streets of `osm` or `lanelet2`, km².
        fill: What is generated beside `osm`: ``all``, ``missing`` or ``none``.
        driving_side: Side on which the traffic of `osm` drives: ``right``, ``left``, or ``auto`` as
            the map and the place say.
    """

    road: Path
    country: str
    area: str
    _: KW_ONLY
    seed: int = 0
    tolerance: float = 0.02
    landuse: str = "rules"
    landuse_network: Path | None = None
    heightmap: Path | None = None
    terrain_network: Path | None = None
    city: Path | None = None
    city_offset: tuple[float, ...] = ()
    environments: Path | None = None
    library: Path | None = None
    osm: Path | None = None
    bbox: tuple[float, ...] = ()
    max_area: float = 25.0
    fill: str = "missing"
    driving_side: str = "auto"
    lanelet2: Path | None = None

    def __post_init__(self) -> None:
        """Accepts paths as strings, too."""
        for field in fields(self):
            value = getattr(self, field.name)
            if field.type in (Path, Path | None) and isinstance(value, str):
                object.__setattr__(self, field.name, Path(value))

    def environments_folder(self) -> Path | None:
        """Folder of the environments; `None` means the shipped environments."""
        in_library = self.library / "environments" if self.library else None
        has_environments = in_library is not None and any(in_library.glob("country_*/*.toml"))
        return self.environments or (in_library if has_environments else None)


@dataclass(frozen=True)
class BuildOptions(LandOptions):
    """Options of a build.

    Attributes:
        out: Output folder of the environment.
        embed_assets: Copy the used assets beside the stage, so that the folder can be moved.
        metadata_only: Write props as poses with metadata and variant selections, without geometry.
        actors: Parked vehicles and standing people, where the environment has some.
        workers: Number of processes, or of jobs of Slurm at a time; 0 uses all processors.
        executor: Who builds the chunks: ``local``, ``ray`` or ``submitit``.
        address: Of the cluster; ``auto`` finds one.
    """

    out: Path
    _: KW_ONLY
    embed_assets: bool = True
    metadata_only: bool = False
    actors: bool = True
    workers: int = 0
    executor: str = "local"
    address: str = "auto"

    def tasks_executor(self) -> Executor:
        """The executor, ready for tasks.

        Raises:
            EnvgenError: There is no such executor, or no cluster answers.
        """
        folder = self.out.absolute() / "chunks" / ".jobs"
        return executor_named(self.executor, self.workers, self.address, folder)


def demo_road(name: str = "town") -> Path:
    """Path of a shipped road: ``town`` or ``straight``."""
    return Path(str(resources.files("envgen_usd.asset_library"))) / "roads" / f"{name}.xodr"
