"""A chunk is kept only while everything that it follows from is the same."""

import json
import shutil
from importlib import metadata
from pathlib import Path

import numpy as np
import pytest
import rasterio
from rasterio.transform import Affine
from tests.kept_work import kept

from envgen_usd.citygml.city_index import member_files, write_index
from envgen_usd.citygml.write import write_city
from envgen_usd.geometry.raster_files import raster_files
from envgen_usd.models.city_model import City, CityObject
from envgen_usd.opendrive.reader import read
from envgen_usd.recipe import unchanged_chunks
from envgen_usd.recipe.build_options import BuildOptions
from envgen_usd.recipe.environment_build import build
from envgen_usd.recipe.unchanged_chunks import content_hashes, input_key, library_versions

LANES = """<lanes><laneSection s="0"><center><lane id="0" type="none"/></center><right>
<lane id="-1" type="driving"><width sOffset="0" a="{width}" b="0" c="0" d="0"/></lane>
</right></laneSection></lanes>"""
ROAD = """<OpenDRIVE><header revMajor="1" revMinor="7"/><road id="7" length="30" junction="-1">
<planView><geometry s="0" x="185" y="200" hdg="0" length="30"><line/></geometry></planView>
<include file="lanes.xml"/></road></OpenDRIVE>"""


def write_road(folder: Path, width: float = 3.5) -> Path:
    (folder / "lanes.xml").write_text(LANES.format(width=width), encoding="utf-8")
    (folder / "small.xodr").write_text(ROAD, encoding="utf-8")
    return folder / "small.xodr"


def key_of(options: BuildOptions, **files: tuple[Path, ...]) -> str:
    """The key of a build as the build computes it."""
    return input_key(options, content_hashes(options, files), library_versions(options))


def options(road: Path, **others: object) -> BuildOptions:
    return BuildOptions(road, "1", "residential", road.parent / "out", **others)  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of a road and its build, for copies."""
    return kept(tmp_path_factory, "unchanged_chunks", built_road)


def built_road(folder: Path) -> Path:
    assert build(options(write_road(folder), workers=1)).built > 0
    return folder


@pytest.fixture
def road(built: Path, tmp_path: Path) -> Path:
    """A road whose build lies beside it."""
    shutil.copytree(built, tmp_path, dirs_exist_ok=True)
    return tmp_path / "small.xodr"


def test_another_included_file_builds_the_chunks_anew(road: Path, tmp_path: Path) -> None:
    again = build(options(road, workers=1))
    assert again.built == 0
    manifest = json.loads((tmp_path / "out" / "manifest.json").read_text("utf-8"))
    assert set(manifest["hashes"]["road"]) == {"small.xodr", "lanes.xml"}
    write_road(tmp_path, 4.5)
    assert build(options(road, workers=1)).built == again.kept > 0


def test_files_behind_an_index_belong_to_the_city_model(tmp_path: Path) -> None:
    parts = tmp_path / "a.gml", tmp_path / "b.gml"
    for number, part in enumerate(parts):
        write_city(City((CityObject(f"b{number}", "Building"),), "", (0.0, 0.0, 0.0)), part)
    write_index(parts, tmp_path / "city.gml")
    assert member_files(tmp_path / "city.gml") == parts
    assert member_files(parts[0]) == ()
    chosen, files = options(write_road(tmp_path)), (tmp_path / "city.gml", *parts)
    before = key_of(chosen, city=files)
    parts[1].write_text(parts[1].read_text("utf-8").replace("b1", "b2"), encoding="utf-8")
    assert key_of(chosen, city=files) != before


def test_sources_of_a_virtual_raster_belong_to_it(tmp_path: Path) -> None:
    source, virtual = tmp_path / "dem.tif", tmp_path / "dem.vrt"
    grid = {"width": 4, "height": 3, "count": 1, "dtype": "float32"}
    place = Affine(2.0, 0.0, 0.0, 0.0, -2.0, 0.0)
    with rasterio.open(source, "w", driver="GTiff", transform=place, **grid) as file:
        file.write(np.zeros((1, 3, 4), np.float32))
    virtual.write_text(
        '<VRTDataset rasterXSize="4" rasterYSize="3"><GeoTransform>0, 2, 0, 0, 0, -2</GeoTransform>'
        '<VRTRasterBand dataType="Float32" band="1">'
        '<SimpleSource><SourceFilename relativeToVRT="1">dem.tif</SourceFilename>'
        "<SourceBand>1</SourceBand></SimpleSource></VRTRasterBand></VRTDataset>"
    )
    assert raster_files(virtual) == (virtual, source.resolve())


def test_includes_are_files_of_the_road(tmp_path: Path) -> None:
    road = write_road(tmp_path)
    assert read(road).files == (road, (tmp_path / "lanes.xml").resolve())


@pytest.mark.parametrize("package", ["shapely", "numpy", "usd-core"])
def test_another_version_of_a_library_is_another_key(
    package: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    chosen, known = options(write_road(tmp_path)), metadata.version
    before = key_of(chosen)
    assert key_of(chosen) == before
    monkeypatch.setattr(
        unchanged_chunks.metadata,
        "version",
        lambda name: "999.0" if name == package else known(name),
    )
    assert key_of(chosen) != before


@pytest.mark.parametrize(
    "change", [{"seed": 1}, {"tolerance": 0.03}, {"metadata_only": True}, {"actors": False}]
)
def test_another_option_is_another_key(change: dict[str, object], tmp_path: Path) -> None:
    road = write_road(tmp_path)
    assert key_of(options(road, **change)) != key_of(options(road))
    assert key_of(options(road, workers=7)) == key_of(options(road))


def test_another_environment_or_library_is_another_key(tmp_path: Path) -> None:
    road = write_road(tmp_path)
    before = key_of(options(road))
    assert key_of(BuildOptions(road, "1", "industrial", tmp_path)) != before
    (tmp_path / "library").mkdir()
    assert key_of(options(road, library=tmp_path / "library")) != before


def test_the_manifest_names_every_option_and_role(tmp_path: Path) -> None:
    road = write_road(tmp_path)
    build(options(road, landuse="network", workers=1))
    manifest = json.loads((tmp_path / "out" / "manifest.json").read_text("utf-8"))
    assert {"landuse", "landuse_network", "environments", "library", "heightmap", "city", "seed",
            "terrain_network", "embed_assets"} <= set(manifest["inputs"])  # fmt: skip
    assert set(manifest["hashes"]) == {"road", "landuse", "environment", "library"}
    assert list(manifest["hashes"]["landuse"]) == ["small.safetensors"]
    assert "torch" in manifest["versions"]


def truncate(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-7])


def flip(path: Path) -> None:
    """Changes the content of a file and not its size."""
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)


def test_damaged_files_are_named_and_made_anew(road: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    chunk = sorted((out / "chunks").iterdir())[0]
    whole = {path: path.read_bytes() for path in chunk.iterdir()}
    (chunk / "terrain.usdc").unlink()
    truncate(chunk / "city.gml")
    flip(chunk / "heightmap.tif")
    truncate(out / "manifest.json")
    again = build(options(road, workers=1))
    places = {issue.where for issue in again.issues if issue.kind == "build.damaged"}
    assert places == {
        "manifest.json",
        *(f"chunks/{chunk.name}/{name}" for name in ("terrain.usdc", "city.gml", "heightmap.tif")),
    }
    assert again.built == 1
    assert {path: path.read_bytes() for path in chunk.iterdir()} == whole
    assert "build.damaged" in (out / "report.html").read_text("utf-8")
    assert not [i for i in build(options(road, workers=1)).issues if i.kind == "build.damaged"]


def test_a_damaged_record_is_named_and_the_chunk_made_anew(road: Path, tmp_path: Path) -> None:
    record = sorted((tmp_path / "out" / "chunks").glob("*/made.json"))[0]
    truncate(record)
    again = build(options(road, workers=1))
    assert [i.where for i in again.issues if i.kind == "build.damaged"] == [
        f"chunks/{record.parent.name}/made.json"
    ]
    assert again.built == 1
