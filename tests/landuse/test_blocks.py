"""Blocks are filled: judged on a square block whose size is known, and on a real map."""

from dataclasses import replace
from typing import get_args

import numpy as np
import pytest
import shapely
from scipy import ndimage

from envgen_usd.chunks import CELL_SIZE, Chunk, chunks_of_points
from envgen_usd.environment_files import read_profile
from envgen_usd.landuse.blocks.empty_blocks import find_empty_blocks
from envgen_usd.landuse.blocks.inner_lanes import connected_lanes, rows_of
from envgen_usd.landuse.blocks.laid_plot import drawn_use
from envgen_usd.landuse.blocks.land_areas import opened
from envgen_usd.landuse.land_part import LandPart
from envgen_usd.landuse.landuse_rules import RuleProvider, lay_out
from envgen_usd.landuse.outer_land import land_beside
from envgen_usd.landuse.plot_polygons import find_plots
from envgen_usd.landuse.plot_rectangles import holds_rectangle, least_rectangle
from envgen_usd.landuse.road_stubs import road_ends, way_on
from envgen_usd.landuse.roadside import find_roadsides
from envgen_usd.models.land_rules import BlockRules, Use
from envgen_usd.models.landuse import OPEN_USES, LanduseClass, LanduseMap
from envgen_usd.opendrive.reader import read_network
from envgen_usd.opendrive.surface import build_surface
from envgen_usd.seeds import Draws

_TOWNS = {"carla_test/Town01": 0.95, "carla_test/Town03": 0.9}
"""Least share of the blocks' land in plots."""


def maps_of(surface, profile) -> dict[Chunk, LanduseMap]:
    chunks = chunks_of_points(surface.vertices, 60.0)
    return RuleProvider().generate(surface, chunks, profile, 3)


def plots_of(surface, profile) -> list[shapely.Polygon]:
    plots = find_plots(maps_of(surface, profile), surface)
    return [shapely.Polygon(plot.polygon) for plot in plots]


def holds_house(plot, rules) -> bool:
    """True if a plot holds the least one with a house, but for a cell, along its front."""
    width, depth = least_rectangle(rules)
    size = (width - CELL_SIZE, depth - CELL_SIZE)
    return holds_rectangle(plot.polygon, plot.frontage[1] - plot.frontage[0], size)


def square(side: float) -> tuple[dict, float]:
    """Roads of 10 m around a block, and the area of the block."""
    corners = np.array([[0.0, 0.0], [side, 0.0], [side, side], [0.0, side], [0.0, 0.0]])
    roads = {str(n): np.linspace(corners[n], corners[n + 1], 12) for n in range(4)}
    return roads, (side - 10.0) ** 2


def blocks_of(surface) -> list[shapely.Polygon]:
    """Land that roads enclose; islands are smaller than a house with its garden."""
    rings = [shapely.Polygon(loop[:, :2]) for loop in surface.outline_loops()]
    return [ring for ring in rings if not ring.exterior.is_ccw and ring.area > 1500.0]


def islands_of(surface) -> np.ndarray:
    """A point on each piece of land that roads enclose, up to the largest roundabout of Town03."""
    rings = [shapely.Polygon(loop[:, :2]) for loop in surface.outline_loops()]
    small = [ring for ring in rings if not ring.exterior.is_ccw and ring.area < 750.0]
    return np.array([ring.representative_point() for ring in small], object)


@pytest.mark.parametrize("name", list(_TOWNS))
def test_blocks_of_real_towns_are_full(corpus, name):
    surface = build_surface(read_network(corpus / f"{name}.xodr"))
    profile = read_profile("1", "residential")
    found = find_plots(maps_of(surface, profile), surface)
    houses = [plot for plot in found if plot.landuse is profile.plots.landuse]
    assert np.mean([holds_house(plot, profile.plots) for plot in houses]) >= 0.98
    plots = [shapely.Polygon(plot.polygon) for plot in found]
    # The raster of plots is 0.8 m wide, so neighbours may lie a cell apart.
    built = shapely.union_all(shapely.buffer(plots, 0.4), grid_size=0.001)
    blocks = shapely.buffer(blocks_of(surface), -profile.plots.verge[0])
    inside = shapely.area(shapely.intersection(blocks, built, grid_size=0.001))
    assert inside.sum() >= _TOWNS[name] * shapely.area(blocks).sum()
    # All roads are at least as wide as a lane: the middle of no road has a plot.
    borders = [(line.left_border(), line.right_border()) for line in surface.roads]
    middles = shapely.points(np.concatenate([(left + right) / 2.0 for left, right in borders]))
    tree = shapely.STRtree(plots)
    assert not tree.query(middles, "intersects").size
    # Nobody lives on an island of a roundabout or between lanes.
    assert not tree.query(islands_of(surface), "intersects").size


def test_without_infill_gaps_stay_open(make_roads, lines):
    profile = replace(read_profile("1", "residential"), blocks=BlockRules())
    surface = make_roads(lines["x"])
    areas = []
    for share in (0.0, 0.5, 1.0):
        rules = replace(profile, plots=replace(profile.plots, infill=share))
        areas.append(sum(plot.area for plot in plots_of(surface, rules)))
    assert areas[0] < 0.97 * areas[1]
    assert areas[1] < areas[2]


@pytest.mark.parametrize(("country", "area"), [("1", "residential"), ("2", "residential")])
@pytest.mark.parametrize("side", [90.0, 160.0, 260.0])
def test_a_block_is_full_to_its_middle(make_roads, side, country, area):
    """Whether one row, two rows, or lanes with rows between them have room."""
    roads, land = square(side)
    surface = make_roads(roads)
    block = shapely.box(5.0, 5.0, side - 5.0, side - 5.0)
    plots = plots_of(surface, read_profile(country, area))
    assert shapely.union_all(plots).intersection(block).area > 0.85 * land
    # No plot lies on another.
    pairs = shapely.STRtree(plots).query(plots, "intersects").T
    shared = [plots[a].intersection(plots[b]).area for a, b in pairs.tolist() if a < b]
    assert max(shared) < 1e-3


def test_plots_inside_of_a_block_are_reached_by_lanes(make_roads):
    """A plot behind the first row touches paving, and all paving leads to the road."""
    roads, _ = square(260.0)
    profile = read_profile("1", "residential")
    inner = replace(profile, blocks=replace(profile.blocks, inner=1.0))
    maps = maps_of(make_roads(roads), inner)
    chunks = [[maps[Chunk(x, y)] for x in (-1, 0, 1)] for y in (-1, 0, 1)]
    classes, plots = (np.block([[getattr(m, n) for m in row] for row in chunks]) for n in _LAYERS)
    paved = (classes == LanduseClass.ACCESS) | (classes == LanduseClass.ROAD)
    parts, _ = ndimage.label(paved, np.ones((3, 3)))
    road = np.unique(parts[classes == LanduseClass.ROAD])
    y, x = (np.indices(classes.shape) + 0.5) * CELL_SIZE - 200.0
    core = (np.maximum(np.abs(x - 130.0), np.abs(y - 130.0)) < 70.0) & (plots > 0)
    inside = np.unique(plots[core])
    assert len(inside) > 10
    wide = ndimage.binary_dilation(np.isin(parts, road), np.ones((3, 3)))
    for plot in inside:
        assert wide[plots == plot].any()


_LAYERS = ("classes", "plots")


def test_density_falls_off_towards_the_outermost_street(make_roads):
    """Two maps of the same roads: with falloff, the far ends have the fewer houses."""
    lines = {str(n): np.linspace([0.0, 150.0 * n], [900.0, 150.0 * n], 40) for n in range(7)}
    lines |= {f"a{n}": np.linspace([450.0 * n, 0.0], [450.0 * n, 900.0], 40) for n in range(3)}
    surface = make_roads(lines)
    profile = read_profile("1", "residential")
    # Each gap is built on without falloff; the ends of roads are the same with and without it.
    plots, blocks = replace(profile.plots, infill=1.0), replace(profile.blocks, ends=0.0)
    profile = replace(profile, plots=plots, blocks=blocks)
    shares = []
    for falloff in (0.0, 1.0):
        rules = replace(profile, blocks=replace(profile.blocks, falloff=falloff))
        layouts = [lay_out(surface, rules, seed) for seed in (0, 1, 2)]
        middles = np.concatenate(
            [shapely.get_coordinates(shapely.centroid(layout.plots)) for layout in layouts]
        )
        is_open = np.isin(np.concatenate([one.landuse for one in layouts]), list(OPEN_USES))
        far = np.linalg.norm(middles - 450.0, axis=1) > 400.0
        shares.append((is_open[far].mean(), is_open[~far].mean()))
    (far_even, near_even), (far_less, near_less) = shares
    assert far_less > far_even
    assert far_less - far_even > near_less - near_even


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_no_view_from_the_road_ends_in_a_plane(make_roads, lines, seed):
    """Every ray from the road meets a plot or trees before the land ends."""
    surface, profile = make_roads(lines["x"]), read_profile("1", "residential")
    chunks = chunks_of_points(surface.vertices, land_beside(profile))
    maps = RuleProvider().generate(surface, chunks, profile, seed)
    known = {chunk: np.isin(m.classes, _SOLID) | (m.plots > 0) for chunk, m in maps.items()}
    for eye in ([100.0, 100.0], [-150.0, 100.0], [100.0, 350.0], [385.0, 100.0]):
        for angle in np.linspace(0.0, 2.0 * np.pi, 90, endpoint=False):
            ray = eye + np.arange(0.0, 700.0, 0.5)[:, None] * [np.cos(angle), np.sin(angle)]
            assert any(_hits(known, point) for point in ray)


_SOLID = (LanduseClass.WOOD,)


def _hits(known: dict[Chunk, np.ndarray], point: np.ndarray) -> bool:
    chunk = Chunk(*np.floor(point / 200.0).astype(int).tolist())
    column, row = ((point - chunk.origin) / CELL_SIZE).astype(int).clip(0, 254).tolist()
    return chunk in known and bool(known[chunk][row, column])


def test_fields_lie_beside_hedges_and_chunks_agree(make_roads, lines):
    surface, profile = make_roads(lines["straight"]), read_profile("1", "residential")
    chunks = [Chunk(x, y) for x in (0, 1) for y in (-1, 0, 1)]
    together = RuleProvider().generate(surface, chunks, profile, 0)
    fields = sum((m.classes == LanduseClass.FIELD).sum() for m in together.values())
    assert fields * CELL_SIZE**2 > 2000.0
    for chunk in chunks:
        alone = RuleProvider().generate(surface, [chunk], profile, 0)[chunk]
        assert np.array_equal(alone.classes, together[chunk].classes)


@pytest.mark.parametrize(
    ("side", "town", "reason"),
    [(32.0 + 10.0, "town", "narrower"), (120.0, "motorway", "no street")],
)
def test_an_empty_block_says_why(make_roads, side, town, reason):
    roads, _ = square(side)
    if reason == "narrower":
        roads = {n: line * [4.0, 0.5] for n, line in roads.items()}
    surface = make_roads(roads, town=town)
    rules = read_profile("1", "residential").plots
    issues = find_empty_blocks(surface, find_roadsides(surface, rules, 0), (), rules)
    assert [issue.kind for issue in issues] == ["landuse.empty_block"]
    assert reason in issues[0].message


def test_a_steep_block_holds_no_inner_plots_and_says_so(make_roads):
    roads, _ = square(200.0)
    level = make_roads(roads)
    steep = replace(level, vertices=level.vertices + level.vertices[:, :1] * [0.0, 0.0, 0.4])
    profile = read_profile("1", "residential")
    assert len(plots_of(steep, profile)) < len(plots_of(level, profile))
    rules = profile.plots
    issues = find_empty_blocks(steep, find_roadsides(steep, rules, 0), (), rules)
    assert "rise by more than 25%" in issues[0].message


def test_lanes_reach_land_in_steps():
    """No straight link crosses all lanes of three fields in steps, but all get a lane."""
    corners = ((0.0, 0.0), (60.0, 63.0), (120.0, 126.0))
    fields = [shapely.box(x, y, x + 100.0, y + 63.0) for x, y in corners]
    land = shapely.union_all(fields)
    rules = read_profile("1", "residential").plots
    entry = np.array([[40.0, 0.0], [0.0, 1.0]])
    way = shapely.box(38.0, -30.0, 42.0, 1.0)
    _, lanes = rows_of(land, entry[0], rules)
    network = connected_lanes(land, lanes, entry, way)
    assert network.geom_type == "Polygon"
    assert network.intersects(way)
    for field in fields:
        assert network.intersection(field).area > 4.0 * 90.0


def test_uses_suit_the_size_and_the_place_of_their_plot():
    weights = dict.fromkeys(get_args(Use), 1.0)

    def drawn(area, *, at_street):
        numbers = (Draws(number, "uses") for number in range(200))
        return {drawn_use(weights, area, "use", d, at_street=at_street) for d in numbers}

    small = {LanduseClass.PARK, LanduseClass.PARKING, LanduseClass.ALLOTMENT}
    assert drawn(200.0, at_street=True) == small
    assert drawn(1200.0, at_street=True) == {LanduseClass[use.upper()] for use in weights}
    assert LanduseClass.SHOP not in drawn(1200.0, at_street=False)
    assert LanduseClass.GARAGES not in drawn(5000.0, at_street=True)


def test_ways_go_on_where_roads_end_at_nothing(make_roads):
    """Of two roads in line, the outer ends alone have a way, as wide as 5 m and 40 m long."""
    ends = {"west": [[0.0, 0.0], [100.0, 0.0]], "east": [[100.0, 0.0], [200.0, 0.0]]}
    surface = make_roads({name: np.linspace(*line, 12) for name, line in ends.items()})
    ways = shapely.polygons([way_on(end) for end in road_ends(surface)])
    assert len(ways) == 2
    assert shapely.area(ways) == pytest.approx(5.0 * 40.8)
    assert {round(x) for x in shapely.get_x(shapely.centroid(ways))} == {-20, 220}
    profile = read_profile("1", "residential")
    profile = replace(profile, blocks=replace(profile.blocks, ends=0.0))
    chunks = [Chunk(x, y) for x in (-1, 0, 1) for y in (-1, 0)]
    maps = RuleProvider().generate(surface, chunks, profile, 0)
    cells = sum(np.count_nonzero(m.classes == LanduseClass.ROAD_END) for m in maps.values())
    # The 0.8 m on the road are road; cells are 0.8 m wide.
    assert cells * CELL_SIZE**2 == pytest.approx(2 * 5.0 * 40.0, rel=0.1)


def test_no_way_goes_on_where_a_road_narrows_to_nothing(tmp_path):
    """Regions tell by a way's first side which of them it belongs to."""
    lane = '<lane id="1" type="driving"><width sOffset="0" a="4" b="-0.04" c="0" d="0"/></lane>'
    (tmp_path / "narrows.xodr").write_text(
        '<OpenDRIVE><header revMajor="1" revMinor="7"/><road id="1" length="100" junction="-1">'
        '<planView><geometry s="0" x="0" y="0" hdg="0" length="100"><line/></geometry></planView>'
        f'<lanes><laneSection s="0"><left>{lane}</left><center><lane id="0" type="none"/></center>'
        "</laneSection></lanes></road></OpenDRIVE>"
    )
    surface = build_surface(read_network(tmp_path / "narrows.xodr"))
    ways = shapely.polygons([way_on(end) for end in road_ends(surface)])
    assert [round(x) for x in shapely.get_x(shapely.centroid(ways))] == [-20]
    profile = read_profile("1", "residential")
    profile = replace(profile, blocks=replace(profile.blocks, ends=0.0))
    part = LandPart((-200.0, -200.0, 200.0, 200.0), np.array([50.0, 0.0]), 60.0, 1)
    assert len(lay_out(surface, profile, 0, part).ends) == 1


def test_a_ring_that_meets_itself_is_opened_like_others():
    # Joined plots have such rings after a mitre.
    ring = [(10.25, 11.748), (10.25, 12.625), (9.038, 13.664), (9.175, 13.75), (11.12, 13.75)]
    ring += [(11.12, 14.713), (11.12, 19.921), (39.284, 19.921), (39.284, 11.748), (11.12, 11.748)]
    ring += [(10.25, 11.748), (11.12, 14.713), (11.12, 14.875), (10.817, 14.875), (11.12, 14.713)]
    whole = shapely.Polygon(ring)
    assert not whole.is_valid
    left = opened(whole, 1.6)
    assert left.is_valid
    box = shapely.box(11.12, 11.748, 39.284, 19.921)
    # The box is wide; what is beside it is narrower than 1.6 m but for a corner.
    assert left.area == pytest.approx(box.area, abs=3.0)
    assert shapely.area(shapely.difference(box, left)) < 0.1
