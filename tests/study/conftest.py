"""Made-up images for the tests of studies."""

import importlib.util
from pathlib import Path
from types import ModuleType

import pytest


def _made_up() -> ModuleType:
    path = Path(__file__).with_name("made_up_images.py")
    spec = importlib.util.spec_from_file_location("made_up_images", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="session")
def real_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("real") / "set"
    return _made_up().write_real(folder, {"0001A": 12, "0002B": 9, "0003C": 6})


@pytest.fixture(scope="session")
def frames_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return _made_up().write_frames(tmp_path_factory.mktemp("frames") / "take", 10)
