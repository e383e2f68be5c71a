"""What fuzzing found (`tools/fuzz.py`): each of these inputs once ended in a traceback."""

import os
import shutil
import socket
import struct
import subprocess
import sys
import zlib
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from importlib import resources
from pathlib import Path

import numpy as np
import pytest
import rasterio
from rasterio.transform import Affine

from envgen_usd.assets import crate_guard
from envgen_usd.assets.asset_catalogue import read_catalogue, scan_library
from envgen_usd.assets.crate_guard import deadly_layers
from envgen_usd.assets.library_check import check_library
from envgen_usd.chunks import chunks_of_points
from envgen_usd.citygml.city_validation import geometry_issues, schema_issues
from envgen_usd.citygml.read import read_city
from envgen_usd.cityjson.cityjson_validation import cityjson_issues
from envgen_usd.cityjson.read import read_cityjson
from envgen_usd.datasets.frame_files import read_image
from envgen_usd.environment_files import read_profile
from envgen_usd.errors import EnvgenError
from envgen_usd.geometry.raster_files import raster_files
from envgen_usd.landuse.given_landuse import read_given_landuse
from envgen_usd.landuse.osm_landuse import read_osm
from envgen_usd.light.weather import read_weather
from envgen_usd.opendrive.reader import read_network
from envgen_usd.opendrive.surface import build_surface
from envgen_usd.places.osm_place import read_osm_place
from envgen_usd.recipe.build_options import demo_road
from envgen_usd.recipe.dataset_recipe import read_recipe, recipe_file
from envgen_usd.render.cameras.camera_pose import Pose, look_at
from envgen_usd.render.cameras.sensor_rig import read_rig
from envgen_usd.render.frames.frame_export import render_frames
from envgen_usd.render.render_scene import Texture
from envgen_usd.render.stage.texture_images import read_texture
from envgen_usd.terrain.dem_geotiff import read_dem
from envgen_usd.traffic.open_scenario.scenario_file import ScenarioFile
from envgen_usd.traffic.traces.sumo_fcd import read_fcd

SHIPPED = Path(str(resources.files("envgen_usd.asset_library")))
SEEDS = Path(__file__).resolve().parents[1] / "tools" / "fuzz_seeds"
SMALL_RIG = "[camera]\nwidth = 200\nheight = 100\nfx = 100.0\nfy = 100.0\ncx = 99.5\ncy = 49.5\n"
"""What is wrong with a stage shows before a pixel is drawn."""


def refused(read: Callable[[Path], object], path: Path) -> str:
    """The error, which has to name the file on a single line."""
    with pytest.raises(EnvgenError) as caught:
        read(path)
    said = str(caught.value)
    assert str(path) in said
    assert "\n" not in said
    return said


@pytest.mark.parametrize(
    "read", [lambda path: read_texture(Texture(str(path), srgb=True)), read_image]
)
def test_a_picture_of_too_many_pixels_is_a_refusal(
    read: Callable[[Path], object], tmp_path: Path
) -> None:
    """25 kB that unpack to 196 million pixels: Pillow's error for that is none of a file."""
    path, side = tmp_path / "bomb.png", 14_000
    rows = zlib.compress(bytes(side * (1 + side // 8)), 9)
    head = struct.pack(">IIBBBBB", side, side, 1, 0, 0, 0, 0)
    parts = [(b"IHDR", head), (b"IDAT", rows), (b"IEND", b"")]
    chunks = [
        struct.pack(">I", len(content))
        + kind
        + content
        + struct.pack(">I", zlib.crc32(kind + content))
        for kind, content in parts
    ]
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(chunks))
    assert path.stat().st_size < 30_000
    refused(read, path)


def test_an_empty_texture_is_a_refusal(tmp_path: Path) -> None:
    """OpenUSD has no buffer of an empty file."""
    (tmp_path / "empty.png").touch()
    refused(lambda path: read_texture(Texture(str(path), srgb=True)), tmp_path / "empty.png")


def test_landuse_that_leaves_rows_of_plots_without_their_first() -> None:
    """A file of the fuzzer; the plots behind have no way, and are left out."""
    surface = build_surface(read_network(demo_road("straight")))
    chunks = chunks_of_points(surface.vertices, 100.0)
    provider = read_given_landuse(SEEDS / "headless_rows.tif", surface, chunks)
    maps = provider.generate(surface, chunks, read_profile("1", "residential"), 0)
    assert maps


@pytest.mark.parametrize("name", ["A" * 300, "A" * 300 + ".toml", "a\0b", "a\0b.toml"])
def test_names_that_no_file_can_have_are_unknown(name: str) -> None:
    for read in (read_rig, read_weather, recipe_file):
        with pytest.raises(EnvgenError):
            read(name)


@pytest.mark.parametrize("key", ["rigs", "weathers"])
def test_a_recipe_with_such_a_name_is_refused(key: str, tmp_path: Path) -> None:
    recipe = Path(str(resources.files("envgen_usd.renders") / "recipes" / "article.toml"))
    text = recipe.read_text("utf-8")
    line = next(line for line in text.splitlines() if line.startswith(f"{key} = "))
    path = tmp_path / "recipe.toml"
    path.write_text(text.replace(line, f'{key} = ["{"A" * 300}"]'))
    refused(read_recipe, path)


def test_a_character_that_xml_lacks_is_said_in_a_line(tmp_path: Path) -> None:
    content = Path(str(demo_road())).read_bytes()
    (tmp_path / "nul.xodr").write_bytes(content[:1] + b"\0" + content[1:])
    said = refused(read_network, tmp_path / "nul.xodr")
    assert "Char 0x0 out of allowed range. Give" in said


def test_a_file_that_breaks_off_at_such_a_character_is_an_issue_of_a_line(tmp_path: Path) -> None:
    content = Path(str(demo_road())).read_bytes()
    at = content.rindex(b"<planView")
    (tmp_path / "nul.xodr").write_bytes(content[:at] + b"\0" + content[at:])
    issues = {issue.kind: issue.message for issue in read_network(tmp_path / "nul.xodr").issues}
    assert issues["file.broken"].endswith(": Invalid character: Char 0x0 out of allowed range")


def test_a_name_that_xml_does_not_allow_is_a_refusal(tmp_path: Path) -> None:
    """What is recovered of a broken file may have such names."""
    content = Path(str(demo_road())).read_bytes()
    assert b"<header" in content
    path = tmp_path / "name.xodr"
    path.write_bytes(content.replace(b"<header", b"<heade:T0:38", 1))
    refused(read_network, path)


@pytest.mark.parametrize("read", [read_city, geometry_issues, schema_issues])
def test_a_prefix_that_is_not_declared_is_a_refusal(
    read: Callable[[Path], object], tmp_path: Path
) -> None:
    text = (SEEDS / "house.gml").read_text()
    assert "<CityModel" in text
    path = tmp_path / "house.gml"
    path.write_text(text.replace("CityModel", "core:CityModel"))
    refused(read, path)


@pytest.mark.parametrize("read", [read_osm, read_osm_place])
@pytest.mark.parametrize(
    ("good", "bad"),
    [
        ('lat="48.1003"', 'lat="48.1_003"'),
        ('id="3"', 'id="711901742.9"'),
        ('ref="3"', 'ref="x"'),
        ('lon="11.503"', 'lon="911.503"'),
    ],
)
def test_numbers_that_an_extract_cannot_have(
    read: Callable[[Path], object], good: str, bad: str, tmp_path: Path
) -> None:
    text = (SEEDS / "town.osm").read_text()
    assert good in text
    path = tmp_path / "town.osm"
    path.write_text(text.replace(good, bad))
    refused(read, path)


SURFACE = """<CityModel xmlns="http://www.opengis.net/citygml/2.0"
 xmlns:gml="http://www.opengis.net/gml" xmlns:bldg="http://www.opengis.net/citygml/building/2.0">
<cityObjectMember><bldg:Building gml:id="a"><bldg:lod1MultiSurface><gml:MultiSurface>
<gml:surfaceMember><gml:Polygon><gml:exterior><gml:LinearRing><gml:posList srsDimension="3">
0 0 0 9 0 0 9 9 1e99 0 9 0 0 0 0</gml:posList></gml:LinearRing></gml:exterior></gml:Polygon>
</gml:surfaceMember></gml:MultiSurface></bldg:lod1MultiSurface></bldg:Building></cityObjectMember>
</CityModel>"""


def test_a_polygon_of_no_solid_beyond_the_earth_is_a_fault(tmp_path: Path) -> None:
    """A fault of a polygon without a shell was looked up among the shells."""
    path = tmp_path / "city.gml"
    path.write_text(SURFACE)
    assert [issue.kind for issue in geometry_issues(path)] == ["iso19107.901"]


EMPTY = """<CityModel xmlns="http://www.opengis.net/citygml/2.0"
 xmlns:gml="http://www.opengis.net/gml" xmlns:bldg="http://www.opengis.net/citygml/building/2.0">
<cityObjectMember><bldg:Building gml:id="a"><bldg:consistsOfBuildingPart><bldg:BuildingPart>SOLID
</bldg:BuildingPart></bldg:consistsOfBuildingPart><bldg:consistsOfBuildingPart><bldg:BuildingPart>
SOLID</bldg:BuildingPart></bldg:consistsOfBuildingPart></bldg:Building></cityObjectMember>
</CityModel>"""
NOTHING = """<bldg:lod2Solid><gml:Solid><gml:exterior><gml:CompositeSurface><gml:surfaceMember
 xmlns:x="-inf" x:href="#b"/></gml:CompositeSurface></gml:exterior></gml:Solid></bldg:lod2Solid>"""


def test_solids_without_a_polygon_are_faults(tmp_path: Path) -> None:
    """They were compared with one another, as all solids of a building are."""
    path = tmp_path / "city.gml"
    path.write_text(EMPTY.replace("SOLID", NOTHING))
    assert {issue.kind for issue in geometry_issues(path)} == {"iso19107.902"}


@pytest.mark.parametrize(
    ("name", "read"),
    [
        ("house.gml", read_city),
        ("house.gml", geometry_issues),
        ("house.gml", schema_issues),
        ("fcd.xml", read_fcd),
        ("drive.xosc", ScenarioFile),
    ],
)
def test_characters_that_xml_has_not_are_told_in_one_line(
    name: str, read: Callable[[Path], object], tmp_path: Path
) -> None:
    text = (SEEDS / name).read_text()
    path = tmp_path / name
    path.write_text(text.replace("=", "=\x00", 7))
    refused(read, path)


@pytest.mark.parametrize(
    ("good", "bad"),
    [
        ("[[0,3,2,1]]", "[[0,3,2,99999999999999999999]]"),
        ('"type": "GroundSurface"', '"type": "GroundSurface", "children": [0]'),
        ('"storeys": 2', f'"storeys": {"[" * 100_000}{"]" * 100_000}'),
        ('"storeys": 2', '"storeys": 1e999'),
    ],
)
def test_values_that_cityjson_cannot_have(good: str, bad: str, tmp_path: Path) -> None:
    """The only building is left out, or the file is refused."""
    text = (SEEDS / "house.json").read_text()
    assert good in text
    path = tmp_path / "house.json"
    path.write_text(text.replace(good, bad))
    for read in (read_cityjson, cityjson_issues):
        with suppress(EnvgenError):
            read(path)


@pytest.mark.parametrize(
    "place",
    [
        Affine(
            1e24, 0, -2e24, 0, -1e24, 2e24
        ),  # a metre is no part of a pixel that a number can tell
        Affine(1e-300, 0, -10, 0, -1e-300, 10),
        Affine(1, 1, 0, 1, 1, 0),
        Affine(float("inf"), 0, 0, 0, 1, 0),
    ],
)
def test_pixels_without_a_size_are_refused(place: Affine, tmp_path: Path) -> None:
    path = tmp_path / "dem.tif"
    with rasterio.open(path, "w", "GTiff", 4, 4, 1, dtype="float32", transform=place) as file:
        file.write(np.zeros((4, 4), np.float32), 1)
    surface = build_surface(read_network(demo_road("straight")))
    refused(partial(read_dem, surface=surface), path)


VRT = """<VRTDataset rasterXSize="10" rasterYSize="10">
<GeoTransform>-500,100,0,500,0,-100</GeoTransform><VRTRasterBand dataType="Float32" band="1">
<SimpleSource><SourceFilename>/vsicurl/ADDRESS/x.tif</SourceFilename><SourceBand>1</SourceBand>
</SimpleSource></VRTRasterBand></VRTDataset>"""
TILES = """<GDAL_WMS><Service name="TMS"><ServerUrl>ADDRESS/${z}/${x}/${y}.png</ServerUrl></Service>
<DataWindow><UpperLeftX>-500</UpperLeftX><UpperLeftY>500</UpperLeftY><LowerRightX>500</LowerRightX>
<LowerRightY>-500</LowerRightY><TileLevel>1</TileLevel><TileCountX>1</TileCountX>
<TileCountY>1</TileCountY></DataWindow><BandsCount>1</BandsCount></GDAL_WMS>"""


@pytest.mark.parametrize("text", [VRT, TILES], ids=["file", "tiles"])
def test_a_raster_that_names_a_server_reaches_none(text: str, tmp_path: Path) -> None:
    path = tmp_path / "dem.vrt"
    surface = build_surface(read_network(demo_road("straight")))
    with socket.create_server(("127.0.0.1", 0)) as server:
        server.settimeout(0.1)
        path.write_text(text.replace("ADDRESS", f"http://127.0.0.1:{server.getsockname()[1]}"))
        for read in (raster_files, partial(read_dem, surface=surface)):
            with suppress(EnvgenError):
                read(path)
            with pytest.raises(TimeoutError):
                server.accept()


@pytest.fixture
def library(tmp_path: Path) -> Path:
    """A library of benches."""
    shipped = Path(str(resources.files("envgen_usd.asset_library")))
    shutil.copytree(shipped / "assets" / "bench", tmp_path / "assets" / "bench")
    (tmp_path / "materials").mkdir()
    return tmp_path


def test_links_in_a_circle_are_faults_of_a_library(library: Path) -> None:
    payload = sorted(library.rglob("payload/*.usdc"))[0]
    payload.unlink()
    payload.symlink_to(payload.name)
    catalogue, _ = scan_library(library)
    assert "library.outside" in {issue.kind for issue in check_library(catalogue)}


@pytest.mark.parametrize(
    "value", ["1.0", '"x"', "[]", "[(1, 2)]", "{}", "[(nan, 0, 0), (1, 1, 1)]"]
)
@pytest.mark.parametrize(
    "name", ["float3[] extentsHint", "double3 nominal_size", "token[] semantics"]
)
def test_metadata_of_another_type_are_faults_of_a_library(
    name: str, value: str, library: Path
) -> None:
    path = next(library.rglob("usd/*.usda"))
    lines = path.read_text().splitlines()
    changed = [
        f"{line.partition('=')[0]}= {value}" if name.split()[1] in line else line for line in lines
    ]
    assert changed != lines
    path.write_text("\n".join(changed))
    catalogue, faults = scan_library(library)
    assert all(str(path) in fault for fault in faults)
    assert faults or check_library(catalogue)


def test_a_payload_that_cannot_be_unpacked_is_a_fault_of_a_library(library: Path) -> None:
    """OpenUSD opens it, and fails where its values are read."""
    path = sorted(library.rglob("payload/*.usdc"))[0]
    whole = path.read_bytes()
    kinds = set()
    for place in range(96, len(whole) - 400, len(whole) // 12):
        path.write_bytes(whole[:place] + b"\xff" * 24 + whole[place + 24 :])
        catalogue, _ = scan_library(library)
        kinds |= {issue.kind for issue in check_library(catalogue)}
    assert "library.unreadable" in kinds


@pytest.mark.parametrize(
    ("good", "bad"),
    [('["xformOp:translate", "xformOp:orient"]', '["", "xformOp:orient"]')],
)
def test_faults_that_openusd_raises_are_told(good: str, bad: str, tmp_path: Path) -> None:
    text = (SEEDS / "stage.usda").read_text()
    assert good in text
    path = tmp_path / "stage.usda"
    path.write_text(text.replace(good, bad))
    pose = Pose(look_at(np.array([0.0, 0.0, 1.5]), np.array([0.0, 10.0, 1.5])))
    with pytest.raises(EnvgenError, match="OpenUSD cannot evaluate the stage") as caught:
        render_frames(path, tmp_path / "frames", poses=[pose], cache=False)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("good", "bad", "kinds"),
    [
        ("int[] faceVertexCounts", "it[] faceVertexCounts", {"stage.mesh"}),
        ("int[] faceVertexIndices", "it[] faceVertexIndices", {"stage.mesh"}),
        ("point3f[] points", "point7f[] points", {"stage.mesh"}),
        ("float inputs:intensity = 500", 'string inputs:intensity = "5"', {"stage.lamp"}),
        ("normal3f[] normals", "normul3f[] normals", set()),
        ("texCoord2f[] primvars:st", "texCord2f[] primvars:st", set()),
        ("color3f inputs:diffuseColor", "color7f inputs:diffuseColor", {"material.value"}),
        ("inputs:roughness = 0.6", "inputs:roughness = nan", {"material.value"}),
        ("float inputs:intensity = 500", "floav inputs:intensity = 500", {"stage.lamp"}),
        ("inputs:intensity = 500", "inputs:exposure = 5000", {"stage.lamp"}),
        ("float inputs:radius", "floav inputs:radius", {"stage.lamp"}),
        ("float inputs:intensity = 5\n", "floav inputs:intensity = 5\n", {"light.value"}),
        ("inputs:intensity = 5\n", "inputs:intensity = inf\n", {"light.value"}),
        ("(40, 0, 20)", "(nan, 0, 20)", {"light.value"}),
        (
            'def DistantLight "Sun"',
            'def DomeLight "A" {\n asset inputs:texture:file = @a.exr@\n}\ndef DistantLight "Sun"',
            {"light.texture"},
        ),
        ("point3f[] points = [(0, 0, 0), (0.5,", "float[] points = [0, 0, 0] #", {"stage.mesh"}),
        ("double size", "doable size", {"stage.value"}),
        ("double size = 1", "double size = inf", {"stage.value"}),
        ("int[] protoIndices", "it[] protoIndices", {"stage.instancer"}),
        (
            "int[] curveVertexCounts = [3]\n        point3f[]",
            'string userProperties:lane_id = "a"\n        pint[]',
            {"stage.lane"},
        ),
    ],
)
def test_values_that_cannot_be_used_are_issues(
    good: str, bad: str, kinds: set[str], tmp_path: Path
) -> None:
    """Types that USD does not know, other types than the schema's, and numbers without an end."""
    text = (SEEDS / "stage.usda").read_text()
    assert good in text
    path = tmp_path / "stage.usda"
    path.write_text(text.replace(good, bad))
    pose = Pose(look_at(np.array([0.0, 0.0, 1.5]), np.array([0.0, 10.0, 1.5])))
    rig = tmp_path / "rig.toml"
    rig.write_text(SMALL_RIG)
    result = render_frames(path, tmp_path / "frames", rig=str(rig), poses=[pose], cache=False)
    assert {issue.kind for issue in result.issues} >= kinds
    assert len([*(tmp_path / "frames").glob("rgb/*.png")]) == 1


@pytest.mark.parametrize("metres", ["nan", "inf", "0", "-1"])
def test_units_that_are_no_length_are_a_refusal(metres: str, tmp_path: Path) -> None:
    text = (SEEDS / "stage.usda").read_text()
    assert "metersPerUnit = 1\n" in text
    path = tmp_path / "stage.usda"
    path.write_text(text.replace("metersPerUnit = 1\n", f"metersPerUnit = {metres}\n"))
    said = refused(lambda path: render_frames(path, tmp_path / "frames", cache=False), path)
    assert "metersPerUnit is" in said


@pytest.mark.parametrize(("seed", "variant"), [("deadly_value", "steel"), ("deadly_path", "stone")])
def test_a_binary_layer_that_ends_its_reader_is_a_fault_of_the_asset(
    seed: str, variant: str, tmp_path: Path
) -> None:
    """A few changed bits in payloads of the shipped bench, at which OpenUSD 26.8 crashes."""
    folder = tmp_path / "library"
    shutil.copytree(SHIPPED / "assets" / "bench", folder / "assets" / "bench")
    (folder / "materials").mkdir()
    for name in ("metal_dark", "wood", "concrete"):  # of the bench
        shutil.copy(SHIPPED / "materials" / f"{name}.usda", folder / "materials")
    payload = Path(f"assets/bench/bench/payload/{variant}.usdc")
    shutil.copy(SEEDS / f"{seed}.usdc", folder / payload)
    found = [each for each in check_library(read_catalogue(folder)) if "bench" in each.where]
    assert [(each.kind, each.where) for each in found] == [("library.unreadable", str(payload))]


def test_a_layer_that_keeps_its_reader_busy_is_found(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """A pipe, whose reader waits for ever, for a layer; the layers beside it are read."""
    monkeypatch.setattr(crate_guard, "_SECONDS", 3.0)
    whole = SHIPPED / "assets" / "bench" / "bench" / "payload" / "steel.usdc"
    waits = tmp_path / "waits.usda"
    os.mkfifo(waits)
    assert deadly_layers([whole, waits, whole]) == {waits}


def test_a_reader_that_cannot_work_is_no_fault_of_a_layer(monkeypatch: pytest.MonkeyPatch) -> None:
    """Else a broken installation would condemn all layers."""
    monkeypatch.setattr(sys, "executable", shutil.which("false"))
    with pytest.raises(EnvgenError, match=r"steel\.usdc: cannot be read"):
        deadly_layers([SHIPPED / "assets" / "bench" / "bench" / "payload" / "steel.usdc"])


def test_the_reader_of_binary_layers_runs_no_code_of_the_working_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A module run by its name looks for its imports in the working folder first."""
    mark = tmp_path / "mark"
    for name in ("pxr.py", "subprocess.py"):
        (tmp_path / name).write_text(f"open({str(mark)!r}, 'w').close()\n")
    monkeypatch.chdir(tmp_path)
    layer = SHIPPED / "assets" / "bench" / "bench" / "payload" / "steel.usdc"
    assert deadly_layers([layer]) == frozenset()
    assert not mark.exists()


def test_workers_run_no_code_of_the_working_folder(tmp_path: Path) -> None:
    """In a process of its own, as Python's resource tracker starts once a process."""
    mark = tmp_path / "mark"
    for name in ("tempfile.py", "selectors.py", "signal.py"):
        (tmp_path / name).write_text(f"open({str(mark)!r}, 'w').close()\n")
    code = (
        "import gc, envgen_usd.workers as own\n"
        "if __name__ == '__main__':\n"
        "    with own.Workers(1) as workers:\n"
        "        workers.run(abs, [-3], gc.enable, (), print)\n"
    )
    script = tmp_path / "elsewhere" / "script.py"
    script.parent.mkdir()
    script.write_text(code)
    command = [sys.executable, str(script)]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, check=False)
    assert done.stdout == "3\n", done.stderr
    assert not mark.exists()
