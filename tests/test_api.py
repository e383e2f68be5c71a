"""The public API: the page's example runs, and models behave in a notebook."""

import re
from collections.abc import Mapping
from copy import deepcopy
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from tests.short_roads import write_short_road

import envgen_usd
from envgen_usd.models.frozen_model import Model

PAGE = Path(__file__).resolve().parents[1] / "docs" / "api.md"


@pytest.fixture(scope="module")
def surface() -> envgen_usd.RoadSurface:
    return envgen_usd.build_surface(envgen_usd.read_network(envgen_usd.demo_road()))


@pytest.mark.long
def test_the_example_of_the_page_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    code = re.search(r"```python\n(.*?)```", PAGE.read_text("utf-8"), re.DOTALL)
    assert code is not None
    assert len(code[1].strip().splitlines()) <= 12
    monkeypatch.chdir(tmp_path)
    # A road of 99 m is built in a small part of the town's time.
    write_short_road(tmp_path / "straight.xodr")
    text = code[1].replace("eg.demo_road()", "Path('straight.xodr')")
    assert text.count("Path(") == 2
    exec(compile(text, PAGE.name, "exec"), {"Path": Path})
    printed = capsys.readouterr().out.splitlines()
    assert printed[1].startswith("Environment('town', straight.xodr, country 1, residential, ")
    assert [line.split(" ")[0] for line in printed[-2:]] == ["0", "1"]


def test_every_public_name_is_there_and_documented() -> None:
    page = PAGE.read_text("utf-8")
    for name in envgen_usd.__all__:
        value = getattr(envgen_usd, name)
        assert name == "__version__" or value.__doc__
    functions = [n for n in envgen_usd.__all__ if n[0].islower()]
    assert all(f"`{name}(" in page or f"eg.{name}(" in page for name in functions)
    assert set(dir(envgen_usd)) == set(envgen_usd.__all__)
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        envgen_usd.nothing  # noqa: B018


def test_repr_is_a_line(surface: envgen_usd.RoadSurface) -> None:
    for model in (surface, envgen_usd.read_network(envgen_usd.demo_road()), surface.lanes[0]):
        text = repr(model)
        assert len(text) < 1000
        assert "\n" not in text
    assert f"float64[{len(surface.vertices)}, 3]" in repr(surface)


def test_arrays_are_read_only_and_their_maker_keeps_his(surface: envgen_usd.RoadSurface) -> None:
    with pytest.raises(ValueError, match="read-only"):
        surface.vertices[0] = 0.0
    mine = np.zeros((4, 3))
    changed = replace(surface, vertices=mine)
    mine[0] = 1.0
    assert not changed.vertices.flags.writeable
    assert not any(loop.flags.writeable for loop in surface.outline)
    for model in (surface, surface.lanes[0]):
        arrays = [getattr(model, f.name) for f in fields(model)]
        assert not any(a.flags.writeable for a in arrays if isinstance(a, np.ndarray))


def test_arrays_in_any_kind_of_field_are_read_only() -> None:
    @dataclass(frozen=True, repr=False, eq=False)
    class Sample(Model):
        plain: npt.NDArray[np.float64]
        maybe: npt.NDArray[np.float64] | None
        several: tuple[npt.NDArray[np.int64], ...]
        named: Mapping[str, Any]
        anything: object
        count: int = 0

    sample = Sample(*(np.zeros(2) for _ in "ab"), (np.zeros(1),), {"a": np.zeros(3)}, np.zeros(1))
    arrays = (sample.plain, sample.maybe, *sample.several, sample.named["a"], sample.anything)
    assert not any(array.flags.writeable for array in arrays if isinstance(array, np.ndarray))


def test_models_compare_by_value(surface: envgen_usd.RoadSurface) -> None:
    twin = deepcopy(surface)
    assert isinstance(surface, Model)
    assert twin == surface
    assert hash(twin) == hash(surface)
    moved = surface.vertices.copy()
    moved[-1, 2] += 1e-9
    assert replace(surface, vertices=moved) != surface
    assert replace(surface, lanes=surface.lanes[1:]) != surface
    assert surface != "a road"
