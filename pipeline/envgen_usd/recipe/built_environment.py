"""Opens the products of a build: manifest, city model, rasters and stage."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from envgen_usd.build_manifest import Manifest, finished_manifest
from envgen_usd.chunks import CITY_FILE, Chunk
from envgen_usd.models.city_model import City
from envgen_usd.models.ground import HeightMap
from envgen_usd.models.landuse import LanduseMap
from envgen_usd.output_folder import STAGE_FILE


@dataclass(frozen=True, repr=False)
class Environment:
    """A built environment; each product is read at its first use.

    Attributes:
        folder: Folder of the build.
        manifest: Inputs, versions, and the hashes of all products.
        chunks: Tiles of the map, 200 m x 200 m.
    """

    folder: Path
    manifest: Manifest
    chunks: tuple[Chunk, ...]

    def __repr__(self) -> str:
        """Folder, road, environment and number of chunks."""
        chosen = self.manifest.inputs
        source = f"{chosen['road']}, country {chosen['country']}, {chosen['area']}"
        return f"Environment('{self.folder}', {source}, {len(self.chunks)} chunks)"

    @property
    def stage(self) -> Path:
        """File of the composed stage; any USD viewer and `open_stage` open it."""
        return self.folder / STAGE_FILE

    def city(self) -> City:
        """The semantic city of all chunks, in the road frame."""
        from envgen_usd.citygml.read import read_city  # noqa: PLC0415

        return read_city(self.folder / CITY_FILE)

    def heightmaps(self) -> Mapping[Chunk, HeightMap]:
        """Heights of the ground, metres, of each chunk."""
        from envgen_usd.terrain.heightmap_geotiff import read_heightmap  # noqa: PLC0415

        return {chunk: read_heightmap(self._file(chunk, "heightmap.tif")) for chunk in self.chunks}

    def landuse(self) -> Mapping[Chunk, LanduseMap]:
        """Classes and plots of each chunk."""
        from envgen_usd.landuse.landuse_geotiff import read_landuse_map  # noqa: PLC0415

        return {chunk: read_landuse_map(self._file(chunk, "landuse.tif")) for chunk in self.chunks}

    def _file(self, chunk: Chunk, name: str) -> Path:
        return self.folder / "chunks" / chunk.name / name


def open_environment(folder: Path | str) -> Environment:
    """Opens the output folder of a build.

    Raises:
        EnvgenError: The folder holds no finished build.
    """
    folder = Path(folder)
    manifest = finished_manifest(folder)
    names = (name.split("_") for name in sorted(manifest.keys))
    return Environment(folder, manifest, tuple(Chunk(int(x), int(y)) for x, y in names))
