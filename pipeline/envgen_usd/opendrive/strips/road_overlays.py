"""What lies on the lanes of a road: bays, paint and islands of its objects and signals."""

import itertools
from collections.abc import Iterator

from envgen_usd.models.road import Road
from envgen_usd.models.road_marks import RMS_MARKS, MarkRules
from envgen_usd.opendrive.strips.lane_strips import Strip
from envgen_usd.opendrive.strips.object_paint import paint_strips
from envgen_usd.opendrive.strips.parking_bays import bay_strips
from envgen_usd.opendrive.strips.signal_paint import signal_paint_strips
from envgen_usd.opendrive.strips.traffic_islands import island_strips


def overlay_strips(road: Road, rules: MarkRules = RMS_MARKS) -> Iterator[tuple[float, Strip]]:
    """Yields all that objects and signals of a road lay on its lanes, as triangles.

    Args:
        road: The road.
        rules: Sizes of lines of objects where the file leaves them open.

    Yields:
        s of the object or signal, and a triangle; later paint covers earlier paint.
    """
    yield from itertools.chain(
        bay_strips(road), paint_strips(road, rules), signal_paint_strips(road), island_strips(road)
    )
