"""Outlines that are joined from pieces are those of the whole, cut out of a rectangle."""

import numpy as np
import pytest
import shapely

from envgen_usd.geometry.joined_outline import joined_outline

_BOUNDS = (-40.0, -30.0, 50.0, 45.0)


def _edges(area):
    """Edges of polygons, with the area on their left, in no order; z is x + 2 y."""
    edges = []
    for part in shapely.get_parts(shapely.orient_polygons(area)):
        for ring in (part.exterior, *part.interiors):
            plan = shapely.get_coordinates(ring)
            points = np.column_stack([plan, plan @ (1.0, 2.0)])
            edges.append(np.stack([points[:-1], points[1:]], axis=1))
    return np.random.default_rng(1).permutation(np.concatenate(edges))


def _area(outline):
    """The area that loops enclose: outer loops without their holes."""
    rings = [shapely.Polygon(outline.vertices[loop, :2]) for loop in outline.loops]
    outer = [ring for ring in rings if ring.exterior.is_ccw]
    holes = [ring for ring in rings if not ring.exterior.is_ccw]
    return shapely.difference(shapely.union_all(outer), shapely.union_all(holes))


def _assert_same(outline, area):
    expected = shapely.intersection(area, shapely.box(*_BOUNDS))
    assert shapely.symmetric_difference(_area(outline), expected).area < 1e-6
    plan = outline.vertices[:, :2]
    on_edge = shapely.distance(shapely.points(plan), shapely.boundary(area)) < 1e-9
    assert np.allclose(outline.vertices[on_edge, 2], plan[on_edge] @ (1.0, 2.0), atol=1e-6)


@pytest.mark.parametrize("seed", range(12))
def test_a_rectangle_cuts_an_outline_and_closes_it(seed):
    rng = np.random.default_rng(seed)
    lines = shapely.linestrings(rng.uniform(-80.0, 80.0, (9, 3, 2)))
    area = shapely.union_all(shapely.buffer(lines, rng.uniform(2.0, 6.0, 9)))
    outline = joined_outline(_edges(area), _BOUNDS)
    assert len(outline.gaps) == 0
    _assert_same(outline, area)


@pytest.mark.parametrize(
    "area",
    [
        shapely.box(-10.0, -10.0, 10.0, 10.0),
        shapely.box(-90.0, -5.0, 90.0, 5.0),  # from side to side
        shapely.box(-90.0, -90.0, 0.0, 0.0),  # over a corner
        shapely.box(-90.0, -90.0, 90.0, 0.0),  # over two
        shapely.box(-90.0, -90.0, 90.0, 90.0).difference(shapely.box(-60.0, 0.0, 0.0, 20.0)),
        *(
            shapely.box(-90.0, -90.0, 90.0, 90.0).difference(shapely.box(*hole))  # at the border
            for hole in (
                *((-40.0, 0.0, 0.0, 20.0), (0.0, 0.0, 50.0, 20.0)),
                *((0.0, -30.0, 20.0, 0.0), (0.0, 0.0, 20.0, 45.0)),
            )
        ),
        shapely.box(-40.0, -30.0, 0.0, 10.0),  # along the border
        shapely.box(-60.0, -50.0, -40.0, 60.0),  # beside it
        shapely.box(-90.0, -30.0, 90.0, 0.0),  # one side along the border
        shapely.MultiPolygon([shapely.box(0.0, 0.0, 9.0, 9.0), shapely.box(9.0, 9.0, 20.0, 60.0)]),
        shapely.Polygon(),
    ],
)
def test_sides_along_the_border_belong_to_what_lies_inside(area):
    outline = joined_outline(_edges(area) if not area.is_empty else np.empty((0, 2, 3)), _BOUNDS)
    assert len(outline.gaps) == 0
    _assert_same(outline, area)


def test_the_order_of_edges_does_not_matter():
    edges = _edges(shapely.box(-90.0, -9.0, 20.0, 9.0).union(shapely.box(0.0, -90.0, 9.0, 90.0)))
    one, other = (joined_outline(each, _BOUNDS) for each in (edges, edges[::-1]))
    assert np.array_equal(one.vertices, other.vertices)
    assert all(np.array_equal(a, b) for a, b in zip(one.loops, other.loops, strict=True))


def test_edges_that_do_not_meet_are_told_and_closed():
    area = shapely.segmentize(shapely.box(-10.0, -10.0, 10.0, 10.0), 5.0)
    outline = joined_outline(_edges(area)[1:], _BOUNDS)
    assert len(outline.gaps) == 2
    assert np.hypot(*(outline.gaps[0] - outline.gaps[1])) == pytest.approx(5.0)
    assert _area(outline).equals(area)
