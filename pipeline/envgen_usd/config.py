"""What the user asks of a build."""

from dataclasses import dataclass
from importlib import resources
from pathlib import Path

TOLERANCES = (0.001, 1.0)
"""Least and greatest chord error of a road's surface, metres; vertices lie on whole millimetres."""


@dataclass(frozen=True)
class BuildOptions:
    """One build.

    Attributes:
        road: OpenDRIVE file.
        country: Country of the environment, e.g. ``1``.
        area: Area type, e.g. ``residential``.
        out: Folder of the environment that is made.
        seed: Every random draw follows from it.
        tolerance: Largest distance between the road's curves and its surface, metres.
        landuse: ``rules``, ``network``, or a GeoTIFF with `LanduseClass` values.
        landuse_network: Weights for ``network``, or none: those that come with the package.
        heightmap: GeoTIFF with ground heights, or none: heights follow from the road.
        terrain_network: Weights of a network of heights whose land stands in place of a GeoTIFF, or
            none.
        city: CityGML or CityJSON whose buildings stand in place of generated ones, or none.
        environments: Folder of environments, or none: those of the library, if it has any, or else
            those of the package.
        library: Folder of the asset library, or none: that of the package.
        embed_assets: Copy the assets that are used beside the stage, so that it can be moved.
        metadata_only: Props are poses with metadata and variant selections, without geometry.
        workers: Processes; 0 for as many as there are processors.
    """

    road: Path
    country: str
    area: str
    out: Path
    seed: int = 0
    tolerance: float = 0.02
    landuse: str = "rules"
    landuse_network: Path | None = None
    heightmap: Path | None = None
    terrain_network: Path | None = None
    city: Path | None = None
    environments: Path | None = None
    library: Path | None = None
    embed_assets: bool = True
    metadata_only: bool = False
    workers: int = 0

    def environments_folder(self) -> Path | None:
        """Folder of the environments that are meant; none for those of the package."""
        own = self.library / "environments" if self.library else None
        found = own is not None and any(own.glob("country_*/*.toml"))
        return self.environments or (own if found else None)


def demo_road(name: str = "town") -> Path:
    """Path of a road that comes with the package: ``town`` or ``straight``."""
    return Path(str(resources.files("envgen_usd.asset_library"))) / "roads" / f"{name}.xodr"
