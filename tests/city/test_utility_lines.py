"""Poles along roads, and wires that hang between them."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st
from pxr import Usd, UsdGeom

from envgen_usd.assets.asset_catalogue import read_catalogue
from envgen_usd.city.generate import build_city, plan_city
from envgen_usd.city.plots.utility_lines import WIRE_FEET, catenary
from envgen_usd.layers.props_layer import write_props
from envgen_usd.models.city_model import City


@given(st.floats(5.0, 80.0), st.floats(-4.0, 4.0), st.floats(0.005, 0.05), st.floats(-3.0, 3.0))
def test_a_wire_is_a_catenary(span, rise, sag, heading):
    """Its slope follows y'' = sqrt(1 + y'^2) / a, and it hangs the sag below its chord."""
    start = np.array([3.0, -2.0, 7.0])
    end = start + np.array([span * np.cos(heading), span * np.sin(heading), rise])
    wire = catenary(start, end, sag, 400)
    np.testing.assert_allclose(wire[[0, -1]], [start, end], atol=1e-9)
    x = np.hypot(*(wire[:, :2] - start[:2]).T)
    step = span / 400
    slope = np.gradient(wire[:, 2], step)[1:-1]
    bend = np.diff(wire[:, 2], 2) / step**2
    np.testing.assert_allclose(bend, np.sqrt(1 + slope**2) * 8 * sag / span, rtol=2e-3)
    below = np.interp(span / 2, x, wire[:, 2]) - (start[2] + end[2]) / 2
    assert -below == pytest.approx(sag * span, rel=0.1 + 0.5 * abs(rise) / span)


@pytest.fixture(scope="module")
def lines(make_map, by_place, chunks):
    """What hangs and stands in both chunks, with a pole every 30 m."""
    scene = make_map("2", "residential")
    furniture = replace(scene.profile.furniture, utility_pole=30.0)
    profile = replace(scene.profile, furniture=furniture)
    cities = {}
    for chunk in chunks:
        plan = plan_city(chunk, (), by_place, scene.heights[chunk], profile, 0)
        cities[chunk] = build_city(plan, scene.landuse[chunk], profile, roads=False)
    return profile, cities


def named(city, kind):
    return {t.id: t for t in city.of_kind("CityFurniture") if t.id.startswith(kind)}


def test_wires_run_from_pole_to_pole_through_all_chunks(lines):
    _, cities = lines
    poles = {k: v for city in cities.values() for k, v in named(city, "utility_pole_").items()}
    wires = {k: v for city in cities.values() for k, v in named(city, "wire_").items()}
    assert len(poles) >= 12
    # The road is straight and free, so that all neighbours are joined.
    assert len(wires) == len(poles) - 1
    for name, span in wires.items():
        first = int(name.rsplit("_", 1)[1])
        for number, end in ((first, 0), (first + 1, -1)):
            foot = poles[f"utility_pole_7_{number}"].placement.position
            for wire, (aside, high) in zip(span.curves["lod2MultiCurve"], WIRE_FEET, strict=True):
                away = wire[end] - foot
                # The road runs along x, so that the arm lies along y.
                np.testing.assert_allclose(np.abs(away), [0.0, abs(aside), high], atol=2e-3)


def test_wires_leave_the_insulators_of_the_shipped_pole():
    asset = read_catalogue().assets["utility_pole"]
    stage = Usd.Stage.Open(str(read_catalogue().folder / asset.path))
    found = [UsdGeom.Mesh(p) for p in stage.Traverse() if p.IsA(UsdGeom.Mesh)]
    points = np.concatenate([np.asarray(mesh.GetPointsAttr().Get()) for mesh in found])
    for aside, high in WIRE_FEET:
        away = np.linalg.norm(points - [0.0, aside, high], axis=1).min()
        assert away < 0.1 or (abs(aside) < 0.13 and high < 7.0)
    assert asset.size({})[2] == pytest.approx(8.0, rel=0.05)


def test_wires_are_closed_tubes_of_their_own_part(lines, tmp_path):
    profile, cities = lines
    chunk, city = next(iter(cities.items()))
    spans = tuple(named(city, "wire_").values())
    path = tmp_path / "props.usdc"
    write_props(City(spans), chunk, profile, read_catalogue(), 0, path)
    stage = Usd.Stage.Open(str(path))
    prims = stage.GetPrimAtPath("/Props").GetChildren()
    assert {prim.GetName() for prim in prims} == {span.id for span in spans}
    for prim in prims:
        assert list(prim.GetAttribute("semantics:labels:class").Get()) == ["static"]
        assert list(prim.GetAttribute("semantics:labels:part").Get()) == ["wire"]
        mesh = UsdGeom.Mesh(prim)
        sizes = np.asarray(mesh.GetFaceVertexCountsAttr().Get())
        index = np.split(np.asarray(mesh.GetFaceVertexIndicesAttr().Get()), np.cumsum(sizes)[:-1])
        fans = [(f[0], f[i], f[i + 1]) for f in index for i in range(1, len(f) - 1)]
        solid = trimesh.Trimesh(np.asarray(mesh.GetPointsAttr().Get()), fans, process=False)
        assert solid.is_watertight
        assert solid.volume > 0.0
        assert len(solid.split()) == len(WIRE_FEET)
        # Outward normals.
        normals = np.asarray(mesh.GetNormalsAttr().Get())
        assert np.einsum("ij,ij->i", normals, solid.vertex_normals).min() > 0.2
