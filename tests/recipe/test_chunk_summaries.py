"""What the stage and the index take from the summaries of chunks is what the files say."""

from pathlib import Path

import numpy as np

from envgen_usd.build_manifest import hash_file
from envgen_usd.citygml.city_index import read_entry, write_index
from envgen_usd.layers.payload_roots import read_payload
from envgen_usd.recipe.chunk_summaries import kept_entry, kept_payload
from envgen_usd.recipe.environment_build import BuildResult


def test_a_summary_says_what_the_layers_say(tiny_build: BuildResult) -> None:
    paths = sorted(tiny_build.stage.parent.glob("chunks/*/*.usdc"))
    assert len({path.parent for path in paths}) > 1
    for path in paths:
        kept, read = kept_payload(path), read_payload(path)
        assert (kept.materials, kept.references) == (read.materials, read.references)
        for one, other in zip(kept.roots, read.roots, strict=True):
            assert (one.name, one.default) == (other.name, other.default)
            assert (one.type_name, one.kind) == (other.type_name, other.kind)
            np.testing.assert_array_equal(one.extents, other.extents)


def test_an_index_of_summaries_is_that_of_the_files(
    tiny_build: BuildResult, tmp_path: Path
) -> None:
    files = sorted(tiny_build.stage.parent.glob("chunks/*/city.gml"))
    assert [kept_entry(path) for path in files] == [read_entry(path) for path in files]
    texts = []
    for number, read in enumerate((kept_entry, read_entry)):
        write_index(files, tmp_path / f"{number}.gml", read)
        texts.append((tmp_path / f"{number}.gml").read_bytes())
    assert texts[0] == texts[1]
    assert texts[0].count(b"cityObjectMember") > len(files)


def test_hashes_of_the_manifest_are_those_of_the_files(tiny_build: BuildResult) -> None:
    folder, products = tiny_build.stage.parent, tiny_build.manifest.products
    assert {name.partition("/")[0] for name in products} >= {"chunks", "layers", "stage.usda"}
    assert products == {name: hash_file(folder / name) for name in products}
