"""XML of others: entities expand nowhere, whoever reads the file."""

import ast
import resource
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from lxml import etree

import envgen_usd
from envgen_usd.citygml.city_index import member_files, write_index
from envgen_usd.citygml.city_validation import geometry_issues, schema_issues
from envgen_usd.citygml.feature_references import reference_issues
from envgen_usd.citygml.read import read_city
from envgen_usd.errors import EnvgenError
from envgen_usd.landuse.osm_landuse import read_osm
from envgen_usd.places.osm_place import read_osm_place
from envgen_usd.recipe.build_inputs import read_inputs
from envgen_usd.recipe.build_options import BuildOptions, demo_road
from envgen_usd.traffic.open_scenario.scenario_file import ScenarioFile
from envgen_usd.traffic.traces.sumo_fcd import read_fcd
from envgen_usd.xml_events import safe_iterparse

BOMB = '<!ENTITY e0 "lolololol">' + "".join(
    f'<!ENTITY e{level} "{f"&e{level - 1};" * 10}">' for level in range(1, 10)
)
"""Ten times ten times ...: 9 GB of text."""
OUR_MARK = '<gml:metaDataProperty xlink:title="offset"/>'
SPACES = " ".join(
    f'xmlns{prefix}="http://www.opengis.net/{name}"'
    for prefix, name in ((":gml", "gml/3.2"), ("", "citygml/3.0"), (":b", "citygml/building/3.0"))
)


@pytest.fixture
def hostile(tmp_path: Path) -> Callable[[str], Path]:
    """Writes a city model with a document type of some kind."""
    secret, dtd = tmp_path / "secret", tmp_path / "secret.dtd"
    secret.write_text("SECRET")
    dtd.write_text('<!ENTITY x "SECRET">')
    kinds = {
        "bomb": (f"[{BOMB}]", "&e9;", ""),
        "bomb in an attribute": (f"[{BOMB}]", "", "&e9;"),
        "external entity": (f'[<!ENTITY x SYSTEM "{secret.as_uri()}">]', "&x;", ""),
        "external type": (f'SYSTEM "{dtd.as_uri()}"', "&x;", ""),
        "unused entity": ('[<!ENTITY x "x">]', "", ""),
    }

    def write(kind: str, mark: str = "") -> Path:
        doctype, text, name = kinds[kind]
        path = tmp_path / "city.gml"
        path.write_text(
            f"<!DOCTYPE CityModel {doctype}>"
            f'<CityModel {SPACES} xmlns:xlink="http://www.w3.org/1999/xlink">{mark}'
            f'<cityObjectMember><b:Building gml:id="a{name}"><gml:name>{text}</gml:name>'
            "</b:Building></cityObjectMember></CityModel>"
        )
        return path

    return write


@pytest.fixture(autouse=True)
def _small() -> Iterator[None]:
    """No test may take the memory that an expanded bomb does."""
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    yield
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 300_000


def _index(path: Path) -> None:
    write_index([path], path.with_name("index.gml"))


def _given(path: Path) -> None:
    out = path.parent / "out"
    read_inputs(BuildOptions(demo_road("straight"), "1", "residential", out, city=path))


READERS = (
    read_city,
    geometry_issues,
    schema_issues,
    reference_issues,
    member_files,
    _index,
    _given,
)
KINDS = ("bomb", "bomb in an attribute", "external entity", "external type", "unused entity")


@pytest.mark.parametrize("mark", ["", OUR_MARK], ids=["foreign", "ours"])
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("read", READERS, ids=lambda read: read.__name__)
def test_files_with_entities_are_refused(
    hostile: Callable[..., Path], read: Callable[[Path], object], kind: str, mark: str
) -> None:
    path = hostile(kind, mark)
    with pytest.raises(EnvgenError, match=r"refused|amplification") as caught:
        read(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)
    assert not path.with_name("index.gml").exists()


def test_only_one_module_makes_parsers() -> None:
    """Others would repeat the flags by hand, and forget some."""
    package = Path(envgen_usd.__file__).parent
    found, names = set(), {"iterparse", "XMLParser"}
    for path in package.rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        if not any(name in text for name in names):
            continue  # A thousand modules take long to parse.
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.Attribute) and node.attr in names:
                used = isinstance(node.value, ast.Name) and node.value.id == "etree"
                found |= {path.name} if used else set()
    assert found - {"xsd_files.py"} == {"xml_events.py"}


def test_events_of_a_file_that_means_no_harm(tmp_path: Path) -> None:
    path = tmp_path / "a.xml"
    path.write_text("<!DOCTYPE a><a><!-- no --><?no no?><b>x&amp;y</b><c/></a>")
    with path.open("rb") as file:
        events = safe_iterparse(file, ("start", "end"))
        assert events.root is None
        names = [(event, element.tag) for event, element in events]
        assert events.root is not None
        assert events.root.tag == "a"
        assert [child.tag for child in events.root] == ["b", "c"]
    assert names == [
        *[("start", "a"), ("start", "b"), ("end", "b")],
        *[("start", "c"), ("end", "c"), ("end", "a")],
    ]
    with path.open("rb") as file:
        assert [element.text for _, element in safe_iterparse(file, tag=("b",))] == ["x&y"]
    path.write_text("<a><b>")
    with path.open("rb") as file, pytest.raises(etree.XMLSyntaxError):
        list(safe_iterparse(file))


OTHERS: dict[str, tuple[str, Callable[[Path], object]]] = {
    "a.xosc": (
        "<OpenSCENARIO><FileHeader name='{}'/><Storyboard>{}</Storyboard></OpenSCENARIO>",
        ScenarioFile,
    ),
    "fcd.xml": (
        "<fcd-export><timestep time='0'><vehicle id='{}' x='1' y='1' angle='0'/>{}</timestep>"
        "</fcd-export>",
        read_fcd,
    ),
    "landuse.osm": (
        "<osm version='0.6'><node id='1' lat='1' lon='1'><tag k='name' v='{}'/>{}</node></osm>",
        read_osm,
    ),
    "place.osm": (
        "<osm version='0.6'><node id='1' lat='1' lon='1'><tag k='name' v='{}'/>{}</node></osm>",
        read_osm_place,
    ),
}


@pytest.mark.parametrize(
    "doctype", [f"[{BOMB}]", '[<!ENTITY e9 SYSTEM "file:///etc/passwd">]'], ids=["bomb", "external"]
)
@pytest.mark.parametrize("place", ["attribute", "text"])
@pytest.mark.parametrize("name", OTHERS)
def test_entities_of_other_formats_expand_nowhere(
    name: str, place: str, doctype: str, tmp_path: Path
) -> None:
    text, read = OTHERS[name]
    filled = text.format("&e9;", "") if place == "attribute" else text.format("", "&e9;")
    path = tmp_path / name
    path.write_text(f"<!DOCTYPE x {doctype}>{filled}")
    with pytest.raises(EnvgenError, match=name) as caught:
        read(path)
    assert "root:" not in str(caught.value)
    assert any(word in str(caught.value) for word in ("declares entity", "ntit", "ENTITY"))
