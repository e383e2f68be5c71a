"""Vehicles of the shipped library: sizes of real ones, closed bodies, wheels that can turn."""

from functools import cache

import numpy as np
import pytest
from PIL import Image
from pxr import Usd, UsdGeom, UsdShade

from envgen_usd.assets.asset_catalogue import read_catalogue

LIBRARY = read_catalogue()
LENGTHS = {
    "small": (3.4, 3.8), "hatchback": (4.1, 4.5), "sedan": (4.5, 5.0), "estate": (4.5, 5.0),
    "suv": (4.3, 4.9), "van": (4.8, 5.4), "high_van": (5.5, 6.0), "pickup": (5.1, 5.5),
    "taxi": (4.5, 5.0),
    "police": (4.5, 5.0), "lorry": (8.0, 12.0), "articulated": (15.5, 16.6), "city": (11.9, 12.1),
    "five_section": (28.0, 32.0),
}  # fmt: skip
"""Least and largest length by body, metres: makers' data sheets and EU Directive 96/53/EC."""
CLASSES = {"car": "car", "truck": "truck", "bus": "bus", "tram": "train"}
BODIES = [(name, body) for name in CLASSES for body in LIBRARY.assets[name].variants["body"]]
SKIN = {
    *("Body", "LiveryBody", "Bumpers", "LiveryBumpers", "Stripe", "Panes", "Trim", "Gaps"),
    *("Grille", "HeadLamps", "LampHousings", "TailLamps", "Indicators", "Underbody"),
}
"""Meshes that close a body together."""


@cache
def opened(name, **chosen):
    """The stage of an asset with variants; kept, since prims end with their stage."""
    stage = Usd.Stage.Open(str(LIBRARY.folder / LIBRARY.assets[name].path))
    stage.SetEditTarget(stage.GetSessionLayer())
    for variants, variant in chosen.items():
        stage.GetDefaultPrim().GetVariantSet(variants).SetVariantSelection(variant)
    return stage


def drawn(stage):
    """Near meshes by name."""
    found = [UsdGeom.Mesh(prim) for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)]
    return {m.GetPrim().GetName(): m for m in found if m.ComputePurpose() != "proxy"}


def points_of(mesh):
    return np.asarray(mesh.GetPointsAttr().Get(), float)


@pytest.mark.parametrize(("name", "body"), BODIES)
def test_vehicles_have_the_size_of_real_ones(name, body):
    assert LIBRARY.assets[name].label == CLASSES[name]
    points = np.concatenate([points_of(mesh) for mesh in drawn(opened(name, body=body)).values()])
    low, high = points.min(axis=0), points.max(axis=0)
    assert LENGTHS[body][0] <= high[0] - low[0] <= LENGTHS[body][1]
    np.testing.assert_allclose((low + high)[:2] / 2, 0.0, atol=0.05)
    assert high[2] <= 4.0
    skin = [m for n, m in drawn(opened(name, body=body)).items() if n in {"Body", "LiveryBody"}]
    width = np.ptp(np.concatenate([points_of(mesh) for mesh in skin])[:, 1])
    least, most = {"high_van": (1.95, 2.05)}.get(
        body, (1.6, 1.95) if name == "car" else (2.45, 2.66)
    )
    assert least <= width <= most


@pytest.mark.parametrize(("name", "body"), BODIES)
def test_wheels_stand_on_the_ground_and_turn_about_their_centres(name, body):
    stage = opened(name, body=body)
    data = stage.GetDefaultPrim().GetCustomData()
    centres, radius = np.array(data["wheel_centres"]), data["wheel_radius"]
    tyres = [points_of(m) for n, m in drawn(stage).items() if n.startswith("Wheel")]
    assert len(tyres) == len(centres)
    assert 0.28 <= radius <= 0.52
    for centre in centres:
        nearest = min(tyres, key=lambda each: np.linalg.norm(each.mean(axis=0) - centre))
        assert abs(nearest[:, 2].min()) < 0.002
        away = np.hypot(*(nearest - centre)[:, [0, 2]].T)
        assert away.max() == pytest.approx(radius, abs=1e-3)
        # Turned by a step of its corners, it is where it was.
        turned = np.angle((nearest - centre)[:, 0] + 1j * (nearest - centre)[:, 2])
        outer = np.sort(turned[away > radius - 1e-3])
        steps = np.unique(np.round(np.diff(outer), 3))
        assert len(steps[steps > 0.01]) == 1


@pytest.mark.parametrize(("name", "body"), BODIES)
def test_bodies_are_closed(name, body):
    """Each edge of the skin has two faces that run through it in opposite directions."""
    skin = [mesh for n, mesh in drawn(opened(name, body=body)).items() if n in SKIN]
    corners = [
        points_of(mesh)[np.asarray(mesh.GetFaceVertexIndicesAttr().Get())].reshape(-1, 3, 3)
        for mesh in skin
    ]
    keys = np.round(np.concatenate(corners).reshape(-1, 3) / 2e-5).astype(int)
    _, index = np.unique(keys, axis=0, return_inverse=True)
    triangles = index.reshape(-1, 3)
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    edges = edges[edges[:, 0] != edges[:, 1]]
    count = int(index.max()) + 1
    forth, back = edges @ [count, 1], edges @ [1, count]
    # Single precision splits a few points between cells of the comparison.
    assert np.isin(forth, back).mean() > 0.995


@pytest.mark.parametrize(("name", "body"), BODIES)
def test_no_edge_has_more_than_two_faces(name, body):
    """Slivers between points that are nearly one would fold the mesh."""
    stage = opened(name, body=body)
    for prim in filter(lambda prim: prim.IsA(UsdGeom.Mesh), stage.Traverse()):
        mesh = UsdGeom.Mesh(prim)
        sizes = np.asarray(mesh.GetFaceVertexCountsAttr().Get())
        corners = np.asarray(mesh.GetFaceVertexIndicesAttr().Get())
        ends = np.cumsum(sizes)
        following = np.arange(1, len(corners) + 1)
        following[ends - 1] = ends - sizes
        edges = np.sort(np.stack([corners, corners[following]], axis=1), axis=1)
        faces = np.unique(edges, axis=0, return_counts=True)[1]
        assert faces.max() <= 2, prim.GetPath()


@pytest.mark.parametrize("name", CLASSES)
def test_parts_of_vehicles_are_labelled(name):
    found = {
        str(mesh.GetPrim().GetAttribute("semantics:labels:part").Get()[0])
        for mesh in drawn(opened(name)).values()
    }
    needed = {"bodywork", "wheel", "headlamp", "tail_lamp", "indicator", "pane"}
    assert needed <= found
    if name == "truck":
        assert "cargo" in found
    if name == "car":
        assert {"number_plate", "bumper", "mirror"} <= found


@pytest.mark.parametrize("name", CLASSES)
def test_lights_and_paints_change_near_and_far_meshes(name):
    def bound(path, **chosen):
        prim = opened(name, **chosen).GetPrimAtPath(f"/{name}/Geometry/{path}")
        return UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()[0].GetPrim().GetName()

    for path in ("HeadLamps", "Far/HeadLamps"):
        assert bound(path, lights="off") == "lens_clear"
        assert bound(path, lights="on") == "lens_clear_lit"
    for path in ("Body", "Far/Paint"):
        for paint in LIBRARY.assets[name].variants["paint"]:
            assert bound(path, paint=paint) == f"car_{paint}"


@pytest.mark.parametrize("body", ["taxi", "police"])
def test_liveries_have_no_other_paint(body):
    looks = set()
    for paint in ("red", "black"):
        stage = opened("car", body=body, paint=paint)
        prim = stage.GetPrimAtPath("/car/Geometry/LiveryBody")
        looks.add(UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()[0].GetPrim().GetName())
    assert len(looks) == 1


@pytest.mark.parametrize(("name", "body"), BODIES)
def test_one_far_mesh_stands_for_all_parts(name, body):
    stage = opened(name, body=body)
    far = stage.GetPrimAtPath(f"/{name}/Geometry/Far")
    for mesh in drawn(stage).values():
        assert UsdGeom.Imageable(mesh).GetProxyPrimRel().GetTargets() == [far.GetPath()]
    sizes = np.asarray(UsdGeom.Mesh(far).GetFaceVertexCountsAttr().Get())
    assert (sizes - 2).sum() <= (410 if name != "tram" else 680)
    subsets = UsdGeom.Subset.GetAllGeomSubsets(UsdGeom.Mesh(far))
    faces = np.concatenate([np.asarray(subset.GetIndicesAttr().Get()) for subset in subsets])
    assert sorted(faces.tolist()) == list(range(len(sizes)))


@pytest.mark.parametrize(("name", "body"), [("bus", "city"), ("tram", "five_section")])
def test_destinations_shine_above_the_windscreen(name, body):
    """Nothing of the front stands before the display, and what it says is the brightest there."""
    stage = opened(name, body=body)
    meshes = drawn(stage)
    shown = points_of(meshes["Display"])
    low, high = shown.min(axis=0), shown.max(axis=0)
    np.testing.assert_allclose(high - low, (0.0, 1.6, 0.22), atol=1e-4)
    assert low[2] > 2.4
    normals = UsdGeom.PrimvarsAPI(meshes["Display"]).GetPrimvar("normals").Get()
    np.testing.assert_allclose(normals, np.tile([1.0, 0.0, 0.0], (len(normals), 1)), atol=1e-6)
    skin = np.concatenate([points_of(meshes[part]) for part in ("Panes", "Trim", "Body")])
    front = skin[(np.abs(skin[:, 1]) < 0.3) & (skin[:, 0] > 0.4 * np.ptp(skin[:, 0]))]
    front = front[front[:, 2].argsort()]
    pane = np.interp((low[2], high[2]), front[:, 2], front[:, 0])
    assert (pane < low[0]).all()
    assert pane.max() > low[0] - 0.05
    look = UsdShade.MaterialBindingAPI(meshes["Display"].GetPrim()).ComputeBoundMaterial()[0]
    surface = look.ComputeSurfaceSource()[0]
    glow = surface.GetInput("emissiveColor").GetConnectedSource()[0].GetPrim()
    file = UsdShade.Shader(glow).GetInput("file").Get().resolvedPath
    pixels = np.asarray(Image.open(file), float)
    lit = pixels[pixels.shape[0] // 2 :].max(axis=2) > 128  # the lower half holds both faces
    assert 0.02 < lit.mean() < 0.3


@pytest.mark.parametrize("body", ["sedan", "van", "pickup"])
def test_each_pane_of_a_car_shows_its_picture_of_the_cabin(body):
    """Steering wheels are on the car's left, and in pictures of the sides the front is right."""
    mesh = drawn(opened("car", body=body))["Panes"]
    st = UsdGeom.PrimvarsAPI(mesh).GetPrimvar("st")
    uv = np.asarray(st.ComputeFlattened(), float)
    corners = np.asarray(mesh.GetFaceVertexIndicesAttr().Get())
    counts = np.asarray(mesh.GetFaceVertexCountsAttr().Get())
    points = points_of(mesh)[corners]
    face = np.repeat(np.arange(len(counts)), counts)
    middles = np.stack([np.bincount(face, axis) for axis in uv.T], axis=1) / counts[:, None]
    cells = np.floor(2.0 * middles).astype(int)[face]
    side = cells[:, 1] == 1
    assert (np.abs(points[side, 1]) > 0.5).all()
    screen = (cells == (0, 0)).all(axis=1)
    assert points[screen, 0].min() > points[(cells == (1, 0)).all(axis=1), 0].max(initial=-9.0)
    for chosen, across in ((screen, 1), (side & (cells[:, 0] == 0), 0)):
        # Both grow together, and the cell is filled.
        share = 2.0 * uv[chosen] - cells[chosen]
        axis = points[chosen][:, [across, 2]]
        low, high = axis.min(axis=0), axis.max(axis=0)
        np.testing.assert_allclose(
            (share.min(axis=0), share.max(axis=0)), ((0, 0), (1, 1)), atol=1e-5
        )
        np.testing.assert_allclose(share, (axis - low) / (high - low), atol=2e-3)
