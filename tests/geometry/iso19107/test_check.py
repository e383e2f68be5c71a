"""Each code is found in a body that is broken on purpose, and in no other.

The bodies follow the descriptions of the unit tests of OGC's CityGML Quality Interoperability
Experiment (tudelft3d/CityGML-QIE-3Dvalidation).
"""

from dataclasses import replace
from itertools import pairwise

import manifold3d
import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from envgen_usd.geometry.flat_arrays import join, take
from envgen_usd.geometry.iso19107.body_faults import composite_faults, overlaps
from envgen_usd.geometry.iso19107.fault_codes import NAMES
from envgen_usd.geometry.iso19107.fault_search import Bodies, find_faults
from envgen_usd.geometry.iso19107.shell_faults import volumes
from envgen_usd.geometry.polygon_triangles import triangulate
from envgen_usd.models.polygon_arrays import Polygons

SQUARE = [(0, 0), (10, 0), (10, 10), (0, 10)]


def prism(outline, pieces=None, depth=10.0):
    """Faces over an outline in x and z, counter-clockwise seen from the front, and its sides.

    The front and the back are the pieces, where there are any, and else the outline.
    """
    pieces = pieces or [outline]
    front = [[[(x, 0, z) for x, z in piece]] for piece in pieces]
    back = [[[(x, depth, z) for x, z in reversed(piece)]] for piece in pieces]
    sides = [
        [[(*q[:1], 0, q[1]), (*p[:1], 0, p[1]), (p[0], depth, p[1]), (q[0], depth, q[1])]]
        for p, q in pairwise([*outline, outline[0]])
    ]
    return front + back + sides


def cube(offset=(0, 0, 0)):
    """Faces of a cube of 10 m: front, back, bottom, right, top, left; each a list of rings."""
    return [[(np.array(ring) + offset).tolist() for ring in face] for face in prism(SQUARE)]


FRONT, BACK, BOTTOM, RIGHT, TOP, LEFT = range(6)


def cube_with(face, *rings):
    faces = cube()
    faces[face] = list(rings)
    return faces


def on_top(*places):
    return [(x, y, 10) for x, y in places]


WHOLE_TOP = on_top(*SQUARE)


def hole(x0=3, y0=3, x1=7, y1=7):
    return on_top((x0, y0), (x0, y1), (x1, y1), (x1, y0))


def with_top(*rings):
    return cube_with(TOP, WHOLE_TOP, *rings)


def roofed(x, y, z):
    """The cube with a pyramid in place of its top; the tip may lie below."""
    faces = cube()
    faces[TOP : TOP + 1] = [[[p, q, (x, y, z)]] for p, q in pairwise([*WHOLE_TOP, WHOLE_TOP[0]])]
    return faces


def moved(corner, to):
    """The cube with one of its corners elsewhere."""
    return [[[to if p == list(corner) else p for p in ring] for ring in face] for face in cube()]


def turned(faces):
    return [[ring[::-1] for ring in face] for face in faces]


def pierced(*levels):
    """The cube with a shaft of square section from top to bottom through x, y at heights z."""
    rings = [
        [(x + dx, y + dy, z) for dx, dy in ((0, 0), (0, 4), (4, 4), (4, 0))] for x, y, z in levels
    ]
    walls = [
        [[p, a, b, q]]
        for upper, lower in pairwise(rings)
        for (p, q), (a, b) in zip(
            pairwise([*upper, upper[0]]), pairwise([*lower, lower[0]]), strict=True
        )
    ]
    faces = cube()
    faces[TOP].append(rings[0])
    faces[BOTTOM].append(rings[-1][::-1])
    return faces + walls


def polygon(rings):
    rings = [np.array(ring, dtype=float) for ring in rings]
    sizes = np.cumsum([0, *(len(ring) for ring in rings)])
    return Polygons(np.concatenate(rings), sizes, np.array([0, len(rings)]))


def polygons(faces):
    return join([polygon(rings) for rings in faces])


def codes_of(faces):
    return [fault.code for fault in find_faults(Bodies.of_solid(polygons(faces)))]


VALID = {
    "cube": cube(),
    "cube at UTM coordinates": cube((691000, 5336000, 520)),
    "top in two pieces": prism(
        [(0, 0), (10, 0), (10, 10), (5, 10), (0, 10)],
        [[(0, 0), (10, 0), (10, 10), (5, 10)], [(0, 0), (5, 10), (0, 10)]],
    ),
    "pyramid": roofed(5, 5, 15),
    "pyramid that points down": roofed(5, 5, 3),
    "L": prism([(0, 0), (10, 0), (10, 5), (5, 5), (5, 10), (0, 10)]),
    "hole that is filled": [*with_top(hole()), [hole()[::-1]]],
    "two holes that touch": [
        *with_top(hole(x1=5, y1=5), hole(x0=5, y0=5)),
        [hole(x1=5, y1=5)[::-1]],
        [hole(x0=5, y0=5)[::-1]],
    ],
    "hole touches the outer ring": [
        *with_top(on_top((0, 0), (3, 5), (5, 3))),
        [on_top((0, 0), (5, 3), (3, 5))],
    ],
    "hole right through": pierced((3, 3, 10), (3, 3, 0)),
    "a corner 9 mm too high": moved((10, 10, 10), (10, 10, 10.009)),
    "in two parts that share vertices within 0.2 mm": moved((0, 0, 0), (0.0002, 0, 0))[:3]
    + cube()[3:],
}


@pytest.mark.parametrize("name", VALID)
def test_valid_bodies_have_no_faults(name):
    assert codes_of(VALID[name]) == []


@pytest.mark.parametrize("name", VALID)
def test_manifold3d_and_trimesh_agree_that_they_are_valid(name):
    body = polygons(VALID[name])
    triangles, _ = triangulate(body)
    places = np.round(body.points - body.points[0], 3)[triangles].reshape(-1, 3)
    points, corners = np.unique(places, axis=0, return_inverse=True)
    corners = corners.reshape(-1, 3)

    mesh = trimesh.Trimesh(points, corners, process=False)
    solid = manifold3d.Manifold(manifold3d.Mesh64(points, corners.astype(np.uint64)))

    assert mesh.is_volume
    assert solid.status() == manifold3d.Error.NoError
    volume = volumes(body, np.zeros(len(body), dtype=np.int64))[0]
    assert volume == pytest.approx(mesh.volume, rel=1e-3)
    assert volume == pytest.approx(solid.volume(), rel=1e-3)


SHAFT = [(2, 2, 0), (5, 8, 0), (10, 5, 0)]
INVALID = {
    "top has two points": (101, cube_with(TOP, WHOLE_TOP[:2])),
    "a point follows itself": (102, cube_with(TOP, [WHOLE_TOP[0], *WHOLE_TOP])),
    "top is a bow tie": (104, cube_with(TOP, on_top((0, 0), (10, 10), (10, 0), (0, 10)))),
    "a point comes again": (104, cube_with(TOP, [*WHOLE_TOP, (5, 5, 10), (10, 0, 10)])),
    "hole is a line": (104, with_top(on_top((3, 3), (5, 5), (7, 7)))),
    "hole crosses the outer ring": (201, with_top(hole(x0=5, x1=15))),
    "hole shares an edge with the outer ring": (201, with_top(hole(x0=0))),
    "holes cross": (201, with_top(hole(), hole(x0=5, x1=8, y0=4, y1=6))),
    "holes share an edge": (201, with_top(hole(x1=5), hole(x0=5))),
    "hole twice": (202, with_top(hole(), hole())),
    "hole equals the outer ring": (202, with_top(WHOLE_TOP[::-1])),
    "a corner 5 cm too high": (203, cube_with(TOP, [*WHOLE_TOP[:2], (10, 10, 10.05), (0, 10, 10)])),
    "a fold of 5 mm": (
        204,
        cube_with(
            BOTTOM,
            [
                *((0, 9, 0), (5, 9, 0), (5.001, 9, 0.005), (10, 9, 0.005)),
                *((10, 0, 0.005), (5.001, 0, 0.005), (5, 0, 0), (0, 0, 0)),
            ],
        ),
    ),
    "edges of 4 mm stand on the polygon": (
        104,
        cube_with(
            TOP,
            [
                *((0, 0, 10), (10, 0, 10), (10, 5, 10.002), (10, 5, 9.998)),
                *((10, 10, 10), (0, 10, 10), (0, 5, 9.998), (0, 5, 10.002)),
            ],
        ),
    ),
    "hole cuts the polygon in two": (205, with_top(on_top((0, 5), (5, 10), (10, 5), (5, 0)))),
    "holes cut the polygon in two": (
        205,
        with_top(on_top((0, 5), (5, 7), (4, 5), (5, 3)), on_top((5, 7), (10, 5), (5, 3), (6, 5))),
    ),
    "hole outside": (206, with_top(hole(x0=13, x1=17))),
    "hole in a hole": (207, with_top(hole(), hole(4, 4, 6, 6))),
    "hole runs as the outer ring": (208, with_top(hole()[::-1])),
    "bottom is missing": (302, [*cube()[:BOTTOM], *cube()[RIGHT:]]),
    "hole is not filled": (302, with_top(hole())),
    "one of two neighbours has a vertex on the edge": (
        302,
        cube_with(TOP, on_top((0, 0), (5, 0), *SQUARE[1:])),
    ),
    "cubes touch at an edge": (303, [*cube(), *cube((10, 0, 10))]),
    "two cubes apart": (305, [*cube(), *cube((0, 0, 20))]),
    "tip of the roof under the ground": (306, roofed(5, 5, -3)),
    "tip of the roof touches the ground": (306, roofed(5, 5, 0)),
    "tip of the roof outside": (306, roofed(15, 5, 2)),
    "arms of a U touch": (
        306,
        prism(
            [(0, 0), (10, 0), (10, 2), (10, 8), (5, 8), (5, 2), (5, 10), (0, 10), (0, 2)],
            [
                [(0, 0), (10, 0), (10, 2), (5, 2), (0, 2)],
                [(0, 2), (5, 2), (5, 10), (0, 10)],
                [(5, 2), (10, 2), (10, 8), (5, 8)],
            ],
        ),
    ),
    "shaft touches a wall along an edge": (
        303,
        [
            [[(0, 0, 0), (0, 10, 0), (10, 10, 0), (10, 5, 0), (10, 0, 0)], SHAFT[::-1]],
            [
                [(0, 0, 10), (10, 0, 10), (10, 5, 10), (10, 10, 10), (0, 10, 10)],
                [(x, y, 10) for x, y, _ in SHAFT],
            ],
            [[(10, 0, 0), (10, 5, 0), (10, 10, 0), (10, 10, 10), (10, 5, 10), (10, 0, 10)]],
            *(cube()[face] for face in (FRONT, BACK, LEFT)),
            *([[p, q, (*q[:2], 10), (*p[:2], 10)]] for p, q in pairwise([*SHAFT, SHAFT[0]])),
        ],
    ),
    "shaft leaves the body": (306, pierced((3, 3, 10), (9, 3, 5), (3, 3, 0))),
    "one polygon is turned": (307, [*turned(cube()[:1]), *cube()[1:]]),
    "all polygons point inwards": (405, turned(cube())),
    "two polygons": (301, [[WHOLE_TOP], [WHOLE_TOP[::-1]]]),
    "a face inside, between two cubes": (303, [*cube(), *cube((10, 0, 0))[:LEFT]]),
    "no volume": (
        405,
        [
            [on_top((0, 0), (10, 0), (10, 10))],
            [on_top((0, 0), (10, 10), (0, 10))],
            [on_top((0, 0), (0, 10), (10, 0))],
            [on_top((10, 0), (0, 10), (10, 10))],
        ],
    ),
}


@pytest.mark.parametrize("name", INVALID)
def test_the_fault_is_found_and_no_other(name):
    code, faces = INVALID[name]

    assert set(codes_of(faces)) == {code}


def test_a_polygon_that_hangs_on_at_a_vertex_is_open_too():
    faces = [*cube(), [[(10, 10, 10), (12, 10, 10), (12, 12, 10)]]]

    assert codes_of(faces) == [303, 305, 302]


def test_a_polygon_that_floats_is_open_too():
    assert codes_of([*cube(), [[(0, 0, 20), (10, 0, 20), (10, 10, 20)]]]) == [305, 302]


CAVITY = [[[tuple(np.array(p) * 0.4 + 3) for p in ring] for ring in face] for face in cube()]
SHIFTED = [[[(x + 6, y, z) for x, y, z in ring] for ring in face] for face in CAVITY]


def tetrahedron(tip, corners=((2, 2), (8, 2), (5, 5)), base=2):
    """Faces of a tetrahedron over a horizontal triangle, outwards if the tip is above it."""
    low = [(x, y, base) for x, y in corners]
    return [[low[::-1]], *([[p, q, tip]] for p, q in pairwise([*low, low[0]]))]


CAVITIES = {
    "valid": (None, cube(), turned(CAVITY)),
    "cavity leaves the body": (401, cube(), turned(SHIFTED)),
    "cavity shares a face": (
        401,
        cube(),
        turned([[[(x + 3, y, z) for x, y, z in ring] for ring in face] for face in CAVITY]),
    ),
    "cavity as large as the body": (402, cube(), turned(cube())),
    "cavities cross": (
        401,
        cube(),
        turned(CAVITY),
        turned([[[(x + 1, y + 1, z) for x, y, z in ring] for ring in face] for face in CAVITY]),
    ),
    "cavity leaves the body by 0.01 mm": (401, cube(), turned(tetrahedron((5, 5, 10.00001)))),
    "cavity enters the body by 0.01 mm": (401, cube(), tetrahedron((5, 5, 9.99999), base=20)),
    "cavities touch along an edge": (
        None,
        cube(),
        turned(tetrahedron((5, 5, 9))),
        turned(tetrahedron((5, 1, 9), ((8, 2), (2, 2), (5, 1)))),
    ),
    "cavity outside": (403, cube(), turned(cube((20, 0, 0)))),
    "cavity cuts the inside in two": (
        404,
        cube(),
        [
            [[q, p, tip] if tip[2] > 5 else [p, q, tip]]
            for tip in ((5, 5, 7), (5, 5, 3))
            for p, q in pairwise([(*place, 5) for place in [*SQUARE, SQUARE[0]]])
        ],
    ),
    "normals point out of the cavity": (405, cube(), CAVITY),
}


@pytest.mark.parametrize("name", CAVITIES)
def test_shells_of_a_solid(name):
    code, *shells = CAVITIES[name]
    shell = np.repeat(np.arange(len(shells)), [len(faces) for faces in shells])
    bodies = Bodies(
        join([polygons(faces) for faces in shells]), shell, np.zeros(len(shells), dtype=np.int64)
    )

    assert [fault.code for fault in find_faults(bodies)] == ([code] if code else [])


@settings(max_examples=30)
@given(st.integers(0, 2**32 - 1))
def test_what_is_valid_stays_so_wherever_it_is_turned(seed):
    generator = np.random.default_rng(seed)
    turn = Rotation.random(random_state=generator)
    shift = generator.uniform(-1e6, 1e6, 3)
    for faces in VALID.values():
        body = polygons(faces)
        points = np.round(turn.apply(body.points.copy()) + shift, 6)
        elsewhere = Polygons(points, body.ring_offsets, body.polygon_offsets)
        assert find_faults(Bodies.of_solid(elsewhere)) == []


def test_many_bodies_at_once_are_told_apart():
    good, (_, bad) = polygons(cube()), INVALID["bottom is missing"]
    bad = polygons(bad)
    parts = [good, bad, good, bad]
    shell = np.repeat(np.arange(4), [len(part) for part in parts])

    found = find_faults(Bodies(join(parts), shell, np.arange(4)))

    assert [(fault.code, fault.shell) for fault in found] == [(302, 1), (302, 3)]
    assert found[0].name == "SHELL_NOT_CLOSED"


def surfaces(polygons):
    """Polygons that belong to no shell."""
    none = np.empty(0, dtype=np.int64)
    return Bodies(polygons, np.full(len(polygons), -1, dtype=np.int64), none)


def test_surfaces_need_not_be_closed():
    assert find_faults(surfaces(polygons(cube()[:2]))) == []


def test_the_polygon_at_fault_is_named():
    (fault,) = find_faults(surfaces(polygons(INVALID["a fold of 5 mm"][1])))

    assert (fault.code, fault.polygon) == (204, BOTTOM)
    assert fault.detail.endswith("degrees")


@pytest.mark.parametrize("value", [np.nan, np.inf, 1e300, -1e30])
def test_a_coordinate_that_is_not_finite_or_no_place_on_earth(value):
    faces = cube_with(TOP, [*WHOLE_TOP[:3], (0, 10, value)])

    (fault,) = find_faults(Bodies.of_solid(polygons(faces)))

    assert (fault.code, fault.polygon) == (901, TOP)


def test_nothing_has_no_faults():
    assert find_faults(surfaces(Polygons.of_rings([]))) == []


def test_overlaps_of_bodies():
    shifts = [(0, 0, 0), (9, 0, 0), (19, 0, 0), (30, 0, 0)]
    solids = {number: [polygons(cube(shift))] for number, shift in enumerate(shifts)}

    ((one, other, figures),) = overlaps(solids, [[0, 1, 2], [2, 3]])

    # A box of 10 m x 10 m x 1 m: twice 100 m³ over 240 m².
    assert (one, other, figures) == (0, 1, "100 m³, 833.3 mm thick")


@settings(max_examples=20)
@given(st.integers(0, 2**32 - 1))
def test_an_overlap_of_a_micrometre_counts_but_rounding_does_not(seed):
    generator = np.random.default_rng(seed)
    turn, far = Rotation.random(random_state=generator), generator.uniform(-1e7, 1e7, 3)

    def solids(depth):
        both = [polygons(cube()), polygons(cube((10 - depth, 3, 3)))]
        turned = [(turn.apply(each.points.copy()) + far, each) for each in both]
        return {n: [replace(each, points=p)] for n, (p, each) in enumerate(turned)}

    assert overlaps(solids(0.0), [[0, 1]]) == []
    assert len(overlaps(solids(1e-6), [[0, 1]])) == 1


def test_a_body_in_a_cavity_has_no_volume_in_common():
    around = [polygons(cube()), polygons(turned(CAVITY))]

    assert overlaps({0: around, 1: [polygons(CAVITY)]}, [[0, 1]]) == []


COMPOSITES = {
    "two cubes with a common face": ([], (0, 0, 0), (10, 0, 0)),
    "two cubes with a common edge": ([503], (0, 0, 0), (10, 0, 10)),
    "two cubes apart": ([503], (0, 0, 0), (11, 0, 0)),
    "two cubes overlap by 0.01 mm": ([501], (0, 0, 0), (9.99999, 0, 0)),
    "one cube twice": ([502], (0, 0, 0), (10, 0, 0), (0, 0, 0)),
}


@pytest.mark.parametrize("name", COMPOSITES)
def test_solids_of_a_composite_solid(name):
    codes, *shifts = COMPOSITES[name]

    faults = composite_faults([[polygons(cube(shift))] for shift in shifts])

    assert [code for code, _, _ in faults] == codes


LID = [[p, q, (5, 5, 10)] for p, q in pairwise([*WHOLE_TOP, WHOLE_TOP[0]])]
COMPOSITE_SURFACES = {
    "open box": ([], cube()[:TOP]),
    "single polygon": ([], cube()[:1]),
    "closed inwards": ([], turned(cube())),
    "pieces of the lid meet at a vertex": (
        [303],
        [*cube()[:TOP], cube()[LEFT], [LID[0]], [LID[2]]],
    ),
    "two pieces": ([305], [cube()[TOP], cube()[BOTTOM]]),
    "one polygon is turned": ([307], [*turned(cube()[:1]), *cube()[1:TOP]]),
    "tip under the ground": ([306], roofed(5, 5, -3)[BACK:]),
}


@pytest.mark.parametrize("name", COMPOSITE_SURFACES)
def test_a_composite_surface_may_be_open(name):
    codes, faces = COMPOSITE_SURFACES[name]
    surface = Bodies(polygons(faces), np.zeros(len(faces), dtype=np.int64), np.array([-1]))

    assert [fault.code for fault in find_faults(surface)] == codes


def test_composite_surfaces_are_no_shells_of_one_solid():
    both = polygons([*cube(), *cube((20, 0, 0))])
    shell = np.repeat([0, 1], len(cube()))

    assert find_faults(Bodies(both, shell, np.array([-1, -1]))) == []


def test_a_lid_that_shares_the_outer_edges_of_a_hole_does_not_fill_it():
    """A box of 4 m on a plate without thickness."""
    box = [[[(0.4 * x + 3, 0.4 * y + 3, 0.4 * z + 10) for x, y, z in r] for r in f] for f in cube()]
    del box[BOTTOM]

    assert codes_of([[WHOLE_TOP, hole()], [WHOLE_TOP[::-1]], *box]) == [306]


def test_every_code_that_a_body_can_have_is_seeded():
    seeded = {code for code, _ in INVALID.values()} | {code for code, *_ in CAVITIES.values()}

    # Rings that are open and empty elements exist in files; the others lie between solids.
    assert set(NAMES) - seeded - {None} == {103, 501, 502, 503, 601, 901, 902}


def test_take_and_join_are_inverse():
    body = polygons(pierced((3, 3, 10), (3, 3, 0)))
    half = len(body) // 2

    again = join([take(body, np.arange(half)), take(body, np.arange(half, len(body)))])

    assert again.points.tolist() == body.points.tolist()
    assert again.ring_offsets.tolist() == body.ring_offsets.tolist()
    assert again.polygon_offsets.tolist() == body.polygon_offsets.tolist()
