"""A Lanelet2 map that takes the place of the road file."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from envgen_usd.compressed_files import content_stem
from envgen_usd.errors import EnvgenError, Issue
from envgen_usd.places.lanelets.lanelet_reading import read_lanelet_map
from envgen_usd.recipe.build_options import ROAD_FILE, LandOptions
from envgen_usd.step_clock import Clock
from envgen_usd.streets.lanelets.lanelet_roads import lanelet_roads
from envgen_usd.whole_files import write_whole


@dataclass(frozen=True, eq=False)
class LaneletPlace:
    """A Lanelet2 map and the road file that it becomes; all else is as for a road file.

    Attributes:
        file: The map.
        xodr: OpenDRIVE of its lanelets.
        issues: What was left out or decided.
        counts: What was read and made, by name.
    """

    file: Path
    xodr: bytes
    issues: tuple[Issue, ...]
    counts: Mapping[str, int]

    def write_road(self, folder: Path) -> Path:
        """Writes the road file into a folder and returns its path."""
        path = folder / ROAD_FILE
        write_whole(path, self.xodr)
        return path


def read_lanelet_place(options: LandOptions, clock: Clock) -> LaneletPlace:
    """Reads the Lanelet2 map of the options and makes roads of it; writes no files.

    Raises:
        EnvgenError: The map or its size is unusable.
    """
    path = options.lanelet2
    if path is None:
        raise EnvgenError("--lanelet2: no map given")
    with clock.step("lanelets"):
        source = read_lanelet_map(path, options.max_area)
        roads = lanelet_roads(source, content_stem(path))
    return LaneletPlace(path, roads.xml, roads.issues, roads.counts)
