"""The map that takes the place of the road file: OpenStreetMap or Lanelet2."""

from envgen_usd.errors import EnvgenError
from envgen_usd.recipe.build_options import LandOptions
from envgen_usd.recipe.lanelet_place import LaneletPlace, read_lanelet_place
from envgen_usd.recipe.mapped_place import MappedPlace, read_mapped_place
from envgen_usd.step_clock import Clock

GivenPlace = MappedPlace | LaneletPlace


def read_given_place(options: LandOptions, clock: Clock) -> GivenPlace | None:
    """Reads the map of the options, or returns `None` for a road file.

    Raises:
        EnvgenError: The map is unusable, or an option does not go with it.
    """
    if options.osm is not None and options.lanelet2 is not None:
        raise EnvgenError("--osm and --lanelet2 exclude each other")
    if options.lanelet2 is not None:
        if options.bbox or options.fill != LandOptions.fill:
            raise EnvgenError("--bbox and --fill are for --osm; leave them out with --lanelet2")
        return read_lanelet_place(options, clock)
    return read_mapped_place(options, clock) if options.osm is not None else None
