"""Area of every lane of the built surface against an evaluation straight from the standard.

The area of a lane in plan is the integral over s and t of the Jacobian of its points: for a level
reference line of unit speed with curvature k that is ``|1 - k t|`` (OpenDRIVE 9, 10 and 11.6).
Nothing here uses the product's evaluation. A lane owns its patch and what is painted on it or
stands on it; which lane that is, outlines tell that are evaluated here, too. Roads written here
have areas in closed form. Of files, roads are left out whose reference line does not hold together
(gaps, kinks, lengths that are not those of the curves), as the formulas overlap there, and lanes
that other roads cross.
"""

import csv
import math
import os
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
import shapely
from lxml import etree
from scipy.integrate import quad

from envgen_usd.opendrive.reader import read_network
from envgen_usd.opendrive.surface import build_surface

STEP = 0.1
ACROSS = (np.arange(40) + 0.5) / 40
COARSE = 5
"""Every so many samples an outline has a point."""
FINE = 0.05
"""Metres between the nodes along which a reference line is integrated."""
LARGEST = 1_000_000
"""Bytes; larger files take minutes. They are judged, too, where ENVGEN_ALL_FILES is set."""
WIDEST_LAND, STRIP = 4.0, 2.0
"""An outermost lane of type none has no content by the standard: of one wider than the first figure
only the second one is road, metres."""
LAND = ("none", "border")
"""Types of lanes of land beside a road."""
BESIDE = 5.0
"""Metres from a deck within which a lane of land is beside the bridge."""
ON_LANES = ("mark", "kerb_stone", "crosswalk", "island", "parking", "road_surface")
"""Kinds of patches that lie on lanes."""
MORE = {
    "asam_ex16/UC_2Lane-RoundAbout-3Arms",
    "asam_osc/fabriksgatan",
    "carla_test/Town01",
    "carla_test/Town03",
    "carla_test/Town04",
    "crdesigner/four_way_crossing",
    "esmini/e6mini",
    "malidrive/SmallTownRoads",
    "scenic/Town10HD_0910",
    "xodrpy/Crossing8Course",
}
"""Files that break the schema of their revision in ways that do not touch lanes."""
BROKEN = (
    "plan_view.gap",
    "plan_view.kink",
    "plan_view.s_gap",
    "plan_view.arc_length",
    "plan_view.p_range",
    "plan_view.too_short",
    "road.length",
)
CORPUS = (
    Path(os.environ.get("ENVGEN_SHARED", Path(__file__).resolve().parents[3] / "shared")) / "corpus"
)


def valid_files():
    """Names of all files that their schema finds valid, and of those in MORE."""
    path = CORPUS / "manifest.tsv"
    if not path.exists():
        return []
    with path.open() as text:
        rows = list(csv.DictReader(text, delimiter="\t", quoting=csv.QUOTE_NONE))
    names = [(row["file"].removesuffix(".xodr"), row["xsd"]) for row in rows]
    valid = [name for name, verdict in names if verdict == "valid" or name in MORE]
    large = os.environ.get("ENVGEN_ALL_FILES")
    return [n for n in valid if large or (CORPUS / f"{n}.xodr").stat().st_size <= LARGEST]


def polynomial(elements, start, s, shift=0.0):
    """Value at each s of the polynomials of elements that begin at attribute `start`."""
    value = np.zeros_like(s)
    for element in sorted(elements, key=lambda e: float(e.get(start))):
        begin = float(element.get(start)) + shift
        ds = s - begin
        a, b, c, d = (float(element.get(name)) for name in "abcd")
        value = np.where(ds >= -1e-9, a + b * ds + c * ds**2 + d * ds**3, value)
    return value


def speed_and_curvature(geometry, ds):
    length = float(geometry.get("length"))
    (kind,) = [child for child in geometry if child.tag != "userData"][:1]
    if kind.tag == "arc":
        return np.ones_like(ds), np.full_like(ds, float(kind.get("curvature")))
    if kind.tag == "spiral":
        first, last = float(kind.get("curvStart")), float(kind.get("curvEnd"))
        return np.ones_like(ds), first + (last - first) * ds / length
    if kind.tag == "paramPoly3":
        whole = length if kind.get("pRange") == "arcLength" else 1.0
        p, rate = ds / length * whole, whole / length
        du, dv = (
            rate
            * (
                float(kind.get("b" + k))
                + 2 * float(kind.get("c" + k)) * p
                + 3 * float(kind.get("d" + k)) * p**2
            )
            for k in "UV"
        )
        ddu, ddv = (
            rate**2 * (2 * float(kind.get("c" + k)) + 6 * float(kind.get("d" + k)) * p)
            for k in "UV"
        )
        speed = np.hypot(du, dv)
        return speed, (du * ddv - dv * ddu) / speed**3
    if kind.tag == "poly3":
        _, b, c, d = (float(kind.get(name)) for name in "abcd")
        u = np.linspace(0, 1.01 * length, 20_000)
        slope = b + 2 * c * u + 3 * d * u**2
        along = np.concatenate([[0], np.cumsum(np.hypot(1, (slope[1:] + slope[:-1]) / 2))]) * u[1]
        u = np.interp(ds, along, u)
        slope = b + 2 * c * u + 3 * d * u**2
        return np.ones_like(ds), (2 * c + 6 * d * u) / np.hypot(1, slope) ** 3
    assert kind.tag == "line"
    return np.ones_like(ds), np.zeros_like(ds)


def start_of(geometry):
    """Place and direction of a geometry's first point; cubics may begin beside their start."""
    x, y, heading = (float(geometry.get(name)) for name in ("x", "y", "hdg"))
    (kind,) = [child for child in geometry if child.tag != "userData"][:1]
    u, v, along, across = 0.0, 0.0, 1.0, 0.0
    if kind.tag == "paramPoly3":
        u, v, along, across = (float(kind.get(name)) for name in ("aU", "aV", "bU", "bV"))
    elif kind.tag == "poly3":
        v, across = float(kind.get("a")), float(kind.get("b"))
    c, s = math.cos(heading), math.sin(heading)
    return x + c * u - s * v, y + s * u + c * v, heading + math.atan2(across, along)


def course(geometry, ds):
    """Places, N x 2, and directions, N, by integration of the curvature."""
    length = float(geometry.get("length"))
    count = max(math.ceil(length / FINE), 20)
    step = length / count
    nodes = np.arange(count + 1) * step
    speed, curvature = speed_and_curvature(geometry, nodes[:-1] + step / 2)
    x, y, heading = start_of(geometry)
    turned = heading + np.append(0.0, np.cumsum(speed * curvature * step))
    middle = (turned[1:] + turned[:-1]) / 2
    xs = x + np.append(0.0, np.cumsum(speed * np.cos(middle) * step))
    ys = y + np.append(0.0, np.cumsum(speed * np.sin(middle) * step))
    plan = np.column_stack([np.interp(ds, nodes, xs), np.interp(ds, nodes, ys)])
    return plan, np.interp(ds, nodes, turned)


def reference_line(road, s):
    """Speed, curvature, places (N x 2) and directions at each s."""
    speed, curvature = np.ones_like(s), np.zeros_like(s)
    plan, heading = np.zeros((len(s), 2)), np.zeros_like(s)
    for geometry in road.iterfind("planView/geometry"):
        begin, length = float(geometry.get("s")), float(geometry.get("length"))
        inside = (s >= begin) & (s <= begin + length)
        ds = s[inside] - begin
        speed[inside], curvature[inside] = speed_and_curvature(geometry, ds)
        plan[inside], heading[inside] = course(geometry, ds)
    return speed, curvature, plan, heading


class LaneArea(NamedTuple):
    """A lane of a section by the formulas."""

    area: float
    folds: bool
    outline: shapely.Polygon
    kind: str


def lane_areas(road):
    """Lanes by (start of their section, lane)."""
    found = {}
    sections = sorted(road.iterfind("lanes/laneSection"), key=lambda e: float(e.get("s")))
    starts = [float(section.get("s")) for section in sections]
    for index, section in enumerate(sections):
        end = starts[index + 1] if index + 1 < len(starts) else float(road.get("length"))
        count = max(math.ceil((end - starts[index]) / STEP), 500)
        step = (end - starts[index]) / count
        s = starts[index] + (np.arange(count) + 0.5) * step
        speed, curvature, plan, heading = reference_line(road, s)
        tilt = tilts(road, s, step)
        centre = polynomial(road.iterfind("lanes/laneOffset"), "s", s)
        if road.find("lanes/laneSection/*/lane/border") is not None:
            centre = np.zeros_like(s)  # the standard allows no offset beside borders
        for side, sign in (("left", 1.0), ("right", -1.0)):
            inner = centre
            lanes = section.findall(f"{side}/lane")
            lanes = sorted(lanes, key=lambda e: abs(int(e.get("id"))))
            for lane in lanes:
                outer = outer_border(lane, s, (starts[index], inner, sign))
                widest = np.abs(outer - inner).max()
                if lane is lanes[-1] and lane.get("type") == "none" and widest > WIDEST_LAND:
                    outer = inner + np.clip(outer - inner, -STRIP, STRIP)
                t = inner + (outer - inner) * ACROSS[:, None]
                stretched = jacobian(t, speed, curvature, tilt)
                size = float((np.abs(outer - inner) * np.abs(stretched).mean(axis=0)).sum() * step)
                folds = bool((stretched < 0).any())
                borders = [beside(plan, heading, t, tilt) for t in (inner, outer)]
                key = round(starts[index], 3), int(lane.get("id"))
                found[key] = LaneArea(size, folds, outline_of(*borders), lane.get("type"))
                inner = outer
    return found


def beside(plan, heading, t, tilt):
    """Places in plan of ``t (cos r n - sin r sin p f)``, N x 2; see `jacobian`."""
    roll, _, pitch, _ = tilt
    forward = np.column_stack([np.cos(heading), np.sin(heading)])
    normal = np.column_stack([-np.sin(heading), np.cos(heading)])
    across, back = np.cos(roll), -np.sin(roll) * np.sin(pitch)
    return plan + (t * across)[:, None] * normal + (t * back)[:, None] * forward


def outline_of(inner, outer):
    """Outline of a lane from points of its borders half a step from either end and in between."""
    sides = []
    for side in (inner, outer):
        first, last = 1.5 * side[[0, -1]] - 0.5 * side[[1, -2]]
        sides.append(np.vstack([first, side[::COARSE], side[-1], last]))
    return shapely.Polygon(np.concatenate([sides[0], sides[1][::-1]])).buffer(0)


def outer_border(lane, s, beside):
    """By width, else by border, never on the other side of the inner border."""
    start, inner, sign = beside
    if lane.find("width") is None and lane.find("border") is not None:
        border = polynomial(lane.iterfind("border"), "sOffset", s, start)
        return sign * np.maximum(sign * border, sign * inner)
    return inner + sign * np.maximum(polynomial(lane.iterfind("width"), "sOffset", s, start), 0)


def tilts(road, s, step):
    """Roll and pitch, and how fast they change."""
    roll = polynomial(road.iterfind("lateralProfile/superelevation"), "s", s)
    height = polynomial(road.iterfind("elevationProfile/elevation"), "s", s)
    pitch = np.arctan(np.gradient(height, step))
    return roll, np.gradient(roll, step), pitch, np.gradient(pitch, step)


def jacobian(t, speed, curvature, tilt):
    """Area in plan by s and t of the point ``t (cos r n - sin r sin p f)`` beside the line.

    A cross-section that is turned by the roll r about a line that climbs by the pitch p moves
    against the direction f of travel as well as along the normal n.
    """
    roll, roll_rate, pitch, pitch_rate = tilt
    across, back = np.cos(roll), -np.sin(roll) * np.sin(pitch)
    across_rate = -t * np.sin(roll) * roll_rate
    back_rate = -t * (
        np.cos(roll) * roll_rate * np.sin(pitch) + np.sin(roll) * np.cos(pitch) * pitch_rate
    )
    forward = speed * (1 - curvature * t * across) + back_rate
    sideways = across_rate + t * back * curvature * speed
    return forward * across - sideways * back


def built_areas(surface, starts, lanes):
    """Area of each lane of a surface, with what lies on it.

    Args:
        surface: The surface.
        starts: Start of each section by road.
        lanes: Lanes by road, start of their section, and lane.
    """
    corners = surface.vertices[surface.triangles][..., :2]
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]) / 2
    total = np.bincount(surface.triangle_patch, area, minlength=len(surface.patches))
    found = dict.fromkeys(lanes, 0.0)
    for patch, size in zip(surface.patches, total, strict=True):
        if patch.kind == "lane":
            key = patch.road, round(starts[patch.road][patch.section], 3), patch.lane
            found[key] = found.get(key, 0.0) + size
    above = np.array([patch.kind in ON_LANES for patch in surface.patches])[surface.triangle_patch]
    places = shapely.points(corners[above].mean(axis=1))
    # A query prepares the shapes it asks for: the outlines, which have many corners.
    outlines = np.array([lane.outline for lane in lanes.values()], dtype=object)
    lane, place = shapely.STRtree(places).query(outlines, "intersects")
    more = np.bincount(lane, area[above][place], minlength=len(lanes))
    for name, size in zip(lanes, more.tolist(), strict=True):
        found[name] += size
    return found


def area_on(surface, ground):
    """Area in plan of the triangles that lie on some ground."""
    corners = surface.vertices[surface.triangles][..., :2]
    shapely.prepare(ground)
    inside = shapely.contains_xy(ground, corners.mean(axis=1))
    return shapely.area(shapely.polygons(corners[inside])).sum()


def crossed(surface, network, lanes, broken):
    """Lanes that lanes of other roads overlap; of broken roads the built surface tells."""
    names = list(lanes)
    outlines = np.array([lanes[name].outline for name in names], dtype=object)
    tree = shapely.STRtree(outlines)
    found = set()
    for one, two in tree.query(outlines, "intersects").T:
        if names[one][0] != names[two][0]:
            common = shapely.intersection(outlines[one], outlines[two]).area
            if common > 2e-3 * outlines[one].area:
                found.add(names[one])
    other = np.array([patch.road in broken for patch in surface.patches])[surface.triangle_patch]
    corners = surface.vertices[surface.triangles[other], :2]
    places = shapely.points(corners.mean(axis=1))
    on_broken = shapely.STRtree(places).query(outlines, "intersects")[0]
    found |= {names[lane] for lane in on_broken.tolist()}
    unknown = {network.roads[name].junction for name in broken & set(network.roads)} - {""}
    return found | {name for name in names if network.roads[name[0]].junction in unknown}


def beside_bridges(surface, lanes):
    """Lanes of land beside a deck: no bridge carries them."""
    is_deck = np.array([patch.kind == "deck" for patch in surface.patches])[surface.triangle_patch]
    tree = shapely.STRtree(shapely.linearrings(surface.vertices[surface.triangles[is_deck], :2]))
    land = [key for key, lane in lanes.items() if lane.kind in LAND]
    outlines = np.array([lanes[key].outline for key in land], dtype=object)
    near = tree.query(outlines, "dwithin", distance=BESIDE)[0]
    return {land[number] for number in near.tolist()}


@pytest.mark.parametrize("name", valid_files())
def test_every_lane_has_the_area_of_the_formulas(name):
    path = CORPUS / f"{name}.xodr"
    network = read_network(path)
    broken = {
        issue.where.split("]")[0].removeprefix("road[id=")
        for issue in network.issues
        if issue.kind in BROKEN
    }
    lanes = {
        (road.get("id"), *key): lane
        for road in etree.parse(path).getroot().iterfind("road")
        if road.get("id") in network.roads and road.get("id") not in broken
        for key, lane in lane_areas(road).items()
    }
    surface = build_surface(network)
    starts = {road.id: [section.s for section in road.sections] for road in network.roads.values()}
    built = built_areas(surface, starts, lanes)
    covered = crossed(surface, network, lanes, broken)
    covered |= beside_bridges(surface, lanes)
    judged = {
        key: lane.area
        for key, lane in lanes.items()
        if lane.area > 1.0 and not lane.folds and key not in covered
    }
    if not judged:
        pytest.skip("no lane has an area that the formulas tell")
    if not broken and not surface.triangle_level.any():
        # Lanes that cross, as in junctions, share their ground: all of it is there, and once.
        ground = shapely.union_all([lane.outline for lane in lanes.values()])
        assert area_on(surface, ground) == pytest.approx(ground.area, rel=2e-3)
    assert {key: built[key] for key in judged} == pytest.approx(judged, rel=0.01, abs=0.05)


EVERYWHERE = shapely.box(-1e6, -1e6, 1e6, 1e6)
LENGTH = 100.0
TURN = 0.02
"""Curvature of the arcs, and of the end of the spirals, 1/m."""
MARKS = '<roadMark sOffset="0" type="{}" color="standard" width="0.12"/>'
LINE, ARC, SPIRAL = (
    f'<geometry s="0" x="3.3" y="-7.1" hdg="0.3" length="{LENGTH}">{curve}</geometry>'
    for curve in (
        "<line/>",
        f'<arc curvature="{TURN}"/>',
        f'<spiral curvStart="0" curvEnd="{TURN}"/>',
    )
)
CUBIC = (2.5, 0.03, 0.0006, -7e-6)
"""Coefficients of a width, or of an offset of lanes, over s."""
LATE = (0.0, 0.0, 0.004, -4e-5)
"""Coefficients of an offset that would be far from 0 before its begin."""
ROLL = (0.0, 0.004)
"""Coefficients of a superelevation, up to 23 degrees."""


def value(coefficients, s):
    return sum(factor * s**power for power, factor in enumerate(coefficients))


def written(name, coefficients, start="sOffset"):
    a, b, c, d = (*coefficients, 0.0, 0.0, 0.0)[:4]
    return f'<{name} {start}="0" a="{a}" b="{b}" c="{c}" d="{d}"/>'


def lanes_of(widths, offset="", mark="solid", name="width"):
    """A lane section from the widths of its lanes, which all have a mark at their outer border."""
    sides = {"left": "", "right": ""}
    for number in sorted(widths, reverse=True):
        sides["left" if number > 0 else "right"] += (
            f'<lane id="{number}" type="driving">{written(name, widths[number])}'
            f"{MARKS.format(mark)}</lane>"
        )
    centre = f'<lane id="0" type="none">{MARKS.format("solid solid")}</lane>'
    return (
        f'{offset}<laneSection s="0"><left>{sides["left"]}</left><center>{centre}</center>'
        f"<right>{sides['right']}</right></laneSection>"
    )


def between(inner, outer, curvature=0.0):
    """Area of a strip between t of two borders at a place where a line has a curvature."""
    return abs((outer - inner) - curvature * (outer**2 - inner**2) / 2)


def integral(density):
    return quad(density, 0.0, LENGTH, epsabs=1e-9)[0]


CASES = {
    "straight": (
        {"plan_view": LINE, "lanes": lanes_of({1: (3.5,), -1: (3.0,), -2: (2.0,)})},
        {1: 350.0, -1: 300.0, -2: 200.0},
    ),
    "arc": (
        {"plan_view": ARC, "lanes": lanes_of({1: (3.5,), -1: (3.0,), -2: (2.0,)}, mark="broken")},
        {
            1: LENGTH * between(0.0, 3.5, TURN),
            -1: LENGTH * between(0.0, -3.0, TURN),
            -2: LENGTH * between(-3.0, -5.0, TURN),
        },
    ),
    # The area is linear in the curvature, whose mean is half of that at the end.
    "spiral": (
        {"plan_view": SPIRAL, "lanes": lanes_of({1: (3.5,), -1: (3.0,)})},
        {
            1: LENGTH * between(0.0, 3.5, TURN / 2),
            -1: LENGTH * between(0.0, -3.0, TURN / 2),
        },
    ),
    "cubic width": (
        {"plan_view": LINE, "lanes": lanes_of({1: CUBIC, -1: (3.0,)})},
        {
            1: sum(factor * LENGTH ** (n + 1) / (n + 1) for n, factor in enumerate(CUBIC)),
            -1: 300.0,
        },
    ),
    "cubic width of an inner lane of an arc": (
        {"plan_view": ARC, "lanes": lanes_of({-1: CUBIC, -2: (3.0,)})},
        {
            -1: integral(lambda s: between(0.0, -value(CUBIC, s), TURN)),
            -2: integral(lambda s: between(-value(CUBIC, s), -value(CUBIC, s) - 3.0, TURN)),
        },
    ),
    "cubic border of a spiral": (
        {"plan_view": SPIRAL, "lanes": lanes_of({1: CUBIC}, name="border")},
        {1: integral(lambda s: between(0.0, value(CUBIC, s), TURN * s / LENGTH))},
    ),
    "lane offset on an arc": (
        {
            "plan_view": ARC,
            "lanes": lanes_of({1: (3.5,), -1: (3.0,)}, written("laneOffset", CUBIC, "s")),
        },
        {
            1: integral(lambda s: between(value(CUBIC, s), value(CUBIC, s) + 3.5, TURN)),
            -1: integral(lambda s: between(value(CUBIC, s), value(CUBIC, s) - 3.0, TURN)),
        },
    ),
    "lane offset that begins late on an arc": (
        {
            "plan_view": ARC,
            "lanes": lanes_of({1: (3.5,)}, written("laneOffset", LATE, "s").replace('"0"', '"40"')),
        },
        {
            1: 40.0 * between(0.0, 3.5, TURN)
            + quad(lambda s: between(value(LATE, s), value(LATE, s) + 3.5, TURN), 0.0, 60.0)[0]
        },
    ),
    "growing superelevation": (
        {
            "plan_view": LINE,
            "lanes": lanes_of({1: (3.5,), -1: (3.0,)}),
            "lateral": written("superelevation", ROLL, "s"),
        },
        {
            1: 3.5 * math.sin(ROLL[1] * LENGTH) / ROLL[1],
            -1: 3.0 * math.sin(ROLL[1] * LENGTH) / ROLL[1],
        },
    ),
    "superelevation on an arc": (
        {
            "plan_view": ARC,
            "lanes": lanes_of({1: (3.5,), -1: (3.0,)}),
            "lateral": written("superelevation", (0.3,), "s"),
        },
        {
            lane: LENGTH * between(0.0, t * math.cos(0.3), TURN)
            for lane, t in ((1, 3.5), (-1, -3.0))
        },
    ),
    "a crosswalk over all lanes": (
        {
            "plan_view": ARC,
            "lanes": lanes_of({1: (3.5,), -1: (3.0,)}),
            "rest": '<objects><object id="1" type="crosswalk" s="50" t="0" zOffset="0"><outline>'
            + "".join(
                f'<cornerRoad s="{s}" t="{t}" dz="0" height="0"/>'
                for s, t in ((48, -2.5), (52, -2.5), (52, 3), (48, 3))
            )
            + "</outline></object></objects>",
        },
        {1: LENGTH * between(0.0, 3.5, TURN), -1: LENGTH * between(0.0, -3.0, TURN)},
    ),
}
"""Parts of a road, and the area of each lane."""


@pytest.mark.parametrize("name", CASES)
def test_lanes_of_known_roads_have_their_areas(road_xml, xodr_reader, name):
    parts, expected = CASES[name]
    network = xodr_reader(**parts)
    lanes = {
        ("1", *key): lane for key, lane in lane_areas(etree.fromstring(road_xml(**parts))).items()
    }
    surface = build_surface(network, tolerance=0.002)
    built = built_areas(surface, {"1": [0.0]}, lanes)
    for number, area in expected.items():
        assert lanes["1", 0.0, number].area == pytest.approx(area, rel=1e-5)
        assert built["1", 0.0, number] == pytest.approx(area, rel=5e-4), number
    # What is left belongs to no lane: there is nothing else on the ground.
    assert sum(built.values()) == pytest.approx(area_on(surface, EVERYWHERE), rel=1e-6)


@pytest.mark.parametrize("junction", ["-1", "5"])
def test_roads_that_cross_share_the_ground(network_of, road_xml, junction):
    """The square in the middle is there once: it belongs to a lane, or to the junction."""
    lanes = lanes_of({1: (3.5,), -1: (3.5,)}, mark="none").replace("solid solid", "none")
    across = LINE.replace('hdg="0.3"', f'hdg="{0.3 + math.pi / 2}"').replace(
        'x="3.3" y="-7.1"',
        f'x="{3.3 + 50 * (math.cos(0.3) + math.sin(0.3))}" '
        f'y="{-7.1 + 50 * (math.sin(0.3) - math.cos(0.3))}"',
    )
    network = network_of(
        "".join(
            road_xml(name, plan_view=view, lanes=lanes, attributes=f'junction="{junction}"')
            for name, view in (("1", LINE), ("2", across))
        )
        + ('<junction id="5" name=""/>' if junction == "5" else "")
    )
    surface = build_surface(network)
    area = dict.fromkeys(("lane", "junction"), 0.0)
    corners = surface.vertices[surface.triangles][..., :2]
    for owner, size in zip(
        surface.triangle_patch, shapely.area(shapely.polygons(corners)), strict=True
    ):
        area[surface.patches[owner].kind] += size
    square = 49.0 if junction == "5" else 0.0
    assert area["junction"] == pytest.approx(square, abs=0.05)
    assert area["lane"] == pytest.approx(2 * 700.0 - 49.0 - square, abs=0.05)
