"""Generated cities come back from files of both versions of CityGML as they were."""

import pytest
from tests.environments import TABLE_A1

from envgen_usd.citygml.city_validation import geometry_issues, schema_issues
from envgen_usd.citygml.read import read_city
from envgen_usd.citygml.write import write_city
from envgen_usd.models.city_model import City


@pytest.mark.parametrize(("country", "area"), TABLE_A1)
def test_version_3_holds_everything(make_map, citygml_schemas, tmp_path, country, area):
    city = make_map(country, area).cities[0]
    write_city(city, tmp_path / "one.gml")
    write_city(read_city(tmp_path / "one.gml"), tmp_path / "two.gml")
    assert (tmp_path / "one.gml").read_bytes() == (tmp_path / "two.gml").read_bytes()
    assert schema_issues(tmp_path / "one.gml", citygml_schemas) == ()
    assert geometry_issues(tmp_path / "one.gml") == ()


@pytest.mark.parametrize(("country", "area"), TABLE_A1)
def test_version_2_holds_everything_but_the_spaces_of_roads(make_map, tmp_path, country, area):
    city = make_map(country, area).cities[0]
    city = City(
        tuple(thing for thing in city.objects if thing.kind != "Road"), city.crs, city.offset
    )
    write_city(city, tmp_path / "old.gml", "2.0")
    back = read_city(tmp_path / "old.gml", city.crs, city.offset)
    write_city(city, tmp_path / "one.gml")
    write_city(back, tmp_path / "two.gml")
    assert (tmp_path / "one.gml").read_bytes() == (tmp_path / "two.gml").read_bytes()
