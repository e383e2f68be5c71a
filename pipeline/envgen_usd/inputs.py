"""Checks what a build is given, before anything is made of it."""

from pathlib import Path

from lxml import etree

from envgen_usd.assets.catalogue import Catalogue, read_catalogue
from envgen_usd.config import BuildOptions
from envgen_usd.errors import EnvgenError
from envgen_usd.land import landuse_file, terrain_file
from envgen_usd.layers.distributions import distributions
from envgen_usd.models.profile import Profile
from envgen_usd.output import check_output
from envgen_usd.profiles import read_profile


def read_inputs(options: BuildOptions) -> tuple[Profile, Catalogue]:
    """Reads the environment and the library, and looks whether all else can be had.

    The contents of rasters and of a city model are checked when they are read, right after the
    road, in whose frame they have to lie.

    Raises:
        EnvgenError: Something cannot be used; nothing has been made or written.
    """
    profile = read_profile(options.country, options.area, options.environments_folder())
    check_output(options.out)
    catalogue = read_catalogue(options.library, embed=options.embed_assets)
    check_profile(profile, catalogue)
    for path in (options.road, options.city, landuse_file(options), terrain_file(options)):
        if path is not None:
            _check_file(path)
    if options.city and options.city.suffix.lower() not in (".json", ".jsonl"):
        _check_city_model(options.city)
    return profile, catalogue


def check_profile(profile: Profile, catalogue: Catalogue) -> None:
    """Makes sure that the library has all assets, variants and materials of an environment.

    Raises:
        EnvgenError: It lacks one; the message names the environment's file and the table in it.
    """
    distributions(profile, catalogue)
    buildings, road = profile.buildings, profile.road
    tables = {
        "ground_materials": profile.ground_materials.values(),
        "road": (road.material, road.sidewalk_material),
        "buildings.materials": buildings.materials,
        "buildings.roof_materials": buildings.roof_materials,
        "buildings.flat_roof_materials": buildings.flat_roof_materials,
        "enclosures.materials": profile.enclosures.materials.values(),
    }
    for table, names in tables.items():
        for name in names:
            catalogue.material(name, f"{profile.source}: {table}")


def _check_file(path: Path) -> None:
    try:
        with path.open("rb"):
            pass
    except OSError as error:
        raise EnvgenError(f"{path}: cannot be read: {error.strerror}") from error


def _check_city_model(path: Path) -> None:
    try:
        with path.open("rb") as file:
            _, root = next(etree.iterparse(file, events=("start",)))
    except (etree.XMLSyntaxError, StopIteration) as error:
        raise EnvgenError(f"{path}: is no CityGML: {error}") from error
    if etree.QName(root).localname != "CityModel":
        raise EnvgenError(f"{path}: is no CityGML, but XML with the root element {root.tag}")
