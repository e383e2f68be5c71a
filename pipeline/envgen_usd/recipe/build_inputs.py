"""Checks the inputs of a build before the first step."""

from pathlib import Path

from lxml import etree

from envgen_usd.assets.asset_catalogue import Catalogue, read_catalogue
from envgen_usd.compressed_files import content_suffix, open_content
from envgen_usd.environment_files import read_profile
from envgen_usd.errors import EnvgenError, one_line
from envgen_usd.models.environment_profile import Profile
from envgen_usd.output_folder import check_output
from envgen_usd.recipe.build_options import BuildOptions, LandOptions
from envgen_usd.recipe.environment_check import check_environment, check_used_assets
from envgen_usd.recipe.given_place import check_map_options
from envgen_usd.recipe.map_land import landuse_file, terrain_file
from envgen_usd.xml_events import local_name, safe_iterparse


def read_inputs(options: BuildOptions) -> tuple[Profile, Catalogue]:
    """Reads the environment and the library, and checks that all other inputs are readable.

    Rasters and city models are checked later, after the road, because they have to match its frame.

    Raises:
        EnvgenError: Some input cannot be used; nothing has been written.
    """
    profile = read_land_inputs(options)
    check_output(options.out)
    options.tasks_executor()
    catalogue = read_catalogue(options.library, embed=options.embed_assets)
    check_environment(profile, catalogue)
    if options.library is not None:  # The tests of the package check the shipped library.
        check_used_assets(profile, catalogue)
    return profile, catalogue


def read_land_inputs(options: LandOptions) -> Profile:
    """Reads the environment, and checks that the files of the land are readable.

    Raises:
        EnvgenError: Some input cannot be used.
    """
    check_map_options(options)
    profile = read_profile(options.country, options.area, options.environments_folder())
    road = options.osm or options.lanelet2 or options.road
    for path in (road, options.city, landuse_file(options, profile), terrain_file(options)):
        if path is not None:
            _check_file(path)
    if options.city and content_suffix(options.city) not in (".json", ".jsonl"):
        _check_city_model(options.city)
    return profile


def _check_file(path: Path) -> None:
    if path.is_dir():
        raise EnvgenError(f"{path}: is a folder, not a file; name a file in it")
    try:
        with path.open("rb"):
            pass
    except OSError as error:
        raise EnvgenError(f"{path}: cannot be read: {error.strerror}") from error


def _check_city_model(path: Path) -> None:
    try:
        with open_content(path) as file:
            _, root = next(iter(safe_iterparse(file, ("start",))))
    except (etree.XMLSyntaxError, StopIteration) as error:
        raise EnvgenError(f"{path}: not CityGML: {one_line(error)}") from error
    if local_name(root) != "CityModel":
        raise EnvgenError(f"{path}: not CityGML, but XML with the root element {root.tag}")
