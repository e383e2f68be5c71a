import re

import numpy as np
import pytest

from envgen_usd.citygml.city_validation import geometry_issues, schema_issues
from envgen_usd.citygml.write import write_city
from envgen_usd.citygml.xsd_files import load_schema
from envgen_usd.errors import EnvgenError
from envgen_usd.models.city_model import City, CityObject, ThematicSurface
from envgen_usd.models.polygon_arrays import Polygons

CORNERS = np.array([[x, y, z] for z in (0, 6) for y in (0, 8) for x in (0, 10)], dtype=float)
FACES = {
    "GroundSurface": [[0, 2, 3, 1]],
    "RoofSurface": [[4, 5, 7, 6]],
    "WallSurface": [[0, 1, 5, 4], [1, 3, 7, 5], [3, 2, 6, 7], [2, 0, 4, 6]],
}


def box(name, kind="Building", shift=(0, 0, 0), children=(), without=""):
    surfaces = tuple(
        ThematicSurface(
            f"{name}_{surface}",
            surface,
            Polygons.of_rings([CORNERS[face] + shift for face in faces]),
            lod=2,
        )
        for surface, faces in FACES.items()
        if surface != without
    )
    return CityObject(name, kind, surfaces=surfaces, solid_lod=2, children=children)


@pytest.fixture
def written(tmp_path):
    def write(*objects, swap=("", "")):
        path = tmp_path / "city.gml"
        write_city(City(objects), path)
        path.write_text(path.read_text("utf-8").replace(*swap), "utf-8")
        return path

    return write


def kinds(issues):
    return [issue.kind for issue in issues]


def test_a_valid_file_has_no_issues(written, citygml_schemas):
    path = written(box("one"), box("two", shift=(20, 0, 0)))

    assert schema_issues(path, citygml_schemas) == ()
    assert geometry_issues(path) == ()


def test_the_standards_own_example(citygml_schemas):
    example = citygml_schemas / "valid-example-3.0.gml"

    assert schema_issues(example, citygml_schemas) == ()
    # The solid of its building is a single triangle.
    assert set(kinds(geometry_issues(example))) == {"iso19107.301", "iso19107.302"}


def test_an_element_that_the_schema_does_not_know(written, citygml_schemas):
    path = written(box("one"), swap=("bldg:Building ", "bldg:Bulding "))
    path.write_text(path.read_text().replace("</bldg:Building>", "</bldg:Bulding>"))

    issues = schema_issues(path, citygml_schemas)

    assert set(kinds(issues)) == {"xsd"}
    assert "Bulding" in issues[0].message
    assert issues[0].line > 1


def test_each_object_has_one_issue_for_each_code(written):
    sides = box("sides", without="GroundSurface")
    roofless = box("roofless", without="RoofSurface")

    issues = geometry_issues(written(box("good"), roofless, sides))

    assert [(issue.kind, issue.where) for issue in issues] == [
        ("iso19107.302", "Building[roofless]"),
        ("iso19107.302", "Building[sides]"),
    ]
    assert "roofless_WallSurface.0" in issues[0].message


def test_a_ring_that_is_not_closed(written):
    path = written(
        box("one"),
        swap=(
            "0.000 0.000 6.000 10.000 0.000 6.000 10.000 8.000 6.000 0.000 8.000 6.000 "
            "0.000 0.000 6.000",
            "0.000 0.000 6.000 10.000 0.000 6.000 10.000 8.000 6.000 0.000 8.000 6.000",
        ),
    )

    (issue,) = geometry_issues(path)

    assert issue.kind == "iso19107.103"
    assert issue.where.startswith("RoofSurface[one_RoofSurface]")


@pytest.mark.parametrize("text", ["x", "nan", "1.0 2.0"])
def test_coordinates_that_are_none(written, text):
    path = written(box("one"), swap=("10.000 0.000 6.000 10.000 8.000 6.000", text))

    assert "iso19107.901" in kinds(geometry_issues(path))


def test_a_reference_to_nothing(written):
    path = written(box("one"), swap=('xlink:href="#one_RoofSurface.0"', 'xlink:href="#roof"'))

    assert kinds(geometry_issues(path)) == ["gml.reference", "iso19107.302"]


def test_a_reference_that_leads_back_to_itself(written):
    path = written(box("one"), swap=('xlink:href="#one_RoofSurface.0"', 'xlink:href="#loop"'))
    text = path.read_text()
    path.write_text(text.replace("<gml:Shell>", '<gml:Shell gml:id="loop">'))

    assert "iso19107.303" in kinds(geometry_issues(path))


def test_a_wall_that_two_buildings_share(written):
    """The second box takes its left wall from the first, turned."""
    path = written(box("a"), box("b", shift=(10, 0, 0)))
    text = path.read_text()
    left = re.search(r'<gml:Polygon gml:id="b_WallSurface.3">.*?</gml:Polygon>', text)[0]
    turned = (
        '<gml:OrientableSurface orientation="-">'
        '<gml:baseSurface xlink:href="#a_WallSurface.1"/></gml:OrientableSurface>'
    )
    text = text.replace('<gml:surfaceMember xlink:href="#b_WallSurface.3"/>', "@")
    text = text.replace(f"<gml:surfaceMember>{left}</gml:surfaceMember>", "")
    path.write_text(text.replace("@", f"<gml:surfaceMember>{turned}</gml:surfaceMember>"))

    assert geometry_issues(path) == ()


def test_parts_of_a_building_may_touch_but_not_overlap(written):
    beside = box("p", "BuildingPart", (10, 0, 0))
    inside = box("q", "BuildingPart", (6, 0, 0))

    assert geometry_issues(written(box("b", children=(beside,)))) == ()
    (issue,) = geometry_issues(written(box("b", children=(inside,))))
    assert (issue.kind, issue.where) == ("iso19107.601", "BuildingPart[q]")
    assert "192 m³, 1846 mm thick, with Building[b]" in issue.message


def test_a_polygon_used_backwards_and_a_cavity(tmp_path):
    """Solids of GML 3.1 whose faces are turned by gml:OrientableSurface; a cavity among them."""

    def polygon(name, ring, shift, size):
        points = CORNERS[ring] * size + shift
        text = " ".join(f"{value:g}" for point in [*points, points[0]] for value in point)
        return (
            f'<gml:Polygon gml:id="{name}"><gml:exterior><gml:LinearRing><gml:posList>{text}'
            "</gml:posList></gml:LinearRing></gml:exterior></gml:Polygon>"
        )

    def shell(name, shift, size, orientation):
        faces = [ring for rings in FACES.values() for ring in rings]
        members = "".join(
            f'<gml:surfaceMember><gml:OrientableSurface orientation="{orientation}">'
            f"<gml:baseSurface>{polygon(f'{name}{k}', ring, shift, size)}</gml:baseSurface>"
            "</gml:OrientableSurface></gml:surfaceMember>"
            for k, ring in enumerate(faces)
        )
        return f"<gml:CompositeSurface>{members}</gml:CompositeSurface>"

    def file(outer, inner):
        path = tmp_path / "old.gml"
        path.write_text(
            '<CityModel xmlns="http://www.opengis.net/citygml/2.0" '
            'xmlns:gml="http://www.opengis.net/gml" '
            'xmlns:bldg="http://www.opengis.net/citygml/building/2.0"><cityObjectMember>'
            '<bldg:Building gml:id="b"><bldg:lod1Solid><gml:Solid><gml:exterior>'
            f"{shell('o', (0, 0, 0), 1, outer)}</gml:exterior><gml:interior>"
            f"{shell('i', (3, 3, 2), 0.2, inner)}</gml:interior></gml:Solid></bldg:lod1Solid>"
            "</bldg:Building></cityObjectMember></CityModel>"
        )
        return path

    assert geometry_issues(file("+", "-")) == ()
    assert kinds(geometry_issues(file("-", "-"))) == ["iso19107.405"]
    assert kinds(geometry_issues(file("+", "+"))) == ["iso19107.405"]


def polygons(faces, shift=(0, 0, 0), size=1.0):
    """Polygons of GML as surface members."""
    members = []
    for face in faces:
        points = CORNERS[[*face, face[0]]] * size + shift
        text = " ".join(f"{value:g}" for point in points for value in point)
        members.append(
            "<gml:surfaceMember><gml:Polygon><gml:exterior><gml:LinearRing><gml:posList>"
            f"{text}</gml:posList></gml:LinearRing></gml:exterior></gml:Polygon>"
            "</gml:surfaceMember>"
        )
    return "".join(members)


def solid(faces, shift=(0, 0, 0), size=1.0):
    """A solid of GML 3.1."""
    surface = f"<gml:CompositeSurface>{polygons(faces, shift, size)}</gml:CompositeSurface>"
    return f"<gml:Solid><gml:exterior>{surface}</gml:exterior></gml:Solid>"


ALL = [ring for rings in FACES.values() for ring in rings]


@pytest.fixture
def older(tmp_path):
    """Writes CityGML 2.0 of a member, and returns the codes of its issues."""

    def check(member, envelope=""):
        path = tmp_path / "old.gml"
        path.write_text(
            '<CityModel xmlns="http://www.opengis.net/citygml/2.0" '
            'xmlns:gml="http://www.opengis.net/gml" '
            'xmlns:veg="http://www.opengis.net/citygml/vegetation/2.0" '
            'xmlns:bldg="http://www.opengis.net/citygml/building/2.0">'
            f"{envelope}<cityObjectMember>{member}</cityObjectMember></CityModel>"
        )
        return [kind.removeprefix("iso19107.") for kind in kinds(geometry_issues(path))]

    return check


def in_building(name, geometry):
    return f'<bldg:Building gml:id="b"><bldg:{name}>{geometry}</bldg:{name}></bldg:Building>'


def test_a_composite_surface_may_be_open_but_not_in_pieces(older):
    def surfaces(name, faces):
        members = f"<gml:{name}>{polygons(faces)}</gml:{name}>"
        if name == "CompositeSurface":
            members = f"<gml:surfaceMember>{members}</gml:surfaceMember>"
            members = f"<gml:MultiSurface>{members}</gml:MultiSurface>"
        return in_building("lod2MultiSurface", members)

    assert older(surfaces("CompositeSurface", ALL[:5])) == []
    assert older(surfaces("MultiSurface", ALL[:2])) == []
    assert older(surfaces("CompositeSurface", ALL[:2])) == ["305"]


@pytest.mark.parametrize(
    ("name", "shift", "codes"),
    [
        ("CompositeSolid", (10, 0, 0), []),
        ("CompositeSolid", (20, 0, 0), ["503"]),
        ("CompositeSolid", (9, 0, 0), ["501"]),
        ("CompositeSolid", (0, 0, 0), ["502"]),
        ("MultiSolid", (20, 0, 0), []),
        ("MultiSolid", (9, 0, 0), ["601"]),
    ],
)
def test_several_solids_in_one_geometry(older, name, shift, codes):
    members = "".join(
        f"<gml:solidMember>{solid(ALL, each)}</gml:solidMember>" for each in ((0, 0, 0), shift)
    )

    assert older(in_building("lod2Solid", f"<gml:{name}>{members}</gml:{name}>")) == codes


def test_an_installation_is_compared_at_the_level_and_not_by_property(older):
    def building(level):
        outer = "".join(
            f"<bldg:outerBuildingInstallation><bldg:BuildingInstallation gml:id='{name}'>"
            f"<bldg:{name}>{solid(ALL, (9, 0, 0))}</bldg:{name}>"
            "</bldg:BuildingInstallation></bldg:outerBuildingInstallation>"
            for name in [f"lod{level}Geometry"]
        )
        body = f"<bldg:lod3Solid>{solid(ALL)}</bldg:lod3Solid>"
        return f'<bldg:Building gml:id="b">{body}{outer}</bldg:Building>'

    assert older(building(2)) == []
    assert older(building(3)) == ["601"]


def test_a_polygon_in_the_surface_of_a_solid_counts_once(older, tmp_path):
    bent = solid(ALL).replace("0 0 6 10 0 6", "0 0 6 10 0 7", 1)

    assert older(in_building("lod2Solid", bent)) == ["203"]
    (issue,) = geometry_issues(tmp_path / "old.gml")
    assert "the first of" not in issue.message


@pytest.mark.parametrize("mirror", ["", "-"])
@pytest.mark.parametrize("size", [1.0, 1e4])
@pytest.mark.parametrize(("faces", "codes"), [(ALL, []), (ALL[:5], ["302"])])
def test_a_template_is_checked_in_its_size_and_not_as_degrees(older, size, faces, codes, mirror):
    """A tree at a place in degrees; its template is a box of 10 m x 8 m x 6 m."""
    envelope = (
        '<gml:boundedBy><gml:Envelope srsName="EPSG:4326" srsDimension="3"><gml:lowerCorner>'
        "11.4 48.7 0</gml:lowerCorner><gml:upperCorner>11.5 48.8 9</gml:upperCorner>"
        "</gml:Envelope></gml:boundedBy>"
    )
    matrix = f"{mirror}{size} 0 0 0 0 {size} 0 0 0 0 {size} 0 0 0 0 1"
    tree = (
        '<veg:SolitaryVegetationObject gml:id="t"><veg:lod2ImplicitRepresentation>'
        f"<ImplicitGeometry><transformationMatrix>{matrix}</transformationMatrix>"
        f"<relativeGMLGeometry>{solid(faces, size=1 / size)}</relativeGMLGeometry>"
        "<referencePoint><gml:Point><gml:pos>11.42 48.73 3</gml:pos></gml:Point></referencePoint>"
        "</ImplicitGeometry></veg:lod2ImplicitRepresentation></veg:SolitaryVegetationObject>"
    )

    assert older(tree, envelope) == codes


@pytest.mark.parametrize(
    ("srs", "order"), [("EPSG:25832", [0, 1, 2]), ("urn:ogc:def:crs:EPSG::31468", [1, 0, 2])]
)
def test_axes_that_are_swapped_do_not_turn_bodies_inside_out(written, srs, order):
    path = written(box("b", shift=(4468500.0, 5333500.0, 500.0)))

    def reorder(found):
        points = np.array(found[2].split()).reshape(-1, 3)[:, order]
        return found[1] + " ".join(points.ravel())

    lists = r"(<gml:(?:posList|\w+Corner)[^>]*>)([^<]*)"
    text = re.sub(lists, reorder, path.read_text())
    path.write_text(re.sub(r"<gml:Envelope ", f'<gml:Envelope srsName="{srs}" ', text, count=1))

    assert geometry_issues(path) == ()


def test_what_is_no_citygml(tmp_path, citygml_schemas):
    page, text = tmp_path / "page.xml", tmp_path / "text.gml"
    page.write_text("<html/>")
    text.write_text("no xml")

    with pytest.raises(EnvgenError, match="not CityGML"):
        schema_issues(page, citygml_schemas)
    with pytest.raises(EnvgenError, match="not well-formed"):
        schema_issues(text, citygml_schemas)
    with pytest.raises(EnvgenError, match="cannot be read"):
        schema_issues(tmp_path / "none.gml", citygml_schemas)


class Web:
    """A tiny CityGML 3.0 at the standard's address; some schemas name others by full address."""

    def __init__(self):
        self.asked = []

    def __call__(self, address):
        self.asked.append(address)
        head, _, path = address.partition("schemas.opengis.net/citygml/")
        if "w3.org" in address:
            body, namespace = "", "http://www.w3.org/1999/xlink"
        elif path == "3.0/core.xsd":
            body = (
                '<xs:import namespace="http://www.w3.org/1999/xlink"'
                ' schemaLocation="http://www.w3.org/1999/xlink.xsd"/>'
                '<xs:element name="CityModel" type="xs:string"/>'
            )
            namespace = "http://www.opengis.net/citygml/3.0"
        else:
            body = (
                '<xs:import namespace="http://www.opengis.net/citygml/3.0"'
                ' schemaLocation="../../3.0/core.xsd"/>'
            )
            namespace = f"http://www.opengis.net/citygml/{path.rpartition('/')[0]}"
        assert head in ("https://", address)
        return (
            f'<xs:schema xmlns:xs="http://www.w3.org/2001/XMLSchema" targetNamespace="{namespace}"'
            f' elementFormDefault="qualified">{body}</xs:schema>'
        ).encode()


def test_schemas_are_fetched_once(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    web = Web()

    load_schema("3.0", fetched_by=web)
    number = len(web.asked)
    load_schema("3.0", fetched_by=web)

    assert "https://schemas.opengis.net/citygml/building/3.0/building.xsd" in web.asked
    assert len(web.asked) == len(set(web.asked)) == number == 18


def test_without_a_network_the_error_says_what_to_do(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setenv("https_proxy", "http://127.0.0.1:9")

    with pytest.raises(EnvgenError, match=r"--schemas FOLDER.*--no-schema"):
        load_schema("3.0")
    assert not list(tmp_path.rglob("*.xsd"))


def test_an_answer_that_is_no_schema_is_not_kept(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))

    with pytest.raises(EnvgenError, match="not a schema"):
        load_schema("3.0", fetched_by=lambda _: b"<html>login")
    assert not list(tmp_path.rglob("*.xsd"))


def test_a_folder_without_schemas(tmp_path):
    with pytest.raises(EnvgenError, match="holds no schema"):
        load_schema("3.0", tmp_path)
    with pytest.raises(EnvgenError, match="choose from 1"):
        load_schema("4.0", tmp_path)
