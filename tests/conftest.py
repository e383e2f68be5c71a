"""Fixtures that all tests share."""

import gc
import os
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import settings
from pxr import Work

from envgen_usd.render.stage import stage_scene

settings.register_profile("untimed", deadline=None)
settings.load_profile("untimed")
"""Tests are not timed: other programs may use the machine."""

ROOT = Path(__file__).resolve().parents[1]
os.environ.setdefault("OMP_NUM_THREADS", "1")
gc.set_threshold(10_000, 10, 10)
"""What is short-lived is gone before the collector of cycles looks. Else it grows old in numbers
that make the collector visit all objects of a worker, which holds thousands of tests, too often."""
Work.SetConcurrencyLimit(1)
"""Each worker has a core; threads of several workers would wait for each other."""
os.environ["ENVGEN_USD_CACHE"] = ""
"""Tests change constants, which no cache knows; those of the cache name a folder."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Puts long tests first; the others keep their order."""
    items.sort(key=lambda item: item.get_closest_marker("long") is None)


@pytest.fixture(scope="session", autouse=True)
def kept_textures(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Makes each texture once for all processes; it follows from files and from code of its own.

    A tenth of the time of all tests was to decode the library's images for one frame after another.
    """
    base = tmp_path_factory.getbasetemp()
    of_all = base.parent if "PYTEST_XDIST_WORKER" in os.environ else base
    original = stage_scene.cache_folder

    def folder(kind: str) -> Path:
        return original(kind) or of_all / kind

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(stage_scene, "cache_folder", folder)
        yield


@pytest.fixture(scope="session")
def shared() -> Path:
    """Folder with the corpus of OpenDRIVE files and the CityGML schemas; the project has none."""
    folder = Path(os.environ.get("ENVGEN_SHARED", ROOT.parent / "shared"))
    if not folder.is_dir():
        pytest.skip("the corpus and the schemas (../shared or $ENVGEN_SHARED) are not here")
    return folder


@pytest.fixture(scope="session")
def corpus(shared: Path) -> Path:
    """Folder of real OpenDRIVE files."""
    if not (shared / "corpus").is_dir():
        pytest.skip(f"no corpus of OpenDRIVE files in {shared}")
    return shared / "corpus"


@pytest.fixture(scope="session")
def citygml_schemas(shared: Path) -> Path:
    """Folder of the official CityGML schemas."""
    if not (shared / "citygml-xsd").is_dir():
        pytest.skip(f"no CityGML schemas in {shared}")
    return shared / "citygml-xsd"
