"""Reference lines of roads with their outermost borders."""

from collections.abc import Sequence

import numpy as np

from envgen_usd.models.road import Road
from envgen_usd.models.road_surface import RoadLine
from envgen_usd.opendrive.geometry.curve_evaluation import evaluate
from envgen_usd.opendrive.geometry.section_grids import SectionGrid


def road_lines(grids: Sequence[SectionGrid]) -> tuple[RoadLine, ...]:
    """Returns a line per road, at the rows of its sections."""
    by_road: dict[str, list[SectionGrid]] = {}
    for grid in grids:
        by_road.setdefault(grid.road.id, []).append(grid)
    return tuple(_line(parts[0].road, parts) for parts in by_road.values())


def _line(road: Road, grids: Sequence[SectionGrid]) -> RoadLine:
    s = np.concatenate([grid.borders.s for grid in grids])
    x, y, heading = evaluate(road.plan_view, s)
    town = next((entry.type for entry in road.types if entry.type), "")
    speeds = [entry.speed for entry in road.types if 0 < entry.speed < np.inf]
    return RoadLine(
        road=road.id,
        junction=road.junction,
        s=s,
        points=np.column_stack([x, y, road.elevation(s)]),
        heading=heading,
        t_left=np.concatenate([grid.borders.t[:, 0] for grid in grids]),
        t_right=np.concatenate([grid.borders.t[:, -1] for grid in grids]),
        town=town,
        speed=speeds[0] if speeds else 0.0,
    )
