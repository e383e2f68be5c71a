"""Damaged layers of a stage are refused before OpenUSD reads them."""

import shutil
from collections.abc import Callable
from functools import partial
from importlib import resources
from pathlib import Path

import pytest
from pxr import Sdf

from envgen_usd.assets import stage_guard
from envgen_usd.assets.stage_guard import refuse_deadly_layers
from envgen_usd.build_manifest import Manifest, hash_file, write_manifest
from envgen_usd.errors import EnvgenError
from envgen_usd.exchange.environment_export import export_gltf
from envgen_usd.layers.flat_stage import flatten_stage
from envgen_usd.render.frames.frame_export import render_frames

SEEDS = Path(__file__).resolve().parents[2] / "tools" / "fuzz_seeds"
WHOLE = Path(str(resources.files("envgen_usd.asset_library")), "assets/bench/bench/payload")
TOP = """#usda 1.0
(
    defaultPrim = "World"
    metersPerUnit = 1
    upAxis = "Z"
    subLayers = [@./stage.usda@]
)
def "World"
{
    def "Bench" (
        prepend ARC = @./parts/bench.usdc@
    )
    {
    }
}
"""


def stage_with(layer: Path, folder: Path, arc: str = "payload") -> Path:
    """A stage of three layers."""
    shutil.copy(SEEDS / "stage.usda", folder)
    (folder / "parts").mkdir()
    shutil.copy(layer, folder / "parts" / "bench.usdc")
    path = folder / "top.usda"
    path.write_text(TOP.replace("ARC", arc))
    return path


def vouch(folder: Path) -> None:
    """Writes a manifest of all files of a folder."""
    products = {
        path.relative_to(folder).as_posix(): hash_file(path)
        for path in folder.rglob("*")
        if path.is_file()
    }
    write_manifest(Manifest({}, {}, {}, products, {}, {}), folder)


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Names of the layers that another process is asked to read."""
    names: list[str] = []

    def deadly(layers: list[Path]) -> frozenset[Path]:
        names.extend(path.name for path in layers)
        return frozenset()

    monkeypatch.setattr(stage_guard, "deadly_layers", deadly)
    return names


@pytest.mark.parametrize(
    ("read", "arc"),
    [
        (partial(render_frames, frames=1, cache=False), "payload"),
        (partial(render_frames, frames=1, cache=False), "references"),
        (flatten_stage, "payload"),
        (export_gltf, "payload"),
    ],
)
def test_a_layer_at_which_openusd_crashes_is_named(
    read: Callable[[Path, Path], object], arc: str, tmp_path: Path
) -> None:
    """A few changed bits, at which OpenUSD 26.8 ends the process."""
    stage = stage_with(SEEDS / "deadly_path.usdc", tmp_path, arc)
    with pytest.raises(EnvgenError, match="a damaged layer, at which OpenUSD") as caught:
        read(stage, tmp_path / "made.usda")
    assert str(caught.value).startswith(f"{tmp_path / 'parts' / 'bench.usdc'}: ")
    assert not (tmp_path / "made.usda").exists()


def test_not_the_layer_that_names_it_is_blamed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Another process that started here would find the damaged layer by its relative path."""
    stage = stage_with(SEEDS / "deadly_value.usdc", tmp_path, "references")
    Sdf.Layer.OpenAsAnonymous(str(stage)).Export(str(tmp_path / "binary.usdc"))
    monkeypatch.chdir(tmp_path)
    with pytest.raises(EnvgenError) as caught:
        refuse_deadly_layers(Path("binary.usdc"))
    assert str(caught.value).startswith(f"{tmp_path / 'parts' / 'bench.usdc'}: ")


@pytest.mark.parametrize(
    ("arc", "payloads", "expected"),
    [
        ("payload", True, ["bench.usdc"]),
        ("payload", False, []),
        ("references", False, ["bench.usdc"]),
    ],
)
def test_binary_layers_without_a_manifest_are_read_by_another_process(
    arc: str, payloads: bool, expected: list[str], asked: list[str], tmp_path: Path
) -> None:
    refuse_deadly_layers(stage_with(WHOLE / "steel.usdc", tmp_path, arc), payloads=payloads)
    assert asked == expected


@pytest.mark.parametrize("payloads", [True, False])
def test_layers_that_a_manifest_vouches_for_are_not(
    payloads: bool, asked: list[str], tmp_path: Path
) -> None:
    stage = stage_with(WHOLE / "steel.usdc", tmp_path, "references")
    vouch(tmp_path)
    refuse_deadly_layers(stage, payloads=payloads)
    assert asked == []


@pytest.mark.parametrize("damage", ["layer", "manifest"])
def test_a_changed_layer_of_an_environment_is_read_by_another_process(
    damage: str, asked: list[str], tmp_path: Path
) -> None:
    """Also one that no layer before it names: what a layer names is known of whole ones alone."""
    stage = stage_with(WHOLE / "steel.usdc", tmp_path)
    shutil.copy(WHOLE / "steel.usdc", tmp_path / "parts" / "other.usdc")
    vouch(tmp_path)
    if damage == "layer":
        for name in ("bench", "other"):
            (tmp_path / "parts" / f"{name}.usdc").write_bytes(b"PXR-USDC and nothing more")
    else:
        (tmp_path / "manifest.json").write_text("[1]")
    refuse_deadly_layers(stage)
    assert asked == (["bench.usdc", "other.usdc"] if damage == "layer" else ["bench.usdc"])


def test_a_layer_over_an_environment_is_looked_at_with_the_environment(
    asked: list[str], tmp_path: Path
) -> None:
    """An artist's stage, whose folder has no manifest."""
    folder = tmp_path / "town"
    folder.mkdir()
    stage_with(WHOLE / "steel.usdc", folder)
    vouch(folder)
    (tmp_path / "mine").mkdir()
    mine = tmp_path / "mine" / "stage.usda"
    mine.write_text("#usda 1.0\n(subLayers = [@../town/top.usda@])\n")
    refuse_deadly_layers(mine)
    assert asked == []
    (folder / "parts" / "bench.usdc").write_bytes(b"PXR-USDC and nothing more")
    refuse_deadly_layers(mine)
    assert asked == ["bench.usdc"]
