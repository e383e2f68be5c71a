"""Checks the inputs of a build before the first step."""

from pathlib import Path

from lxml import etree

from envgen_usd.assets.asset_catalogue import Catalogue, read_catalogue
from envgen_usd.environment_files import read_profile
from envgen_usd.errors import EnvgenError
from envgen_usd.layers.prop_distributions import distributions
from envgen_usd.models.environment_profile import Profile
from envgen_usd.output_folder import check_output
from envgen_usd.recipe.build_options import BuildOptions, LandOptions
from envgen_usd.recipe.map_land import landuse_file, terrain_file
from envgen_usd.xml_events import safe_iterparse


def read_inputs(options: BuildOptions) -> tuple[Profile, Catalogue]:
    """Reads the environment and the library, and checks that all other inputs are readable.

    Rasters and city models are checked later, after the road, because they have to match its frame.

    Raises:
        EnvgenError: Some input cannot be used; nothing has been written.
    """
    profile = read_land_inputs(options)
    check_output(options.out)
    catalogue = read_catalogue(options.library, embed=options.embed_assets)
    check_profile(profile, catalogue)
    return profile, catalogue


def read_land_inputs(options: LandOptions) -> Profile:
    """Reads the environment, and checks that the files of the land are readable.

    Raises:
        EnvgenError: Some input cannot be used.
    """
    profile = read_profile(options.country, options.area, options.environments_folder())
    for path in (options.road, options.city, landuse_file(options), terrain_file(options)):
        if path is not None:
            _check_file(path)
    if options.city and options.city.suffix.lower() not in (".json", ".jsonl"):
        _check_city_model(options.city)
    return profile


def check_profile(profile: Profile, catalogue: Catalogue) -> None:
    """Checks that the library has all assets, variants and materials of an environment.

    Raises:
        EnvgenError: An asset, variant or material is missing; the message names the environment's
            file and table.
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
            _, root = next(iter(safe_iterparse(file, ("start",))))
    except (etree.XMLSyntaxError, StopIteration) as error:
        raise EnvgenError(f"{path}: not CityGML: {error}") from error
    if etree.QName(root).localname != "CityModel":
        raise EnvgenError(f"{path}: not CityGML, but XML with the root element {root.tag}")
