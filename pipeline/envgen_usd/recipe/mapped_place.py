"""The map of a real place: its streets as a road file."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np

from envgen_usd.errors import EnvgenError, Issue
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.road_surface import RoadSurface
from envgen_usd.models.street_plan import StreetPlan
from envgen_usd.places.osm_streets import read_street_extract
from envgen_usd.places.street_chains import street_plan
from envgen_usd.recipe.build_options import ROAD_FILE, LandOptions
from envgen_usd.step_clock import Clock
from envgen_usd.streets.mapped_roads import mapped_roads
from envgen_usd.terrain.dem_geotiff import read_dem
from envgen_usd.whole_files import write_whole

FILLS = ("all", "missing", "none")
"""What may be generated beside a map."""
_SIDES = 4


@dataclass(frozen=True, eq=False)
class MappedPlace:
    """A map and the road file that it becomes.

    Attributes:
        file: The extract.
        plan: Its streets.
        xodr: OpenDRIVE of its streets.
        issues: What was left out or decided.
        counts: What was read and made, by name.
    """

    file: Path
    plan: StreetPlan
    xodr: bytes
    issues: tuple[Issue, ...]
    counts: Mapping[str, int]

    def write_road(self, folder: Path) -> Path:
        """Writes the road file into a folder and returns its path."""
        path = folder / ROAD_FILE
        write_whole(path, self.xodr)
        return path


def read_mapped_place(options: LandOptions, clock: Clock) -> MappedPlace:
    """Reads the extract of the options and makes roads of its streets; writes no files.

    Raises:
        EnvgenError: The extract, the part of it or its size is unusable.
    """
    path = options.osm
    if path is None:
        raise EnvgenError("--osm: no extract given")
    if options.fill not in FILLS:
        raise EnvgenError(f"--fill {options.fill}: unknown; choose from {', '.join(FILLS)}")
    bounds = _bounds(options.bbox)
    with clock.step("streets"):
        extract = read_street_extract(path, bounds, options.max_area)
        plan = street_plan(extract, path, options.country)
        ground = _ground(options.heightmap, plan) if options.heightmap else None
        roads = mapped_roads(plan, path.name.split(".")[0], ground)
    return MappedPlace(path, plan, roads.xml, roads.issues, roads.counts)


def _bounds(values: tuple[float, ...]) -> tuple[float, float, float, float] | None:
    if not values:
        return None
    shown = ",".join(f"{value:g}" for value in values)
    if len(values) != _SIDES or not all(np.isfinite(values)):
        raise EnvgenError(f"--bbox {shown}: give four numbers of degrees, west,south,east,north")
    west, south, east, north = values
    if not (-180.0 <= west < east <= 180.0 and -90.0 <= south < north <= 90.0):
        raise EnvgenError(
            f"--bbox {shown}: west has to be less than east and south less than north, within 180"
            " and 90 degrees"
        )
    return west, south, east, north


def _ground(path: Path, plan: StreetPlan) -> Callable[[FloatArray], FloatArray]:
    """Heights of the land, with which the streets are made; the model is not shifted."""
    lines = np.concatenate([street.line for street in plan.streets])
    points = np.column_stack([lines, np.zeros(len(lines))])
    # Only the extent and the reference system of the road count for reading the model.
    road = cast(
        RoadSurface, SimpleNamespace(vertices=points, crs=plan.crs, offset=(0.0, 0.0, 0.0))
    )
    return replace(read_dem(path, road), shift=0.0)
