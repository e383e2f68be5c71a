"""The reader: what it refuses, and files that were written by hand."""

import numpy as np
import pytest

from envgen_usd.citygml.read import read_city
from envgen_usd.errors import EnvgenError


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (None, "cannot be read"),
        ("", "well-formed"),
        ("not xml", "well-formed"),
        ("<CityModel><open></CityModel>", "well-formed"),
        ("<html><body/></html>", "not CityGML"),
    ],
)
def test_what_is_no_citygml_is_refused(tmp_path, content, words):
    path = tmp_path / "city.gml"
    if content is not None:
        path.write_text(content)
    with pytest.raises(EnvgenError, match=words) as caught:
        read_city(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_the_valid_example_of_the_schemas_is_read(citygml_schemas):
    city = read_city(citygml_schemas / "valid-example-3.0.gml")
    assert [top.kind for top in city.objects] == ["Building", "Road", "CityFurniture"]
    building, road, sign = city.objects
    assert building.attributes["height"] == 3.0
    assert building.attributes["usd_prim"] == "/World/B1"
    assert building.solid_lod == 2
    wall = building.surfaces[1]
    assert wall.kind == "WallSurface"
    assert [opening.kind for opening in wall.openings] == ["WindowSurface"]
    np.testing.assert_array_equal(
        wall.polygons.points, [[0, 0, 0], [1, 0, 0], [1, 0, 3], [0, 0, 3]]
    )
    (lane,) = city.of_kind("TrafficSpace")
    assert lane.relations == {"rightLaneChange": ("TS2",), "successor": ("TS2",)}
    np.testing.assert_array_equal(lane.curves["lod2MultiCurve"][0], [[0, 1.5, 0], [5, 1.5, 0]])
    assert road.relations == {"intersection": ("I1",)}
    assert sign.placement.template == "assets/sign.usdc"
    np.testing.assert_array_equal(sign.placement.position, [1, 2, 3])
