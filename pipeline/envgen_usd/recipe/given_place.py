"""The map that takes the place of the road file: OpenStreetMap or Lanelet2."""

from envgen_usd.errors import EnvgenError
from envgen_usd.idle_options import refuse_idle
from envgen_usd.recipe.build_options import LandOptions
from envgen_usd.recipe.lanelet_place import LaneletPlace, read_lanelet_place
from envgen_usd.recipe.mapped_place import MappedPlace, read_mapped_place
from envgen_usd.step_clock import Clock

GivenPlace = MappedPlace | LaneletPlace


def check_map_options(options: LandOptions) -> None:
    """Checks that options of maps come with a map that follows them.

    Raises:
        EnvgenError: There are two maps, or an option has no effect.
    """
    if options.osm is not None and options.lanelet2 is not None:
        raise EnvgenError("--osm and --lanelet2 exclude each other")
    if options.osm is None:
        given = {
            "--bbox": options.bbox,
            "--fill": options.fill != LandOptions.fill,
            "--driving-side": options.driving_side != LandOptions.driving_side,
        }
        refuse_idle(given, "without --osm FILE")
    if options.osm is None and options.lanelet2 is None:
        area = {"--max-area": options.max_area != LandOptions.max_area}
        refuse_idle(area, "without --osm FILE or --lanelet2 FILE")


def read_given_place(options: LandOptions, clock: Clock) -> GivenPlace | None:
    """Reads the map of the options, or returns `None` for a road file.

    Raises:
        EnvgenError: The map is unusable.
    """
    if options.lanelet2 is not None:
        return read_lanelet_place(options, clock)
    return read_mapped_place(options, clock) if options.osm is not None else None
