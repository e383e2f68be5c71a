"""Every type of object that OpenDRIVE knows, and some that it does not, is in the written city."""

import pytest
from lxml import etree

from envgen_usd.city.roads.road_city import build_road_city
from envgen_usd.citygml.city_validation import geometry_issues
from envgen_usd.citygml.write import write_city
from envgen_usd.environment_files import read_profile
from envgen_usd.recipe.map_land import read_road

TYPES = {
    "barrier": "CityFurniture",
    "bike": "CityFurniture",
    "building": "Building",
    "bus": "CityFurniture",
    "car": "CityFurniture",
    "crosswalk": "TrafficSpace",
    "gantry": "CityFurniture",
    "motorbike": "CityFurniture",
    "none": "GenericOccupiedSpace",
    "obstacle": "CityFurniture",
    "parkingSpace": "TrafficSpace",
    "patch": "TrafficSpace",
    "pedestrian": "CityFurniture",
    "pole": "CityFurniture",
    "railing": "CityFurniture",
    "roadMark": "Section",
    "roadSurface": "TrafficSpace",
    "soundBarrier": "CityFurniture",
    "streetLamp": "CityFurniture",
    "trafficIsland": "TrafficSpace",
    "trailer": "CityFurniture",
    "train": "CityFurniture",
    "tram": "CityFurniture",
    "tree": "SolitaryVegetationObject",
    "van": "CityFurniture",
    "vegetation": "SolitaryVegetationObject",
    "wind": "",
    "busStop": "CityFurniture",
    "monument": "GenericOccupiedSpace",
    "-1": "GenericOccupiedSpace",
    "Gartenzwerg": "GenericOccupiedSpace",
}
"""Types of 1.4 to 1.8 (13.1) and others, with the class that r:trân gives them; '' for an issue."""
ON_ROAD = {"Section", "TrafficSpace"}
LANES = """<laneSection s="0"><center><lane id="0" type="none"/></center><right>
  <lane id="-1" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane>
  <lane id="-2" type="parking"><width sOffset="0" a="3" b="0" c="0" d="0"/></lane></right>
  </laneSection>"""
OUTLINE = "".join(
    f'<cornerLocal u="{u}" v="{v}" z="0" height="{{0}}"/>'
    for u, v in ((0, -0.75), (3, -0.75), (3, 0.75), (0, 0.75))
)
SHAPES = {
    "point": ("", ""),
    "box": ('length="3" width="1.5" height="1.2"', ""),
    "round": ('radius="0.7" height="1.2"', ""),
    "outline": ("", f"<outlines><outline id='0' closed='true'>{OUTLINE}</outline></outlines>"),
    "spaced": (
        'length="3" width="1.5" height="1.2"',
        '<repeat s="{s}" length="8" distance="4" tStart="{t}" tEnd="{t}"/>',
    ),
    "swept": (
        'length="3" width="1.5" height="1.2"',
        '<repeat s="{s}" length="8" distance="0" tStart="{t}" tEnd="{t}"/>',
    ),
}


def described(shape):
    """An object of each type, in the same shape."""
    size, inner = SHAPES[shape]
    objects = []
    for place, (type_, class_) in enumerate(TYPES.items()):
        t = -5 if type_ == "parkingSpace" else -1.75 if class_ in ON_ROAD else 9
        s = 20 + 20 * place
        filled = inner.format(s=s, t=t) if "repeat" in inner else inner
        filled = filled.format(0 if class_ in ON_ROAD - {"trafficIsland"} else 2)
        objects.append(
            f'<object id="o_{type_}" type="{type_}" name="" s="{s}" t="{t}" zOffset="0" hdg="0.2"'
            f" {size}>{filled}</object>"
        )
    return f"<objects>{''.join(objects)}</objects>"


@pytest.fixture
def map_of(tmp_path):
    """City and issues of a road of 700 m with the given objects."""

    def build(rest):
        path = tmp_path / "map.xodr"
        path.write_text(
            f"""<OpenDRIVE><header revMajor="1" revMinor="8"/><road name="" id="1" length="700"
            junction="-1"><planView><geometry s="0" x="0" y="0" hdg="0" length="700"><line/>
            </geometry></planView><lanes>{LANES}</lanes>{rest}</road></OpenDRIVE>"""
        )
        reading, surface = read_road(path, 0.02)
        city = build_road_city(surface, read_profile("1", "residential"))
        return city, (*reading.network.issues, *surface.issues)

    return build


def classes_by_id(city):
    """Classes of the features that show each object of the file; a section shows its marks."""
    classes = {}
    for feature in city.walk():
        for part in (feature, *feature.surfaces):
            if "opendrive_id" in part.attributes:
                classes.setdefault(part.attributes["opendrive_id"], set()).add(feature.kind)
    return classes


@pytest.mark.parametrize("shape", SHAPES)
def test_each_object_is_in_the_city_or_in_an_issue(map_of, shape):
    city, issues = map_of(described(shape))
    classes = classes_by_id(city)
    left_out = {each.where.split("[id=")[-1][:-1] for each in issues if each.action == "left out"}
    assert {f"o_{type_}" for type_ in TYPES} == classes.keys() | left_out
    assert not classes.keys() & left_out
    expected = {f"o_{type_}": class_ for type_, class_ in TYPES.items()}
    assert left_out <= {id_ for id_, class_ in expected.items() if not class_} | (
        {f"o_{t}" for t, class_ in TYPES.items() if class_ in ON_ROAD} | {"o_building"}
        if shape == "point"
        else set()
    )


@pytest.mark.parametrize("shape", ["box", "round", "swept"])
def test_objects_have_the_classes_of_their_types(map_of, shape):
    classes = classes_by_id(map_of(described(shape))[0])
    expected = {f"o_{type_}": {class_} for type_, class_ in TYPES.items() if class_}
    if shape == "swept":
        expected |= {"o_tree": {"PlantCover"}, "o_vegetation": {"PlantCover"}}
    expected["o_trafficIsland"] = {"AuxiliaryTrafficSpace", "TrafficSpace"}  # with its kerb
    assert classes == expected


@pytest.mark.parametrize("version", ["3.0", "2.0"])
@pytest.mark.parametrize("shape", SHAPES)
def test_the_written_city_is_valid(map_of, citygml_schemas, tmp_path, shape, version):
    city, _ = map_of(described(shape))
    path = tmp_path / "city.gml"
    write_city(city, path, version)
    schema = etree.XMLSchema(etree.parse(str(citygml_schemas / f"citygml-{version}.xsd")))
    assert schema.validate(etree.parse(str(path))), schema.error_log
    assert geometry_issues(path) == ()
