"""Area of every lane against an evaluation of its own, straight from the standard's formulas.

The area of a lane in plan is the integral over s and t of the Jacobian of its points: for a level
reference line of unit speed with curvature k that is ``|1 - k t|`` (OpenDRIVE 9, 10 and 11.6).
Nothing here uses the product's evaluation. Roads are left out whose reference line does not hold
together (gaps, kinks, lengths that are not those of the curves): there the formulas overlap.
"""

import csv
import math
import os
from pathlib import Path

import numpy as np
import pytest
from lxml import etree

from envgen_usd.opendrive.lane_surfaces import lane_surfaces
from envgen_usd.opendrive.reader import read_network

STEP = 0.1
ACROSS = (np.arange(40) + 0.5) / 40
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
    return [name for name, verdict in names if verdict == "valid" or name in MORE]


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
        tilt = tilts(road, s, step)
        centre = polynomial(road.iterfind("lanes/laneOffset"), "s", s)
        if road.find("lanes/laneSection/*/lane/border") is not None:
            centre = np.zeros_like(s)  # the standard allows no offset beside borders
        for side, sign in (("left", 1.0), ("right", -1.0)):
            inner = centre
            lanes = section.findall(f"{side}/lane")
            for lane in sorted(lanes, key=lambda e: abs(int(e.get("id")))):
                outer = outer_border(lane, s, (starts[index], inner, sign))
                t = inner + (outer - inner) * ACROSS[:, None]
                stretched = jacobian(t, speed, curvature, tilt)
                size = float((np.abs(outer - inner) * np.abs(stretched).mean(axis=0)).sum() * step)
                folds = bool((stretched < 0).any())
                areas[round(starts[index], 3), int(lane.get("id"))] = size, folds
                inner = outer
    return areas


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


@pytest.mark.parametrize("name", valid_files())
def test_every_lane_has_the_area_of_the_formulas(name):
    path = CORPUS / f"{name}.xodr"
    network = read_network(path)
    broken = {
        issue.where.split("]")[0].removeprefix("road[id=")
        for issue in network.issues
        if issue.kind in BROKEN
    }
    roads = [
        road
        for road in etree.parse(path).getroot().iterfind("road")
        if road.get("id") in network.roads and road.get("id") not in broken
    ]
    expected = {
        (road.get("id"), *key): area for road in roads for key, area in lane_areas(road).items()
    }
    usual = built_areas(network, tolerance=0.02)
    whole = sum(area for area, _ in expected.values())
    found = sum(area for key, area in usual.items() if key[0] not in broken)
    assert found == pytest.approx(whole, rel=2e-3, abs=1e-3)
    # Chords cut off a larger part of the narrowest curves; a finer tolerance tells them apart.
    fine = built_areas(network, tolerance=0.002)
    for key, (area, folds) in expected.items():
        if area > 1.0 and not folds:
            assert fine.get(key, 0.0) == pytest.approx(area, rel=0.01, abs=0.05), key
