"""Marks of temporary lane layers at road works (1.9.0, 11.2)."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from envgen_usd.models.road import Road
from envgen_usd.models.road_marks import RMS_MARKS, MarkRules
from envgen_usd.opendrive.geometry.section_grids import section_grids
from envgen_usd.opendrive.strips.lane_strips import Strip
from envgen_usd.opendrive.strips.road_mark_strips import mark_strips
from envgen_usd.opendrive.surface_ids import nc_name


def layer_mark_strips(
    road: Road, tolerance: float, rules: MarkRules = RMS_MARKS
) -> Iterator[tuple[float, Strip]]:
    """Yields the marks of all lane layers except the permanent layer, which has the surface.

    Args:
        road: The road.
        tolerance: Chord error, metres.
        rules: Sizes of what the file leaves open.

    Yields:
        s at the start of the mark's section, and a strip over the permanent marks.
    """
    starts = [section.s for section in road.sections]
    for layer in road.layers:
        temporary = replace(road, sections=layer.sections, lane_offset=layer.lane_offset)
        for grid in section_grids([temporary], tolerance):
            place = max(int(np.searchsorted(starts, grid.section.s, side="right")) - 1, 0)
            for strip in mark_strips(grid, rules):
                name = f"{strip.patch.id}_{nc_name(layer.name)}"
                yield (
                    grid.section.s,
                    replace(strip, patch=replace(strip.patch, id=name, section=place)),
                )
