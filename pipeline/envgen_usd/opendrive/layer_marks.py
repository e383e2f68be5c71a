"""Marks of temporary lane layers, as in road works (1.9.0, 11.2)."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from envgen_usd.models.road import Road
from envgen_usd.opendrive.marks import mark_strips
from envgen_usd.opendrive.names import nc_name
from envgen_usd.opendrive.strips import Strip, section_grids


def layer_mark_strips(road: Road, tolerance: float) -> Iterator[tuple[float, Strip]]:
    """Marks of all lane layers but the permanent one, which alone has a surface.

    Yields:
        The place s at which the mark's section begins, and a strip over the permanent marks.
    """
    starts = [section.s for section in road.sections]
    for layer in road.layers:
        own = replace(road, sections=layer.sections, lane_offset=layer.lane_offset)
        for grid in section_grids(own, tolerance):
            place = max(int(np.searchsorted(starts, grid.section.s, side="right")) - 1, 0)
            for strip in mark_strips(grid):
                name = f"{strip.patch.id}_{nc_name(layer.name)}"
                yield (
                    grid.section.s,
                    replace(strip, patch=replace(strip.patch, id=name, section=place)),
                )
