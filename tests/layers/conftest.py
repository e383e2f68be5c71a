"""A small made-up chunk: a straight street, a house, trees, lights."""

from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from tests.kept_work import kept

from envgen_usd.assets.asset_catalogue import Catalogue, read_catalogue
from envgen_usd.chunks import Chunk
from envgen_usd.environment_files import read_profile
from envgen_usd.layers.buildings_layer import write_buildings
from envgen_usd.layers.landuse_layer import write_landuse
from envgen_usd.layers.props_layer import write_props
from envgen_usd.layers.roads_layer import write_roads
from envgen_usd.layers.stage_composition import compose_stage
from envgen_usd.layers.terrain_layer import write_terrain
from envgen_usd.models.city_model import City, CityObject, Placement, ThematicSurface
from envgen_usd.models.environment_profile import Profile
from envgen_usd.models.ground import GroundMesh
from envgen_usd.models.landuse import LanduseClass, LanduseMap
from envgen_usd.models.polygon_arrays import Polygons
from envgen_usd.models.road_surface import RoadSurface

ROAD_Y = 100.0
KERB = 0.12
STEP = 5.0


def strip(chunk, y0, y1, z0, z1):
    """Quads of a strip along x, as triangles."""
    x = chunk.origin[0] + np.arange(0.0, 200.0 + STEP, STEP)
    y = chunk.origin[1]
    low = np.c_[x, np.full(len(x), y + y0), np.full(len(x), z0)]
    high = np.c_[x, np.full(len(x), y + y1), np.full(len(x), z1)]
    k = np.arange(len(x) - 1)
    n = len(x)
    triangles = np.concatenate([np.c_[k, k + 1, n + k + 1], np.c_[k, n + k + 1, n + k]])
    return Polygons.of_triangles(np.concatenate([low, high]), triangles)


def make_ground(chunk):
    """Level ground with a gap where the street is."""
    ys = np.concatenate([np.arange(0, 95, 5.0), [94.3], [105.7], np.arange(110, 201, 5.0)])
    xs = np.arange(0.0, 201.0, 5.0)
    x, y = np.meshgrid(xs, ys)
    vertices = np.stack(
        [x + chunk.origin[0], y + chunk.origin[1], np.where(np.abs(y - 100) < 6, KERB, 0.0)], -1
    )
    rows = [r for r in range(len(ys) - 1) if not (ys[r] > 94 and ys[r + 1] < 106)]
    r, c = np.meshgrid(rows, np.arange(len(xs) - 1), indexing="ij")
    width = len(xs)
    first = (r * width + c).reshape(-1)
    faces = np.c_[first, first + 1, first + width + 1, first + width]
    centre = vertices.reshape(-1, 3)[faces].mean(axis=1)[:, :2] - chunk.origin
    cell = np.clip((centre / 200.0 * 255).astype(np.int64), 0, 254)
    return GroundMesh(
        chunk,
        vertices.reshape(-1, 3),
        np.full(len(faces), 4),
        faces.reshape(-1),
        cell[:, 1] * 255 + cell[:, 0],
    )


def make_landuse(chunk):
    classes = np.full((255, 255), LanduseClass.GRASS, dtype=np.uint8)
    classes[115:142] = LanduseClass.VERGE
    classes[142:190, 60:200] = LanduseClass.LAWN
    classes[60:110, 100:200] = LanduseClass.RUBBLE
    return LanduseMap(chunk, classes, np.zeros((255, 255), dtype=np.int64))


def make_road(chunk):
    def area(name, kind, lane_type, polygons, **more):
        facts = {"opendrive_lane_type": lane_type, **more}
        surface = ThematicSurface(f"{name}_surface_{chunk.prim_name}", kind, polygons, 2)
        space = "TrafficSpace" if kind == "TrafficArea" else "AuxiliaryTrafficSpace"
        return CityObject(f"{name}_{chunk.prim_name}", space, facts, (surface,))

    x0, y0 = chunk.origin
    line = np.array([[x0, y0 + 98.2, 0.0], [x0 + 100, y0 + 98.2, 0.0], [x0 + 200, y0 + 98.2, 0.0]])
    right = area("lane_-1", "TrafficArea", "driving", strip(chunk, 96.3, 99.94, 0, 0))
    right = CityObject(
        right.id,
        right.kind,
        {**right.attributes, "speed": 13.9},
        right.surfaces,
        curves={"lod2MultiCurve": (line,)},
        relations={"successor": (f"lane_-1_chunk_{chunk.x + 1}_{chunk.y}",)},
    )
    left = area("lane_1", "TrafficArea", "driving", strip(chunk, 100.06, 103.7, 0, 0))
    mark = ThematicSurface(
        f"mark_{chunk.prim_name}",
        "Marking",
        strip(chunk, 99.94, 100.06, 0, 0),
        2,
        attributes={"colour": "white", "opendrive_lane_type": "driving"},
    )
    kerbs = [
        area("kerb_r", "AuxiliaryTrafficArea", "sidewalk", strip(chunk, 96.3, 96.3, KERB, 0),
             opendrive_kind="kerb"),
        area("kerb_l", "AuxiliaryTrafficArea", "sidewalk", strip(chunk, 103.7, 103.7, 0, KERB),
             opendrive_kind="kerb"),
    ]  # fmt: skip
    walks = [
        area("walk_r", "TrafficArea", "sidewalk", strip(chunk, 94.3, 96.3, KERB, KERB)),
        area("walk_l", "TrafficArea", "sidewalk", strip(chunk, 103.7, 105.7, KERB, KERB)),
    ]
    section = CityObject(
        f"section_{chunk.prim_name}",
        "Section",
        surfaces=(mark,),
        children=(right, left, *kerbs, *walks),
    )
    return CityObject(f"road_{chunk.prim_name}", "Road", children=(section,))


def rectangle(origin, along, up):
    origin, along, up = (np.asarray(v, dtype=float) for v in (origin, along, up))
    return np.stack([origin, origin + along, origin + along + up, origin + up])


def make_house(name, corner, size, storeys):
    """A box with a gabled roof; its front looks to -y and has windows and a door."""
    x, y, z = corner
    width, depth = size
    eaves = 3.0 * storeys
    ridge = eaves + 0.45 * depth
    windows, rings = [], []
    for storey in range(storeys):
        for column in range(int(width // 2.5)):
            low = (x + 0.8 + 2.5 * column, y, z + 3.0 * storey + 0.9)
            if storey == 0 and column == 0:
                ring = rectangle((low[0], y, z + 0.02), (1.1, 0, 0), (0, 0, 2.2))
                kind = "DoorSurface"
            else:
                ring = rectangle(low, (1.1, 0, 0), (0, 0, 1.4))
                kind = "WindowSurface"
            rings.append(ring)
            polygons = Polygons.of_rings([ring])
            windows.append(ThematicSurface(f"{name}_o{len(windows)}", kind, polygons, 3))
    front = rectangle((x, y, z), (width, 0, 0), (0, 0, eaves))
    points = np.concatenate([front, *(ring[::-1] for ring in rings)])
    offsets = np.arange(0, 4 * (len(rings) + 1) + 1, 4)
    holed = Polygons(points, offsets, np.array([0, len(rings) + 1]))
    back = Polygons.of_rings([rectangle((x + width, y + depth, z), (-width, 0, 0), (0, 0, eaves))])
    sides = []
    for x0, sign in ((x + width, 1), (x, -1)):
        ring = np.array(
            [[x0, y, z], [x0, y + depth, z], [x0, y + depth, z + eaves],
             [x0, y + depth / 2, z + ridge], [x0, y, z + eaves]]
        )  # fmt: skip
        sides.append(ring if sign > 0 else ring[::-1])
    slope = np.array([0, depth / 2, ridge - eaves])
    roofs = [
        rectangle((x, y, z + eaves), (width, 0, 0), slope),
        rectangle((x + width, y + depth, z + eaves), (-width, 0, 0), slope * [1, -1, 1]),
    ]
    base = rectangle((x, y, z), (0, depth, 0), (width, 0, 0))
    surfaces = (
        ThematicSurface(f"{name}_w0", "WallSurface", holed, 3, "brick_red", {}, tuple(windows)),
        ThematicSurface(f"{name}_w1", "WallSurface", back, 3, "brick_red"),
        ThematicSurface(f"{name}_w2", "WallSurface", Polygons.of_rings(sides), 3, "brick_red"),
        ThematicSurface(f"{name}_r", "RoofSurface", Polygons.of_rings(roofs), 3, "roof_tiles_red"),
        ThematicSurface(f"{name}_g", "GroundSurface", Polygons.of_rings([base]), 3, "concrete"),
    )
    return CityObject(name, "Building", {"function": "residential"}, surfaces, solid_lod=3)


def standing(  # noqa: PLR0917
    name, kind, template, position, size, heading=0.0, **attributes
):
    placement = Placement(np.array(position, dtype=float), heading, np.array(size), template)
    return CityObject(name, kind, attributes, placement=placement)


def make_city(chunk):
    x, y = chunk.origin
    c = chunk.prim_name
    objects = [make_road(chunk)]
    objects += [
        make_house(f"house_{k}_{c}", (x + 60 + 14 * k, y + 112, 0.0), (12.5, 10.0), 2 + k % 3)
        for k in range(4)
    ]
    objects += [
        standing(f"tree_{k}_{c}", "SolitaryVegetationObject", "tree",
                 (x + 15 + 12.0 * k, y + (91.0 if k % 2 else 108.5), 0.0),
                 (5.0 + 0.3 * k, 5.0 + 0.3 * k, 8.0 + 0.4 * k), 0.7 * k)
        for k in range(14)
    ]  # fmt: skip
    objects += [
        standing(f"light_{k}_{c}", "CityFurniture", "street_light",
                 (x + 20 + 40.0 * k, y + (95.0 if k % 2 else 105.0), KERB), (0.0, 0.0, 5.5),
                 np.pi / 2 if k % 2 else -np.pi / 2)
        for k in range(4)
    ]  # fmt: skip
    return City(tuple(objects), "+proj=utm +zone=32 +datum=WGS84", (500000.0, 5400000.0, 100.0))


def make_surface():
    none = np.empty((0, 3))
    ints = np.empty((0, 3), dtype=np.int64)
    flat = np.empty(0, dtype=np.int64)
    return RoadSurface(
        none, ints, flat, flat, (), (), (), (),
        crs="+proj=utm +zone=32 +datum=WGS84", offset=(500000.0, 5400000.0, 100.0),
    )  # fmt: skip


@dataclass(frozen=True)
class Scene:
    """Inputs of the layers, and how to write them all."""

    profile: Profile
    catalogue: Catalogue
    chunks: tuple[Chunk, ...] = (Chunk(0, 0),)
    seed: int = 0
    cities: dict[Chunk, City] = field(default_factory=dict)

    def city(self, chunk):
        return self.cities.get(chunk) or make_city(chunk)

    def write_chunk(self, chunk, folder: Path):
        ground, landuse, city = make_ground(chunk), make_landuse(chunk), self.city(chunk)
        write_terrain(ground, folder / "terrain.usdc")
        write_landuse(ground, landuse, self.profile, self.catalogue, folder / "landuse.usdc")
        write_roads(city, chunk, self.profile, self.catalogue, folder / "roads.usdc")
        write_buildings(city, chunk, self.profile, self.catalogue, folder / "buildings.usdc")
        write_props(city, chunk, self.profile, self.catalogue, self.seed, folder / "props.usdc")

    def write(self, out: Path, embed: bool = True) -> Path:
        for chunk in self.chunks:
            self.write_chunk(chunk, out / "chunks" / chunk.name)
        return self.compose(out, embed)

    def compose(self, out: Path, embed: bool = True) -> Path:
        return compose_stage(out, self.chunks, make_surface(), self.profile, self.catalogue, embed)


@pytest.fixture(scope="session")
def scene():
    return Scene(read_profile("1", "residential"), read_catalogue())


@pytest.fixture(scope="session")
def stage_file(scene, tmp_path_factory):
    return kept(tmp_path_factory, "layers_stage", scene.write)


@pytest.fixture(scope="session")
def material_of():
    """Name of the material whose class of surfaces a prim of a payload inherits."""

    def material_of_(prim):
        (surface,) = prim.GetInherits().GetAllDirectInherits()
        assert surface.GetParentPath() == "/__surface__"
        return surface.name

    return material_of_


@pytest.fixture(scope="session")
def make():
    """Makers of the pieces of the made-up chunk."""
    return SimpleNamespace(
        ground=make_ground,
        landuse=make_landuse,
        city=make_city,
        standing=standing,
        surface=make_surface,
    )
