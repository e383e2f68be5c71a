"""Adds the layer of moving actors to a stage, and takes it away."""

from pathlib import Path

from pxr import Sdf

from envgen_usd.assets.usd_files import read_layer, write_layer
from envgen_usd.build_manifest import hash_bytes, hash_file
from envgen_usd.errors import Issue, Severity
from envgen_usd.layers.time_samples import set_times
from envgen_usd.layers.traffic_layer import FILE
from envgen_usd.output_folder import STAGE_FILE

SUBLAYER = f"layers/{FILE}"
"""Path of the layer, relative to the stage."""
_KEY = "surface_key"
_TIMES = ("timeCodesPerSecond", "framesPerSecond", "startTimeCode", "endTimeCode")


def surface_key(folder: Path) -> str:
    """Returns a hash of what actors of a build stand on: the files of roads and terrain."""
    files = sorted(folder.glob("chunks/*/roads.usdc")) + sorted(
        folder.glob("chunks/*/terrain.usdc")
    )
    return hash_bytes(*(f"{path.parent.name}/{path.name} {hash_file(path)}" for path in files))


def layer_facts(folder: Path, source: str, seed: int) -> dict[str, str]:
    """Returns what the layer's custom data tell: its source, its seed and its surface."""
    return {_KEY: surface_key(folder), "seed": str(seed), "source": source}


def add_sublayer(folder: Path, rate: float, first: int, last: int) -> None:
    """Makes the layer the strongest of the stage, and gives the stage its time codes.

    Args:
        folder: Output folder of a build.
        rate: Frames a second.
        first: First frame.
        last: Last frame.

    Raises:
        EnvgenError: The stage cannot be read or written.
    """
    path = folder / STAGE_FILE
    stage = read_layer(path)
    stage.subLayerPaths[:] = [SUBLAYER, *_others(stage)]
    set_times(stage, rate, first, last)
    write_layer(stage, path)


def remove_sublayer(folder: Path) -> bool:
    """Takes the layer away from the stage, and its file; False if there was none.

    Raises:
        EnvgenError: The stage cannot be read or written.
    """
    path, file = folder / STAGE_FILE, folder / SUBLAYER
    stage = read_layer(path)
    others = _others(stage)
    named = len(others) < len(stage.subLayerPaths)
    there = named or file.exists()
    if named:
        stage.subLayerPaths[:] = others
        for name in _TIMES:
            stage.pseudoRoot.ClearInfo(name)
        write_layer(stage, path)
    file.unlink(missing_ok=True)
    return there


def _others(stage: Sdf.Layer) -> list[str]:
    """Sublayers of a stage without that of moving actors."""
    count = len(stage.subLayerPaths)
    paths = [str(stage.subLayerPaths[place]) for place in range(count)]
    return [path for path in paths if path != SUBLAYER]


def keep_traffic(folder: Path) -> tuple[Issue, ...]:
    """Puts the layer of an earlier run back into a new stage, if its surface is the same.

    A layer for another surface is removed, and an issue says so.

    Args:
        folder: Output folder, with the chunks and the stage of the new build.

    Raises:
        EnvgenError: The layer or the stage cannot be read or written.
    """
    file = folder / SUBLAYER
    if not file.exists():
        return ()
    layer = read_layer(file)
    if layer.customLayerData.get(_KEY) == surface_key(folder):
        first, last = round(layer.startTimeCode), round(layer.endTimeCode)
        add_sublayer(folder, layer.timeCodesPerSecond, first, last)
        return ()
    source = layer.customLayerData.get("source", "?")
    remove_sublayer(folder)
    text = f"roads or terrain are not those on which the actors of {source} moved"
    done = "layer removed; run envgen-usd traffic again"
    return (Issue("traffic.removed", Severity.WARNING, SUBLAYER, text, done),)
