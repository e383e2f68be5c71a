"""Path of the network's weights."""

from importlib import resources
from pathlib import Path

from envgen_usd.input_paths import check_input_file

OF_RULES = "weights/small.safetensors"
"""The shipped network that draws landuse as the rules do, for hand-written environments."""
OF_PLACES = "weights/places.safetensors"
"""The shipped network that draws landuse as in real places, for learnt environments."""
OF_HEIGHTS = "weights/heights.safetensors"
"""The shipped network that draws terrain as beside the streets of a real place."""
SHIPPED_HEIGHTS = Path("shipped")
"""Stands for the shipped network of heights where weights are named."""


def find_weights(given: Path | None = None, *, learnt: bool = False) -> Path:
    """Path of the weights of a network of landuse: the given file, or else a shipped file.

    Args:
        given: The user's file.
        learnt: True for an environment that was learnt from a place.

    Raises:
        EnvgenError: The file does not exist.
    """
    return _existing(given or _shipped(OF_PLACES if learnt else OF_RULES))


def find_height_weights(given: Path) -> Path:
    """Path of the weights of a network of heights: the given file, or the `SHIPPED_HEIGHTS`.

    Raises:
        EnvgenError: The file does not exist.
    """
    return _existing(_shipped(OF_HEIGHTS) if given == SHIPPED_HEIGHTS else given)


def _shipped(name: str) -> Path:
    return Path(str(resources.files("envgen_usd.landuse.network"))) / name


def _existing(path: Path) -> Path:
    check_input_file(path, "run envgen-usd landuse train, or name other weights of a network")
    return path
