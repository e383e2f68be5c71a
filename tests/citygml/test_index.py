"""The index of chunks."""

import pytest
from lxml import etree

from envgen_usd.citygml.index import write_index
from envgen_usd.citygml.write import write_city
from envgen_usd.errors import EnvgenError
from envgen_usd.models.city import City, CityObject

HREF = "{http://www.w3.org/1999/xlink}href"


def test_every_feature_is_listed_where_it_lies(tmp_path, xsd):
    files = []
    for number in range(3):
        folder = tmp_path / "chunks" / f"{number}_-1"
        folder.mkdir(parents=True)
        part = CityObject(f"part_{number}", "BuildingPart")
        house = CityObject(f"house_{number}", "Building", children=(part,))
        road = CityObject(f"road_{number}", "Road")
        write_city(City((house, road)), folder / "city.gml")
        files.append(folder / "city.gml")
    write_index(files, tmp_path / "city.gml")
    document = etree.parse(str(tmp_path / "city.gml"))
    assert xsd.validate(document), xsd.error_log
    assert [member.get(HREF) for member in document.getroot()] == [
        f"chunks/{number}_-1/city.gml#{kind}_{number}"
        for number in range(3)
        for kind in ("house", "road")
    ]


def test_a_file_that_cannot_be_read_leaves_no_index(tmp_path):
    (tmp_path / "bad.gml").write_text("<CityModel>")
    for name in ("bad.gml", "missing.gml"):
        with pytest.raises(EnvgenError, match=name):
            write_index([tmp_path / name], tmp_path / "index.gml")
    assert [file.name for file in tmp_path.iterdir()] == ["bad.gml"]
