"""Barns: gates, hardly any windows, one low roof over one storey, timber or metal."""

import numpy as np
import pytest
import shapely

from envgen_usd.chunks import Chunk
from envgen_usd.city.ground_heights import Ground
from envgen_usd.city.plots.mapped_buildings import build_mapped
from envgen_usd.environment_files import read_profile
from envgen_usd.models.ground import HeightMap
from envgen_usd.models.place import Houses

TOWN = read_profile("1", "residential").buildings
LARGE = shapely.box(40.0, 60.0, 64.0, 72.0)
SMALL = shapely.box(40.0, 60.0, 46.0, 65.0)
GROUND = Ground(HeightMap(Chunk(0, 0), np.zeros((256, 256))))
ROAD = np.array([[[0.0, 30.0], [100.0, 30.0], [100.0, 40.0]]])


def mapped(kind, shape=LARGE, **said):
    """A building of a map as a feature, and its openings by kind with their widths."""
    count = 1
    fields = {
        "footprints": np.array([shape], object),
        "heights": np.full(count, np.nan),
        "storeys": np.full(count, np.nan),
        "landuse": np.array([""]),
        "kinds": np.array([kind]),
        **dict.fromkeys(("roofs", "walls", "roofing"), np.array([""])),
        **{name: np.array([value]) for name, value in said.items()},
    }
    found = build_mapped(Houses(**fields), GROUND, ROAD, TOWN, 3)
    [building] = found.buildings
    surfaces = [
        inner for part in building.walk() for s in part.surfaces for inner in (s, *s.openings)
    ]
    widths = {}
    for surface in surfaces:
        if surface.kind in {"DoorSurface", "WindowSurface"}:
            span = np.ptp(surface.polygons.points[:, :2], axis=0)
            widths.setdefault(surface.kind, []).append(float(np.hypot(*span)))
    materials = {s.kind: s.material for s in surfaces}
    return building, widths, materials


@pytest.mark.parametrize("kind", ["barn", "farm_auxiliary", "stable", "cowshed", "shed"])
def test_a_barn_of_a_map_has_gates_and_a_large_roof(kind):
    building, widths, materials = mapped(kind)
    assert building.attributes["roofType"] != "1000"
    assert building.attributes["storeysAboveGround"] == 1
    assert building.attributes["class"] == "1090"
    assert max(widths["DoorSurface"]) > 3.0
    _, of_house, _ = mapped("house")
    assert len(widths["WindowSurface"]) < 0.6 * len(of_house["WindowSurface"])
    assert materials["WallSurface"] in TOWN.barns.materials
    assert materials["RoofSurface"] in TOWN.barns.roof_materials


def test_what_the_map_says_counts():
    building, _, materials = mapped("barn", walls="brick", roofs="flat")
    assert materials["WallSurface"].startswith("brick")
    assert building.attributes["roofType"] == "1000"


def test_a_small_shed_is_low():
    top = {
        name: max(
            surface.polygons.points[:, 2].max() for part in b.walk() for surface in part.surfaces
        )
        for name, (b, *_) in {"small": mapped("shed", SMALL), "large": mapped("shed")}.items()
    }
    assert top["small"] < 4.5 < top["large"]
