"""Things that come with their own geometry."""

import numpy as np
import pytest
from pxr import Sdf, Usd, UsdGeom

from envgen_usd.chunks import Chunk
from envgen_usd.layers.props_layer import write_props
from envgen_usd.models.city_model import City, CityObject
from envgen_usd.models.polygon_arrays import Polygons

WALL = np.array([[10.0, 20, 0], [14.0, 20, 0], [14.0, 20, 3], [10.0, 20, 3]])


@pytest.fixture
def write(scene, tmp_path):
    def write_(*objects):
        path = tmp_path / "props.usdc"
        city = City(objects)
        write_props(city, Chunk(0, 0), scene.profile, scene.catalogue, 0, path)
        return Usd.Stage.Open(str(path))

    return write_


def thing(name, kind, **attributes):
    polygons = Polygons.of_rings([WALL])
    return CityObject(name, kind, attributes, geometry={"lod2MultiSurface": polygons})


@pytest.mark.parametrize(
    ("kind", "attributes", "label", "material"),
    [
        ("CityFurniture", {"template": "guard_rail", "material": "metal_galvanised"},
         "guard_rail", "metal_galvanised"),
        ("CityFurniture", {"template": "jersey"}, "wall", "concrete"),
        ("CityFurniture", {"template": "kiosk"}, "static", "concrete"),
        ("CityFurniture", {"template": "gantry"}, "pole", "concrete"),
        ("PlantCover", {"template": "hedge"}, "vegetation", "grass"),
    ],
)  # fmt: skip
def test_a_body_is_a_labelled_mesh(  # noqa: PLR0917
    write, material_of, kind, attributes, label, material
):
    stage = write(thing("b", kind, **attributes))
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath("/Props/b"))
    assert Usd.ModelAPI(mesh).GetKind() == "component"
    assert list(mesh.GetPrim().GetAttribute("semantics:labels:class").Get()) == [label]
    assert material_of(mesh.GetPrim()) == material
    np.testing.assert_allclose(
        sorted(map(tuple, mesh.GetPointsAttr().Get())), sorted(map(tuple, WALL))
    )
    np.testing.assert_allclose(
        stage.GetDefaultPrim().GetAttribute("extentsHint").Get(), [WALL.min(0), WALL.max(0)]
    )


def test_what_has_a_placement_is_not_drawn_twice(scene, tmp_path, make):
    light = make.standing("l", "CityFurniture", "street_light", (1, 2, 0), (0, 0, 5))
    both = CityObject(light.id, light.kind, geometry=thing("x", "CityFurniture").geometry,
                      placement=light.placement)  # fmt: skip
    path = tmp_path / "both.usdc"
    write_props(City((both,)), Chunk(0, 0), scene.profile, scene.catalogue, 0, path)
    layer = Sdf.Layer.OpenAsAnonymous(str(path))
    prims = list(layer.GetPrimAtPath("/Props").nameChildren)
    assert [(prim.name, prim.typeName, prim.instanceable) for prim in prims] == [
        ("l", "Xform", True)
    ]
