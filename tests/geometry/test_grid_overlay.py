"""Overlays of shapes that nearly touch, near and far from the origin."""

import pytest
import shapely

from envgen_usd.geometry.grid_overlay import on_grid

FRONT = [(28.67, 18.286), (5.81, 0.0), (0.04, 7.215), (22.896, 25.501)]
FAR = [
    (362012.23904427275, 5296786.270112366),
    (361989.38289326563, 5296767.983689692),
    (361983.6106614895, 5296775.198386817),
    (362006.4668124966, 5296793.484809493),
]
BESIDE = [
    (362012.1670614761, 5296786.212521399),
    (362016.91226752993, 5296780.281500989),
    (361994.1681014034, 5296762.044988397),
    (361989.40353637625, 5296768.000205536),
]
"""Plots of a map in metres of UTM; GEOS finds no overlay of these on a grid of 1e-9 m."""


def test_neighbours_share_no_area_where_coordinates_are_millions_of_metres():
    plots = [shapely.Polygon(ring) for ring in (FAR, BESIDE)]
    with pytest.raises(shapely.GEOSException):
        shapely.intersection(*plots, grid_size=1e-9)
    assert on_grid(shapely.intersection, *plots).area < 1e-3
    left = on_grid(shapely.difference, *plots)
    assert left.area == pytest.approx(plots[0].area, abs=1e-3)


def test_halves_of_a_plot_are_halves():
    whole = shapely.Polygon(FRONT)
    half = shapely.Polygon([FRONT[0], FRONT[1], FRONT[2]])
    assert on_grid(shapely.difference, whole, half).area == pytest.approx(whole.area / 2, rel=0.01)
    joined = on_grid(shapely.union_all, [whole, half])
    assert joined.area == pytest.approx(whole.area)
