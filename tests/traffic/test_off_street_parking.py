"""Vehicles on car parks, driveways and yards."""

import numpy as np
import shapely
from tests.traffic.parked_streets import (
    LOOKS,
    NARROW,
    TRUCK,
    Y,
    actors_of,
    full_kerbs,
    plans,
    road_text,
    rules,
)

from envgen_usd.models.actor_rules import LotRules
from envgen_usd.models.city_model import City, CityObject, ThematicSurface
from envgen_usd.models.landuse import LanduseClass, Plot
from envgen_usd.models.parked_actors import ActorLook
from envgen_usd.models.polygon_arrays import Polygons

STREET = road_text(NARROW, NARROW)


def plot(landuse, *, x=40.0, y=120.0, width=40.0, depth=38.0):
    """A plot north of the street; its frontage runs westwards, so that it lies on its left."""
    corners = np.array([[x, y], [x + width, y], [x + width, y + depth], [x, y + depth]])
    front = corners[:2]
    return Plot("p", corners, landuse, front, "1", np.array([x + width / 2, y]), "left")


def test_a_car_park_has_rows_with_aisles_and_a_way_in(tmp_path):
    lots = LotRules((1.0, 1.0), 0.0, {"car": 1.0})
    park = plot(LanduseClass.PARKING)
    actors = actors_of(tmp_path, STREET, rules(lots=lots), plots=[park])
    assert len(actors) > 25
    shapes = shapely.polygons(plans(actors))
    assert shapely.covers(shapely.Polygon(park.polygon), shapes).all()
    first, second = shapely.STRtree(shapes).query(shapes, predicate="intersects")
    assert (first == second).all()
    way = shapely.box(57.5, 120.0, 62.5, 158.0)
    assert not shapely.intersects(way, shapes).any()
    # An aisle of at least 5 m (places are 5 m long, vehicles up to 5 m) crosses the car park.
    rows = np.unique(np.round([a.position[1] for a in actors], 2))
    assert 11.0 - 1e-6 in np.round(np.diff(rows), 2) or (np.diff(rows) >= 10.9).any()
    assert all(abs(np.cos(a.heading)) < 1e-6 for a in actors)


def test_other_plots_have_no_car_park(tmp_path):
    lots = LotRules((1.0, 1.0), 0.0, {"car": 1.0})
    assert not actors_of(tmp_path, STREET, rules(lots=lots), plots=[plot(LanduseClass.LAWN)])


def house_with_door(width, y=120.0):
    """A wall that faces the street (south), with a door."""
    x = 60.0
    ring = np.array([[x, y, 5.0], [x + width, y, 5.0], [x + width, y, 7.2], [x, y, 7.2]])
    door = ThematicSurface("d", "DoorSurface", Polygons.of_rings([ring]), 3)
    wall = ThematicSurface("w", "WallSurface", Polygons.of_rings([ring]), 3, openings=(door,))
    return City((CityObject("house", "Building", surfaces=(wall,)),))


def test_driveways_lead_to_garages_and_not_to_doors(tmp_path):
    lots = LotRules((0.0, 0.0), 1.0, {"car": 1.0})
    (actor,) = actors_of(tmp_path, STREET, rules(lots=lots), city=house_with_door(2.6))
    assert actor.place == "driveway"
    assert abs(actor.position[0] - 61.3) < 1e-3
    assert abs(actor.position[1] + actor.look.size[0] / 2 - 119.3) < 1e-3
    assert abs(np.cos(actor.heading)) < 1e-6
    assert not actors_of(tmp_path, STREET, rules(lots=lots), city=house_with_door(1.0))


def test_kerbs_before_driveways_stay_free(tmp_path):
    wide = road_text((), (("driving", 6.0), ("sidewalk", 3.0, 0.12)))
    # South of the street, 3 m behind the sidewalk; the door looks north.
    city = house_with_door(2.6, y=Y - 12.0)
    actors = actors_of(tmp_path, wide, full_kerbs(), city=city)
    fronts = np.array([a.position[0] + a.look.size[0] / 2 for a in actors])
    backs = np.array([a.position[0] - a.look.size[0] / 2 for a in actors])
    assert len(actors) > 15
    assert not ((fronts > 60.0) & (backs < 62.6)).any()


def test_yards_of_industry_hold_lorries(tmp_path):
    looks = {**LOOKS, "truck": (ActorLook("truck", "lorry", {}, 1.0, np.array(TRUCK)),)}
    lots = LotRules((0.0, 0.0), 0.0, {"car": 1.0}, 60.0, {"truck": 1.0})
    yard = plot(LanduseClass.RUBBLE, width=60.0, depth=60.0)
    hall = shapely.box(50.0, 130.0, 80.0, 160.0)
    numbers = []
    for seed in range(10):
        actors = actors_of(
            tmp_path,
            STREET,
            rules(lots=lots),
            plots=[yard],
            looks=looks,
            seed=seed,
            obstacles=[hall],
        )
        numbers.append(len(actors))
        shapes = shapely.polygons(plans(actors))
        assert not shapely.intersects(hall, shapes).any()
        assert shapely.covers(shapely.Polygon(yard.polygon), shapes).all()
    # 60 on a hectare are 22 on the yard; the hall takes a part of them.
    assert 6 < np.mean(numbers) < 22
