"""Roads for traffic on the left, read back."""

import numpy as np
import pytest
import rasterio
import shapely
from lxml import etree
from tests.places.places_extracts import LAT, LON, Extract, crossing
from tests.streets.lane_gaps import lane_gaps

from envgen_usd.environment_files import read_profile
from envgen_usd.recipe.build_options import LandOptions
from envgen_usd.recipe.map_land import read_road
from envgen_usd.recipe.mapped_place import read_mapped_place
from envgen_usd.step_clock import Clock

STREET = {"highway": "residential", "sidewalk": "both"}


def left_roads(extract, tmp_path, **values):
    """The map, its road file as XML, its reading and its surface."""
    osm = extract.write(tmp_path / "place.osm")
    values |= {"osm": osm, "driving_side": "left"}
    options = LandOptions(tmp_path / "road.xodr", "1", "residential", **values)
    place = read_mapped_place(options, Clock(lambda *_: None))
    file = place.write_road(tmp_path)
    reading, surface = read_road(file, 0.02, read_profile("1", "residential").road)
    return place, etree.fromstring(place.xodr), reading, surface


def test_traffic_keeps_left_of_the_map_s_line_and_lanes_meet(tmp_path):
    extract = crossing(lanes="4", cycleway="lane", parking__left="lane")
    place, root, reading, surface = left_roads(extract, tmp_path)
    assert not reading.network.issues
    assert {road.get("rule") for road in root.findall("road")} == {"LHT"}
    assert max(lane_gaps(surface)) < 0.01
    lines = shapely.multilinestrings([street.line for street in place.plan.streets])
    driven = [x for x in surface.lanes if x.lane_type == "driving" and not x.junction]
    assert len(driven) == 16
    alone = [x for x in driven if abs(x.lane) == 1]
    for lane in alone:
        middle, after = lane.points[len(lane.points) // 2 - 1 : len(lane.points) // 2 + 1, :2]
        ahead = (after - middle) / np.linalg.norm(after - middle)
        left = np.array([-ahead[1], ahead[0]])
        nearer = [shapely.distance(lines, shapely.Point(middle + k * left)) for k in (-1.0, 0.0)]
        assert nearer[0] < nearer[1]
    kinds = [issue.kind for issue in place.issues]
    assert "osm.driving_side" in kinds


def test_places_stay_where_the_map_has_them(tmp_path):
    """Only sides are swapped, never places."""
    extract = Extract()
    extract.way((-150.0, 0.0), (0.0, 0.0), (80.0, 60.0), **STREET)
    extract.way((0.0, 0.0), (0.0, -90.0), **STREET)
    extract.node(-60.0, 30.0, natural="tree")
    place, _, _, surface = left_roads(extract, tmp_path)
    road = shapely.union_all(shapely.polygons(surface.vertices[surface.triangles][:, :, :2]))
    for street in place.plan.streets:
        assert road.buffer(0.5).contains(shapely.LineString(street.line))
    (tree,) = place.land
    west = min(street.line[:, 0].min() for street in place.plan.streets)
    # The tree stands 90 m east of the western end, and 30 m north of its street.
    assert tree.place[0] - west == pytest.approx(90.0, abs=0.5)


def test_a_roundabout_leads_clockwise(tmp_path):
    extract = Extract()
    angles = -np.linspace(0.0, 2 * np.pi, 17)[:-1]
    ring = [(round(15 * np.cos(a), 3), round(15 * np.sin(a), 3)) for a in angles]
    extract.way(*ring, ring[0], highway="residential", junction="roundabout")
    for n in (0, 4, 8, 12):
        extract.way(ring[n], (ring[n][0] * 6, ring[n][1] * 6), **STREET)
    _, root, reading, surface = left_roads(extract, tmp_path)
    assert not reading.network.issues
    assert len(root.findall("junction")) == 1
    checked = 0
    for lane in surface.lanes:
        if lane.junction and lane.lane_type == "driving":
            x, y = lane.points[:, :2].T
            turn = (x[:-1] * np.diff(y) - y[:-1] * np.diff(x))[np.hypot(x, y)[:-1] < 16.0]
            assert (turn < 1e-6).all()
            checked += len(turn)
    assert checked > 50


def test_arrows_signals_and_stop_lines_are_on_the_left(tmp_path):
    extract = Extract()
    extract.way((-150.0, 0.0), (0.0, 0.0), **STREET, lanes="3", lanes__backward="1",
                turn__lanes__forward="left|through;right")  # fmt: skip
    extract.way((0.0, 0.0), (150.0, 0.0), **STREET)
    extract.way((0.0, 0.0), (0.0, 150.0), **STREET)
    extract.way((0.0, -150.0), (0.0, 0.0), **STREET)
    extract.node(0.0, 0.0, highway="traffic_signals")
    _, root, reading, surface = left_roads(extract, tmp_path)
    assert not reading.network.issues
    road = next(r for r in root.findall("road") if len(r.findall(".//lane[@type='driving']")) == 3)
    arrows = {
        obj.get("name"): float(obj.get("t"))
        for obj in road.findall("objects/object")
        if obj.get("name").startswith("arrow")
    }
    assert set(arrows) == {"arrowLeft", "arrowStraightRight"}
    # The road runs east: the left turn is made from the lane beside the northern kerb.
    assert arrows["arrowLeft"] > arrows["arrowStraightRight"]
    (signal,) = road.findall("signals/signal")
    assert signal.get("orientation") == "+"
    assert float(signal.get("t")) > arrows["arrowLeft"]
    (line,) = [o for o in road.findall("objects/object") if o.get("name") == "stop line"]
    half = float(line.get("width")) / 2.0
    assert float(line.get("t")) + half < float(signal.get("t"))
    assert float(line.get("t")) - half > -1.7
    # From the lane with the left arrow one gets to the north.
    lanes = {lane.id: lane for lane in surface.lanes}
    (incoming,) = [x for x in surface.lanes if x.road == road.get("id") and x.lane == 2]
    ends = [lanes[name].points[-1] for name in incoming.successors]
    assert len(ends) == 1
    assert ends[0][1] > 5.0


def test_slopes_are_those_of_the_land(tmp_path):
    """Land that rises to the east, in a model that knows nothing of roads."""
    lon = LON + np.linspace(-0.02, 0.02, 81)
    rise = np.tile((lon - LON) * 2000.0, (81, 1)).astype(np.float32)
    profile = {"driver": "GTiff", "width": 81, "height": 81, "count": 1, "dtype": "float32"}
    where = rasterio.Affine(0.0005, 0.0, LON - 0.02025, 0.0, -0.0005, LAT + 0.02025)
    with rasterio.open(tmp_path / "dem.tif", "w", **profile, crs=4326, transform=where) as file:
        file.write(rise, 1)
    extract = Extract()
    extract.way((-200.0, 0.0), (200.0, 10.0), **STREET)
    _, _, _, surface = left_roads(extract, tmp_path, heightmap=tmp_path / "dem.tif")
    low, high = (surface.vertices[surface.vertices[:, 0].argsort()[[0, -1]]])[:, 2]
    assert high - low == pytest.approx(400.0 * 2000.0 / 74_500.0, rel=0.05)
