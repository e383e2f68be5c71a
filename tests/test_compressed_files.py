"""Packed files are read as plain ones are, and a bomb is refused before it unfolds."""

import bz2
import gzip
import resource
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from typer.testing import CliRunner

from envgen_usd.citygml.city_validation import geometry_issues, schema_issues
from envgen_usd.citygml.read import read_city
from envgen_usd.cityjson.read import read_cityjson
from envgen_usd.commands.command_line import app
from envgen_usd.compressed_files import content_stem, content_suffix, open_content, read_content
from envgen_usd.errors import EnvgenError
from envgen_usd.landuse.osm_landuse import read_osm
from envgen_usd.opendrive.reader import read_network
from envgen_usd.places.osm_place import read_osm_place
from envgen_usd.recipe.build_options import demo_road
from envgen_usd.recipe.real_place import read_place
from envgen_usd.traffic.open_scenario.scenario_file import ScenarioFile
from envgen_usd.traffic.traces.esmini_csv import read_csv_trace
from envgen_usd.traffic.traces.sumo_fcd import read_fcd

PACK: dict[str, Callable[[bytes], bytes]] = {
    ".gz": lambda data: gzip.compress(data, mtime=0),
    ".bz2": bz2.compress,
}


@pytest.fixture(autouse=True)
def _small() -> Iterator[None]:
    """No test may hold what a bomb unfolds to."""
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    yield
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 300_000


@pytest.fixture(scope="module")
def bombs() -> dict[str, bytes]:
    """Elements with spaces, 256 MiB, in 300 kB and in 40 kB."""
    block = b"<b>" + b" " * 1015 + b"</b>\n\n"
    first, rest = b"<fcd-export>\n" + block * (1 << 14), block * (1 << 14)
    return {
        ".gz": gzip.compress(first, 6, mtime=0) + gzip.compress(rest, 6, mtime=0) * 15,
        ".bz2": bz2.compress(first) + bz2.compress(rest) * 15,
    }


@pytest.mark.parametrize("ending", PACK)
def test_a_packed_road_is_the_plain_road(ending: str, tmp_path: Path) -> None:
    plain = demo_road("straight")
    path = tmp_path / f"straight.xodr{ending}"
    path.write_bytes(PACK[ending](plain.read_bytes()))
    packed, expected = read_network(path), read_network(plain)
    assert packed.name == expected.name == "straight"
    assert packed.roads.keys() == expected.roads.keys()
    assert packed.issues == expected.issues


CITY = """<CityModel xmlns="http://www.opengis.net/citygml/3.0" xmlns:gml="http://www.opengis.net/gml/3.2"
 xmlns:b="http://www.opengis.net/citygml/building/3.0"><cityObjectMember><b:Building gml:id="a">
<lod0MultiSurface><gml:MultiSurface><gml:surfaceMember><gml:Polygon><gml:exterior><gml:LinearRing>
<gml:posList>0 0 1 9 0 1 9 9 1 0 9 1 0 0 1</gml:posList></gml:LinearRing></gml:exterior>
</gml:Polygon></gml:surfaceMember></gml:MultiSurface></lod0MultiSurface></b:Building>
</cityObjectMember></CityModel>"""
JSON = """{"type": "CityJSON", "version": "2.0", "transform": {"scale": [1, 1, 1],
"translate": [0, 0, 0]}, "vertices": [[0, 0, 1], [9, 0, 1], [9, 9, 1], [0, 9, 1]], "CityObjects":
{"a": {"type": "Building", "geometry": [{"type": "MultiSurface", "lod": "0",
"boundaries": [[[0, 1, 2, 3]]]}]}}}"""


@pytest.mark.parametrize("ending", PACK)
def test_packed_city_models_are_the_plain_ones(ending: str, tmp_path: Path) -> None:
    for suffix, text in ((".gml", CITY), (".json", JSON)):
        plain, packed = tmp_path / f"city{suffix}", tmp_path / f"city{suffix}{ending}"
        plain.write_text(text)
        packed.write_bytes(PACK[ending](text.encode()))
        read = read_city if suffix == ".gml" else read_cityjson
        assert [each.id for each in read(packed).objects] == ["a"]
        assert repr(read(packed)) == repr(read(plain))
        assert read_place(packed).houses.footprints[0].area == pytest.approx(81)


READERS: dict[str, tuple[str, Callable[[Path], object]]] = {
    "road": (".xodr", read_network),
    "city": (".gml", read_city),
    "city, its geometry": (".gml", geometry_issues),
    "city, its schema": (".gml", schema_issues),
    "CityJSON": (".json", read_cityjson),
    "CityJSONSeq": (".jsonl", read_cityjson),
    "floating car data": (".xml", read_fcd),
    "log": (".csv", read_csv_trace),
    "scenario": (".xosc", ScenarioFile),
    "landuse": (".osm", read_osm),
    "place": (".osm", read_osm_place),
}


@pytest.mark.parametrize("ending", PACK)
@pytest.mark.parametrize("name", READERS)
def test_a_bomb_is_refused_by_its_name(
    name: str, ending: str, bombs: dict[str, bytes], tmp_path: Path
) -> None:
    suffix, read = READERS[name]
    path = tmp_path / f"bomb{suffix}{ending}"
    path.write_bytes(bombs[ending])
    with pytest.raises(EnvgenError, match="unfolds to more than") as caught:
        read(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_the_command_ends_with_2_for_a_bomb(bombs: dict[str, bytes], tmp_path: Path) -> None:
    path = tmp_path / "map.xodr.gz"
    path.write_bytes(bombs[".gz"])
    out = tmp_path / "out"
    build = ["build", str(path), "--country", "1", "--area", "residential", "--out", str(out)]
    result = CliRunner().invoke(app, build)
    assert isinstance(result.exception, EnvgenError)  # the program turns it into exit code 2
    assert not out.exists()


@pytest.mark.parametrize("ending", PACK)
@pytest.mark.parametrize("fault", ["cut", "flipped"])
def test_damage_within_is_named(ending: str, fault: str, tmp_path: Path) -> None:
    data = bytearray(PACK[ending](demo_road("straight").read_bytes()))
    if fault == "cut":
        data = data[: len(data) // 2]
    else:
        data[len(data) // 2] ^= 0x10
    path = tmp_path / f"map.xodr{ending}"
    path.write_bytes(data)
    with pytest.raises(EnvgenError, match=r"map\.xodr.*the packed content is damaged"):
        read_network(path)


def test_archives_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "city.gml"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("city.gml", CITY)
    with pytest.raises(EnvgenError, match="zip archive; unpack it"):
        read_city(path)


def test_an_included_file_is_never_unpacked(tmp_path: Path) -> None:
    road = (
        demo_road("straight")
        .read_text()
        .replace("</OpenDRIVE>", '<include file="a.xml"/></OpenDRIVE>')
    )
    (tmp_path / "map.xodr").write_text(road)
    (tmp_path / "a.xml").write_bytes(gzip.compress(b"<OpenDRIVE/>"))
    with pytest.raises(EnvgenError, match="included file is packed"):
        read_network(tmp_path / "map.xodr")


def test_content_that_packs_well_is_read_up_to_the_bound(tmp_path: Path) -> None:
    """Up to 16 MiB no ratio counts; the bound of the caller counts always."""
    path = tmp_path / "a.gz"
    path.write_bytes(gzip.compress(bytes(16 << 20)))
    assert read_content(path) == bytes(16 << 20)
    with pytest.raises(EnvgenError, match="more than 1 MiB"):
        read_content(path, 1 << 20)
    path.write_bytes(gzip.compress(bytes((16 << 20) + 1)))
    with pytest.raises(EnvgenError, match="more than 16 MiB"):
        read_content(path)


def test_a_pipe_is_no_file(tmp_path: Path) -> None:
    with pytest.raises(EnvgenError, match="not a regular file"), open_content(tmp_path):
        pass


@pytest.mark.parametrize(
    ("name", "suffix", "stem"),
    [
        ("map.xodr", ".xodr", "map"),
        ("map.XODR.GZ", ".xodr", "map"),
        ("map.v2.xodr.bz2", ".xodr", "map.v2"),
        ("city.json", ".json", "city"),
        ("gz.gz", ".gz", "gz"),
        ("town.v2", ".v2", "town"),
    ],
)
def test_names_without_their_packing(name: str, suffix: str, stem: str) -> None:
    assert content_suffix(Path(name)) == suffix
    assert content_stem(Path(name)) == stem
