"""Parts of a map that are laid out by themselves give the land of the map."""

import numpy as np
import pytest
import shapely

from envgen_usd.environment_files import read_profile
from envgen_usd.landuse.land_part import LandPart
from envgen_usd.landuse.landuse_rules import lay_out
from envgen_usd.opendrive.reader import read
from envgen_usd.opendrive.surface import build_surface
from envgen_usd.streets.network_roads import network_xml
from envgen_usd.streets.street_layouts import grid_network

_BEYOND = "".join(
    f'''<road id="beyond_{x}" length="40" junction="-1"><planView>
    <geometry s="0" x="{x}" y="-300" hdg="0" length="40"><line/></geometry></planView>
    <lanes><laneSection s="0"><center><lane id="0"/></center><right><lane id="-1" type="driving">
    <width sOffset="0" a="4" b="0" c="0" d="0"/></lane></right></laneSection></lanes></road>'''
    for x in (0, 200)
)
"""Two roads that end at nothing: streets lie behind three ends, a way behind the fourth."""


@pytest.fixture(scope="module")
def surface(tmp_path_factory):
    path = tmp_path_factory.mktemp("parts") / "grid.xodr"
    grid = network_xml(grid_network((2, 1), 0), "grid").decode()
    path.write_text(grid.replace("</OpenDRIVE>", f"{_BEYOND}</OpenDRIVE>"), encoding="utf-8")
    return build_surface(read(path).network)


def test_the_land_of_two_parts_is_that_of_the_map(surface):
    profile = read_profile("1", "residential")
    whole = lay_out(surface, profile, 5)
    corners = np.concatenate([loop[:, :2] for loop in surface.outline_loops()])
    middle = (corners.min(axis=0) + corners.max(axis=0)) / 2
    reach = float(np.linalg.norm(corners - middle, axis=1).max())
    cut = float(middle[0]) + 20.0  # through a block
    sides = (-1000.0, -1000.0, cut, 1000.0), (cut, -1000.0, 1000.0, 1000.0)
    parts = [
        lay_out(surface, profile, 5, LandPart(side, middle, reach, 1 + 1000 * number))
        for number, side in enumerate(sides)
    ]
    assert min(len(part.plots) for part in parts) > 10
    assert len(whole.ends) == 7
    for name in ("plots", "driveways", "lanes", "ends", "walks", "greens"):
        shapes = np.concatenate([getattr(part, name) for part in parts])
        assert len(shapes) == len(getattr(whole, name))
        together, all_shapes = (
            shapely.union_all(shapely.buffer(each, 0.0)) for each in (shapes, getattr(whole, name))
        )
        assert together.symmetric_difference(all_shapes).area < 1e-3 * all_shapes.area + 0.5
    numbers = np.concatenate([part.numbers for part in parts])
    assert len(set(numbers.tolist())) == len(numbers)
    blocks = [
        shapely.Polygon(loop[:, :2])
        for loop in surface.outline_loops()
        if not shapely.LinearRing(loop[:, :2]).is_ccw
    ]
    crossed = [b for b in blocks if b.bounds[0] < cut < b.bounds[2] and b.area > 1000.0]
    assert crossed
    for block in crossed:  # all of its plots belong to one part
        holders = [
            shapely.contains(block, shapely.point_on_surface(part.plots)).any() for part in parts
        ]
        assert sum(holders) == 1
