"""The faces of traffic signs: their drawings, their atlas, and which signal shows which."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from pxr import Usd, UsdGeom

from envgen_usd.assets.asset_catalogue import read_catalogue
from envgen_usd.assets.library_author import SHIPPED
from envgen_usd.assets.shapes.printed_shapes import printed_designs
from envgen_usd.assets.signs.sign_choice import SignalFacts, sign_face
from envgen_usd.assets.signs.sign_drawing import draw, plate_area, read_drawing_kit
from envgen_usd.assets.signs.sign_sheets import (
    SignFace,
    faces,
    read_prints,
    read_shop_names,
    read_sign_sheets,
)
from envgen_usd.errors import EnvgenError

LIBRARY = read_catalogue()
KIT = read_drawing_kit(LIBRARY.folder)


def face_of(*facts):
    """Face of a signal by country, type, and as many of subtype, name, text, value as are given."""
    return sign_face(SignalFacts(*facts, *("-1", "", "", 0.0)[len(facts) - 2 :]), LIBRARY.signs)


def colour_at(asset, face, y, z):
    """Colour of the face at a place in metres from its middle, sRGB 0 to 255."""
    stage = Usd.Stage.Open(str(LIBRARY.folder / LIBRARY.assets[asset].path))
    stage.SetEditTarget(stage.GetSessionLayer())
    stage.GetDefaultPrim().GetVariantSet("face").SetVariantSelection(face)
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath(f"/{asset}/Geometry/Face"))
    points = np.asarray(mesh.GetPointsAttr().Get())[
        np.asarray(mesh.GetFaceVertexIndicesAttr().Get())
    ]
    st = np.asarray(UsdGeom.PrimvarsAPI(mesh).GetPrimvar("st").ComputeFlattened())
    low, high = points[:, 1:].min(axis=0), points[:, 1:].max(axis=0)
    share = ((low + high) / 2 + (y, z) - low) / (high - low)
    u, v = st.min(axis=0) + share * (st.max(axis=0) - st.min(axis=0))
    picture = LIBRARY.folder / "textures" / f"{asset.replace('traffic_sign', 'sign')}_colour.png"
    with Image.open(picture) as image:
        return image.getpixel((int(u * image.width), int((1 - v) * image.height)))[:3]


@pytest.mark.parametrize(
    ("signal", "face"),
    [
        (("de", "274", "56", "", "", 60.0), ("traffic_sign_de_speeds", "limit_60")),
        (("opendrive", "274", "57", "", "", 19.444), ("traffic_sign_de_speeds", "limit_70")),
        (("de", "278", "62"), ("traffic_sign_de_speeds", "limit_ends_120")),
        (("", "DE:274[60]", ""), ("traffic_sign_de_speeds", "limit_60")),
        (("", "DE:274-60", ""), ("traffic_sign_de_speeds", "limit_60")),
        (("", "", "", "de_274-50"), ("traffic_sign_de_speeds", "limit_50")),
        (("", "speed", "max", "maxspeed", "30", 30.0), ("traffic_sign_de_speeds", "limit_30")),
        (("belgium", "274", "-1", "Sign_4904", "", 13.889), ("traffic_sign_de_speeds", "limit_50")),
        (("se", "c", "31", "speed_50_1", "", 5.0), ("traffic_sign_de_speeds", "limit_50")),
        (("se", "a", "20", "", "", 1.0), ("traffic_sign_de_warnings", "road_works")),
        (("opendrive", "205"), ("traffic_sign_de_orders", "yield")),
        (("", "give_way", "", "give_way"), ("traffic_sign_de_orders", "yield")),
        (("opendrive", "-1", "-1", "Sign_Stop"), ("traffic_sign_de_orders", "stop")),
        (("", "", "", "StopSign"), ("traffic_sign_de_orders", "stop")),
        (("us", "R1-1"), ("traffic_sign_us", "stop")),
        (("us", "R2-1", "", "", "", 35.0), ("traffic_sign_us", "limit_35")),
        (("", "-1", "-1", "Sign_SpeedLimit_25"), ("traffic_sign_de_speeds", "limit_25")),
        (("", "DE:250,DE:1024-16", ""), ("traffic_sign_de_orders", "closed")),
        (("de", "430", "10"), ("traffic_sign_de_guides", "motorway_arrow_left")),
        (("", "city_limit", "", "Karlsruhe"), ("traffic_sign_de_guides", "place_karlsruhe")),
        (("us", "274"), None),
        (("de", "-1", "-1", "Unknown"), None),
        (("fr", "B14"), None),
    ],
)
def test_a_signal_shows_the_face_of_its_code(signal, face):
    assert face_of(*signal) == face


def test_there_are_faces_of_both_catalogues():
    counts = {sheet.name: len(list(faces(sheet))) for sheet in LIBRARY.signs}
    assert sum(count for name, count in counts.items() if name.startswith("de")) >= 100
    assert counts["us"] >= 40
    assert max(counts.values()) <= 64, "the check of a library warns above"


def test_no_code_stands_for_two_faces():
    codes = [
        (countries, code)
        for countries in {sheet.countries for sheet in LIBRARY.signs}
        for sheet in LIBRARY.signs
        if sheet.countries == countries
        for row in sheet.face
        for code in row.codes
    ]
    assert len(codes) == len(set(codes))


@pytest.mark.parametrize(
    "sheet",
    [*LIBRARY.signs, read_shop_names(SHIPPED), read_prints(SHIPPED)],
    ids=lambda sheet: sheet.name,
)
def test_drawings_lie_on_their_plates(sheet):
    for face in faces(sheet):
        plate = plate_area(face.plate, face.width, face.height)
        left, low, right, high = plate.bounds
        assert (right - left, high - low) == pytest.approx((face.width, face.height), abs=1e-6)
        areas = draw(face, KIT)
        assert areas[0][1].area == pytest.approx(plate.area, rel=1e-6), "the ground fills the plate"
        assert all(area.within(plate.buffer(1e-6)) for _, area in areas), face.name


@pytest.mark.parametrize("missing", ["meter_panel", "mail_tall", "poster_"])
def test_a_missing_print_is_named(missing):
    sheet = read_prints(SHIPPED)
    rest = tuple(row for row in sheet.face if not row.name.startswith(missing))
    with pytest.raises(EnvgenError, match=rf"sheet prints: .*'{missing}'"):
        printed_designs(replace(sheet, face=rest))


def test_a_panel_shows_its_poster_on_both_sides():
    """Seen from behind, the poster's left edge lies where its right edge lies from the front."""
    designs = {design.name: design for design in printed_designs(read_prints(SHIPPED))}
    (face,) = [p.mesh for p in designs["hoarding"].models["sale"].parts if p.name == "Print"]
    for side in (1.0, -1.0):
        shown = face.normals[:, 0] * side > 0.99
        places = face.points[face.face_vertices[shown]]
        assert np.corrcoef(side * places[:, 1], face.uv[shown, 0])[0, 1] > 0.99
        assert np.corrcoef(places[:, 2], face.uv[shown, 1])[0, 1] > 0.99


def test_colours_are_where_the_regulation_says():
    """StVO: red borders and white grounds of limits, red octagons, white arrows on blue."""
    red, _, blue = colour_at("traffic_sign_de_speeds", "limit_60", 0.28, 0.0)
    assert red > 2.5 * blue
    assert min(colour_at("traffic_sign_de_speeds", "limit_60", 0.0, 0.19)) > 150
    assert max(colour_at("traffic_sign_de_orders", "priority_road", 0.0, 0.39)) > 150
    red, green, blue = colour_at("traffic_sign_de_orders", "priority_road", 0.0, 0.0)
    assert red > green > 2 * blue
    red, _, blue = colour_at("traffic_sign_de_orders", "stop", 0.0, 0.3)
    assert red > 2.5 * blue
    red, _, blue = colour_at("traffic_sign_de_orders", "turn_right", 0.2, -0.1)
    assert blue > 2 * red
    assert min(colour_at("traffic_sign_de_orders", "turn_right", 0.18, 0.03)) > 150
    red, _, blue = colour_at("traffic_sign_de_orders", "turn_left", 0.19, 0.03)
    assert blue > 2 * red, "the arrow points to the viewer's left"


def test_a_library_without_signs_has_none(tmp_path):
    assert read_sign_sheets(tmp_path) == ()


@pytest.mark.parametrize(
    ("drawing", "fault"),
    [
        ("mauve plate", "unknown colour 'mauve'"),
        ("red blob 0.1", "'blob 0.1' cannot be drawn"),
        ("red symbol dragon 0.1 0,0", "dragon"),
        ("red line 0.1", "'line 0.1' cannot be drawn"),
    ],
)
def test_faults_of_a_drawing_name_the_face(drawing, fault):
    with pytest.raises(EnvgenError, match=fault) as error:
        draw(SignFace("new_face", "round", 0.6, 0.6, drawing), KIT)
    assert "new_face" in str(error.value)


def test_a_face_without_a_variant_is_a_fault(tmp_path):
    for folder in ("materials", "assets"):
        (tmp_path / folder).mkdir()
    (tmp_path / "signs").mkdir()
    sheet = Path(LIBRARY.folder / "signs" / "de_speeds.toml")
    (tmp_path / "signs" / "mine.toml").write_text(sheet.read_text())
    with pytest.raises(EnvgenError, match="face 'limit_50' is no variant of the set 'face'"):
        read_catalogue(tmp_path)
