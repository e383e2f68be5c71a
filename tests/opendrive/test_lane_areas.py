"""Area of every lane against an evaluation of its own, straight from the standard's formulas.

The area of a lane in plan is the integral over s and t of ``|1 - k t|`` for a reference line of
unit speed with curvature k (OpenDRIVE 9 and 11.6).
Nothing here uses the product's evaluation.
"""

import math

import numpy as np
import pytest
from lxml import etree

from envgen_usd.opendrive.lane_surfaces import lane_surfaces
from envgen_usd.opendrive.reader import read_network

STEP = 0.1
ACROSS = (np.arange(40) + 0.5) / 40
FILES = [
    "asam_ex16/Ex_Simple-LaneOffset",
    "asam_ex16/UC_2Lane-RoundAbout-3Arms",
    "asam_ex16/UC_ParamPoly3",
    "asam_ex16/UC_Simple-X-Junction",
    "asam_ex16/UC_Motorway-Exit-Entry",
    "asam_osc/fabriksgatan",
    "carla_test/Town01",
    "carla_test/Town03",
    "carla_test/Town04",
    "crdesigner/four_way_crossing",
    "esmini/e6mini",
    "esmini/curve_r100",
    "esmini/lane_offset_intersection",
    "malidrive/LongRoad",
    "malidrive/SmallTownRoads",
    "malidrive/TShapeRoad",
    "scenic/Town10HD_0910",
    "xodrpy/Crossing8Course",
]


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
    assert kind.tag == "line"
    return np.ones_like(ds), np.zeros_like(ds)


def reference_line(road, s):
    speed, curvature = np.ones_like(s), np.zeros_like(s)
    for geometry in road.iterfind("planView/geometry"):
        begin, length = float(geometry.get("s")), float(geometry.get("length"))
        inside = (s >= begin) & (s <= begin + length)
        speed[inside], curvature[inside] = speed_and_curvature(geometry, s[inside] - begin)
    return speed, curvature


def lane_areas(road):
    """Area in plan of each lane by (start of its section, lane), and whether the lane folds."""
    areas = {}
    sections = sorted(road.iterfind("lanes/laneSection"), key=lambda e: float(e.get("s")))
    starts = [float(section.get("s")) for section in sections]
    for index, section in enumerate(sections):
        end = starts[index + 1] if index + 1 < len(starts) else float(road.get("length"))
        count = max(math.ceil((end - starts[index]) / STEP), 500)
        step = (end - starts[index]) / count
        s = starts[index] + (np.arange(count) + 0.5) * step
        speed, curvature = reference_line(road, s)
        roll = polynomial(road.iterfind("lateralProfile/superelevation"), "s", s)
        centre = polynomial(road.iterfind("lanes/laneOffset"), "s", s)
        for side, sign in (("left", 1.0), ("right", -1.0)):
            inner = centre
            lanes = section.findall(f"{side}/lane")
            for lane in sorted(lanes, key=lambda e: abs(int(e.get("id")))):
                width = np.maximum(
                    polynomial(lane.iterfind("width"), "sOffset", s, starts[index]), 0
                )
                t = inner + sign * width * ACROSS[:, None]
                stretched = speed * (1 - curvature * t * np.cos(roll))
                bent = np.abs(stretched).mean(axis=0)
                size = float((width * np.cos(roll) * bent).sum() * step)
                folds = bool((stretched < 0).any())
                areas[round(starts[index], 3), int(lane.get("id"))] = size, folds
                inner = inner + sign * width
    return areas


def built_areas(network, tolerance):
    surfaces = lane_surfaces(network, tolerance)
    corners = surfaces.vertices[surfaces.triangles][..., :2]
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]) / 2
    total = np.bincount(surfaces.triangle_patch, area, minlength=len(surfaces.patches))
    return {
        (
            patch.road,
            round(network.roads[patch.road].sections[patch.section].s, 3),
            patch.lane,
        ): float(size)
        for patch, size in zip(surfaces.patches, total, strict=True)
    }


@pytest.mark.parametrize("name", FILES)
def test_every_lane_has_the_area_of_the_formulas(corpus, name):
    path = corpus / f"{name}.xodr"
    network = read_network(path)
    roads = list(etree.parse(path).getroot().iterfind("road"))
    expected = {
        (road.get("id"), *key): area for road in roads for key, area in lane_areas(road).items()
    }
    usual = built_areas(network, tolerance=0.02)
    whole = sum(area for area, _ in expected.values())
    assert sum(usual.values()) == pytest.approx(whole, rel=1e-3)
    # Chords cut off a larger part of the narrowest curves; a finer tolerance tells them apart.
    fine = built_areas(network, tolerance=0.002)
    for key, (area, folds) in expected.items():
        if area > 1.0 and not folds:
            assert fine.get(key, 0.0) == pytest.approx(area, rel=0.01, abs=0.05), key
