"""Shop fronts, and what is fixed to houses: openings of the solid, and placed installations."""

from dataclasses import replace

import numpy as np
import pytest

from envgen_usd.assets.asset_catalogue import read_catalogue
from envgen_usd.city.buildings.building_design import (
    Chimney,
    Design,
    Extras,
    Fittings,
    OpeningDesign,
)
from envgen_usd.city.buildings.building_feature import make_building
from envgen_usd.city.buildings.facades import Facade, lay_out
from envgen_usd.city.buildings.thematic_surfaces import Site
from envgen_usd.citygml.read import read_city
from envgen_usd.citygml.write import write_city
from envgen_usd.environment_files import read_profile
from envgen_usd.geometry.flat_arrays import join
from envgen_usd.geometry.iso19107.fault_search import Bodies, find_faults
from envgen_usd.layers.prop_choices import choose_props
from envgen_usd.models.city_model import City

SITE = Site(np.array([100.0, 50.0]), np.array([1.0, 0.0]), 1.0, 1.6, 1.3, room=3.0)
EVERYTHING = Fittings(*[True] * 8)


def house(fittings=EVERYTHING, **changes):
    design = Design(
        style="row",
        function="residential",
        width=9.0,
        depth=11.0,
        storeys=3,
        storey_height=3.2,
        roof="gabled",
        slope=0.8,
        overhang=0.0,
        parapet=0.0,
        ridge_to_street=False,
        plinth=0.1,
        wall_material="brick_red",
        roof_material="roof_slate",
        windows=OpeningDesign(1.1, 1.5, 0.9, 2.0),
        doors=OpeningDesign(1.0, 2.2, 0.0, 100.0),
        chimney=Chimney(0.5, 0.5, 0.7, 0.9),
        extras=Extras(embrasure=0.08, fittings=fittings),
    )
    return replace(design, **changes)


def fixtures(design):
    building, _ = make_building("b", design, SITE)
    return {part.placement.template: part.placement for part in building.walk() if part.placement}


def test_all_fixtures_are_placed_assets_of_the_library():
    kinds = {asset.kind for asset in read_catalogue().assets.values()}
    made = fixtures(house())
    assert set(made) == {
        *("shop_fascia", "shop_sign", "awning", "stone_course", "cornice", "gutter", "downpipe"),
        *("chimney_pots", "aerial", "satellite_dish", "balcony"),
    }
    assert set(made) <= kinds
    assert not set(fixtures(house(Fittings()))) - {"chimney_pots"}


def test_fixtures_stand_on_the_street_wall_and_look_at_the_street():
    made = fixtures(house())
    for name in ("shop_fascia", "stone_course", "cornice", "downpipe", "satellite_dish"):
        assert made[name].position[1] == pytest.approx(50.0), name
        # The street lies towards -y.
        assert made[name].heading == pytest.approx(-np.pi / 2)
    # The floor lies 0.1 m above the highest ground, 1.6 m; the pipe reaches down to the street.
    assert made["downpipe"].position[2] == pytest.approx(1.3)
    assert made["downpipe"].size[2] == pytest.approx(1.7 + 9.6 - 1.3)
    assert made["gutter"].size[1] == pytest.approx(9.0)
    assert made["cornice"].position[2] + made["cornice"].size[2] <= 1.7 + 9.6
    assert made["chimney_pots"].position[2] > 1.7 + 9.6 + 5.5 * 0.8


def test_a_shop_front_keeps_the_shell_a_solid():
    building, left_out = make_building("b", house(), SITE)
    assert not left_out
    surfaces = [s for wall in building.surfaces for s in (wall, *wall.openings)]
    shell = join([surface.polygons for surface in surfaces])
    assert find_faults(Bodies.of_solid(shell)) == []


def test_a_shop_has_a_door_and_displays_below_its_board():
    design = house()
    holes = lay_out(design, Facade(9.0, 3, street=True))
    shop = [hole for hole in holes if hole.shop]
    assert [hole.kind for hole in shop].count("DoorSurface") == 1
    displays = [hole for hole in shop if hole.kind == "WindowSurface"]
    assert displays
    for hole in displays:
        width, top = hole.box[2] - hole.box[0], hole.box[3]
        assert width >= 1.95
        board = fixtures(design)["shop_fascia"]
        assert top + 1.7 <= board.position[2] <= 1.7 + 3.2 - board.size[2]
    boxes = [hole.box for hole in holes]
    for number, one in enumerate(boxes):
        for other in boxes[:number]:
            apart = (
                one[0] >= other[2] + 0.3
                or other[0] >= one[2] + 0.3
                or one[1] >= other[3] + 0.2
                or other[1] >= one[3] + 0.2
            )
            assert apart, (one, other)


def test_each_upper_storey_has_a_balcony_before_a_window_that_reaches_its_floor():
    design = house()
    holes = lay_out(design, Facade(9.0, 3, street=True))
    tall = [hole for hole in holes if hole.balcony]
    # The floor lies 1.7 m above zero, storeys are 3.2 m high.
    assert [hole.box[1] for hole in tall] == pytest.approx([3.28, 6.48])
    building, _ = make_building("b", design, SITE)
    placed = [part.placement for part in building.walk()
              if part.placement and part.placement.template == "balcony"]  # fmt: skip
    assert len(placed) == 2
    for hole, placement in zip(tall, placed, strict=True):
        left, bottom, right, top = hole.box
        assert placement.position[0] == pytest.approx(100.0 + (left + right) / 2, abs=1e-3)
        assert right - left < placement.size[1] < 9.0
        floor = placement.position[2] + 0.16
        assert floor == pytest.approx(1.7 + bottom - 0.08, abs=2e-3)
        assert floor + 1.0 < placement.position[2] + placement.size[2] < 1.7 + top
    assert not [
        hole for hole in lay_out(house(storeys=1), Facade(9.0, 1, street=True)) if hole.balcony
    ]


def test_doors_windows_and_board_of_a_shop_have_one_paint():
    library, profile = read_catalogue(), read_profile("1", "residential")
    paints = []
    for number in range(12):
        building, _ = make_building(f"b{number}", house(), SITE)
        props = choose_props(City((building,)), {f"b{number}": building}, profile, library, 0)
        shop = [prop.choice for prop in props if "paint" in prop.choice.asset.variants]
        assert {"shop_fascia", "door_shop", "window_shop"} == {choice.asset.name for choice in shop}
        assert len({choice.selections["paint"] for choice in shop}) == 1
        paints.append(shop[0].selections["paint"])
    assert len(set(paints)) > 2


def test_a_short_wall_has_no_shop():
    holes = lay_out(house(width=4.5), Facade(4.5, 3, street=True))
    assert not [hole for hole in holes if hole.shop]


def test_fixtures_survive_the_city_model(tmp_path):
    building, _ = make_building("b", house(), SITE)
    write_city(City((building,)), tmp_path / "city.gml")
    read = read_city(tmp_path / "city.gml")
    placed = {part.id: part.placement for part in read.walk() if part.placement}
    before = {part.id: part.placement for part in building.walk() if part.placement}
    assert set(placed) == set(before)
    for name, placement in before.items():
        assert placed[name].template == placement.template
        np.testing.assert_allclose(placed[name].position, placement.position, atol=1e-3)
        np.testing.assert_allclose(placed[name].size, placement.size, atol=1e-3)
        assert placed[name].heading == pytest.approx(placement.heading, abs=1e-6)
