"""The index of chunks."""

import pytest
from lxml import etree

from envgen_usd.citygml.city_index import member_files, write_index
from envgen_usd.citygml.feature_references import reference_issues
from envgen_usd.citygml.read import read_city
from envgen_usd.citygml.write import write_city
from envgen_usd.errors import EnvgenError
from envgen_usd.models.city_model import City, CityObject

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
    assert [member.get(HREF) for member in document.iterfind("{*}cityObjectMember")] == [
        f"chunks/{number}_-1/city.gml#{kind}_{number}"
        for number in range(3)
        for kind in ("house", "road")
    ]


def test_any_name_of_a_file_stands_in_the_index(tmp_path):
    """What XML escapes comes back; a file without features adds no member."""
    names = ('it\'s "one" & <two>', "tab\tand\nline", "plain", "empty")
    files = [tmp_path / f"{name}.gml" for name in names]
    for file in files:
        features = () if file.stem == "empty" else (CityObject("a", "Road"),)
        write_city(City(features), file)
    write_index(files, tmp_path / "city.gml")
    members = etree.parse(str(tmp_path / "city.gml")).iterfind("{*}cityObjectMember")
    assert [member.get(HREF) for member in members] == [f"{name}.gml#a" for name in names[:-1]]


def test_comments_are_no_features(tmp_path):
    """A file that someone edited; the index had a member "#None" for each comment."""
    file = tmp_path / "part.gml"
    write_city(City((CityObject("road", "Road"),)), file)
    start = "<cityObjectMember>"
    assert start in file.read_text()
    file.write_text(file.read_text().replace(start, f"<!-- a -->{start}<!-- b --><?c d?>"))
    write_index([file], tmp_path / "city.gml")
    document = etree.parse(str(tmp_path / "city.gml"))
    members = [member.get(HREF) for member in document.iterfind("{*}cityObjectMember")]
    assert members == ["part.gml#road"]


def test_a_file_that_is_no_city_model_is_refused(tmp_path):
    (tmp_path / "page.gml").write_text("<html/>")
    with pytest.raises(EnvgenError, match=r"page\.gml: not CityGML"):
        write_index([tmp_path / "page.gml"], tmp_path / "city.gml")


def test_a_file_that_cannot_be_read_leaves_no_index(tmp_path):
    (tmp_path / "bad.gml").write_text("<CityModel>")
    for name in ("bad.gml", "missing.gml"):
        with pytest.raises(EnvgenError, match=name):
            write_index([tmp_path / name], tmp_path / "index.gml")
    assert [file.name for file in tmp_path.iterdir()] == ["bad.gml"]


def test_reading_the_index_is_reading_all_files(tmp_path):
    place = {"crs": "EPSG:25832", "offset": (690000.0, 5334000.0, 0.0)}
    files = []
    for number in range(2):
        (tmp_path / str(number)).mkdir()
        files.append(tmp_path / str(number) / "city.gml")
        lane = CityObject(
            f"lane_{number}",
            "TrafficSpace",
            {"granularity": "lane"},
            relations={"successor": (f"../{1 - number}/city.gml#lane_{1 - number}",)},
        )
        section = CityObject(f"section_{number}", "Section", children=(lane,))
        write_city(City((CityObject(f"road_{number}", "Road", children=(section,)),), **place),
                   files[number])  # fmt: skip
    write_index(files, tmp_path / "city.gml")
    city = read_city(tmp_path / "city.gml")
    assert (city.crs, city.offset) == (place["crs"], place["offset"])
    lanes = city.of_kind("TrafficSpace")
    assert [lane.id for lane in lanes] == ["lane_0", "lane_1"]
    assert [lane.relations["successor"] for lane in lanes] == [("lane_1",), ("lane_0",)]
    assert all(reference_issues(path) == () for path in (*files, tmp_path / "city.gml"))


def test_references_that_lead_nowhere_are_found(tmp_path):
    targets = ("one", "two", "other.gml#three", "missing.gml#four", "other.gml#five")
    write_city(City((CityObject("three", "Road"),)), tmp_path / "other.gml")
    light = CityObject("one", "CityFurniture", relations={"controls": targets})
    write_city(City((light,)), tmp_path / "city.gml")
    issues = reference_issues(tmp_path / "city.gml")
    assert {issue.where for issue in issues} == {"one"}
    assert ["two" in i.message or "four" in i.message or "five" in i.message for i in issues] == [
        True
    ] * 3


@pytest.mark.parametrize("name", ["../secret.gml", "/etc/passwd", "link.gml", "a/../../secret.gml"])
def test_members_outside_of_the_folder_are_refused(name, tmp_path):
    folder = tmp_path / "maps"
    folder.mkdir()
    write_city(City((CityObject("a", "Building"),)), tmp_path / "secret.gml")
    (folder / "link.gml").symlink_to(tmp_path / "secret.gml")
    write_city(City((CityObject("b", "Building"),)), folder / "near.gml")
    write_index([folder / "near.gml"], folder / "city.gml")
    assert [each.id for each in read_city(folder / "near.gml").objects] == ["b"]
    assert member_files(folder / "city.gml") == (folder / "near.gml",)
    text = (folder / "near.gml").read_text()
    member = f'<cityObjectMember xmlns:x="http://www.w3.org/1999/xlink" x:href="{name}#a"/>'
    (folder / "city.gml").write_text(text.replace("</CityModel>", f"{member}</CityModel>"))
    for read in (read_city, member_files):
        with pytest.raises(EnvgenError, match="outside of its folder"):
            read(folder / "city.gml")
