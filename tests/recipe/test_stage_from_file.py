"""The stage follows from what the city model on the disc says."""

import re
from dataclasses import replace
from pathlib import Path

import pytest
from pxr import Sdf
from tests.recipe.conftest import tiny_options
from tests.recipe.test_mapped_place import small_town

from envgen_usd.assets.asset_catalogue import read_catalogue
from envgen_usd.citygml.read import read_city
from envgen_usd.environment_files import read_profile
from envgen_usd.recipe import chunk_products
from envgen_usd.recipe.build_options import BuildOptions
from envgen_usd.recipe.chunk_products import ChunkInputs, build_chunk
from envgen_usd.recipe.map_land import lay_out_land
from envgen_usd.recipe.mapped_place import read_mapped_place
from envgen_usd.step_clock import Clock

CLOCK = Clock(lambda *_: None)


def layers(folder: Path) -> dict[str, str]:
    """Text of each layer of the chunks, by its place; a city model knows no zero below 0."""
    texts = {}
    for path in sorted(folder.rglob("*.usdc")):
        text = Sdf.Layer.OpenAsAnonymous(str(path)).ExportToString()
        texts[str(path.relative_to(folder))] = re.sub(r"(?<=[ (])-0(?=[,)])", "0", text)
    return texts


@pytest.mark.parametrize(
    ("country", "area", "mapped"),
    [("1", "residential", False), ("2", "industrial", False), ("1", "city_centre", True)],
)
def test_layers_are_those_of_the_city_as_it_is_read_back(
    tmp_path: Path, country: str, area: str, mapped: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A build spares the reading where nothing that others wrote is in the city."""
    options: BuildOptions = replace(tiny_options(tmp_path), country=country, area=area)
    place = None
    if mapped:
        options = replace(options, osm=small_town(tmp_path / "town.osm"))
        place = read_mapped_place(options, CLOCK)
        options = replace(options, road=place.write_road(tmp_path))
    profile, catalogue = read_profile(country, area), read_catalogue()
    land = lay_out_land(options, profile, CLOCK, place)
    read: list[Path] = []
    monkeypatch.setattr(
        chunk_products, "read_city", lambda path: read.append(path) or read_city(path)
    )
    made = []
    for name, reads_back in (("spared", False), ("read", True)):
        folder = tmp_path / name
        folder.mkdir()
        inputs = ChunkInputs.of(folder, land, profile, catalogue, options)
        assert not inputs.reads_back
        given = replace(options, city=tmp_path / "model.gml")
        assert ChunkInputs.of(folder, land, profile, catalogue, given).reads_back
        for chunk in land.chunks:
            build_chunk(replace(inputs, reads_back=reads_back), land.of(chunk), "key")
        assert len(read) == reads_back * len(land.chunks)
        made.append(layers(folder))
    assert made[0] == made[1]
    assert len(made[0]) == len(land.chunks) * (5 + (profile.actors is not None))
    assert any("/props" in name and "instanceable" in text for name, text in made[0].items())
