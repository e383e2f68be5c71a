"""Path of the network's weights."""

from importlib import resources
from pathlib import Path

from envgen_usd.errors import EnvgenError

SHIPPED = "weights/small.safetensors"
"""The shipped weights."""


def find_weights(given: Path | None = None) -> Path:
    """Path of the weights: the given file, or else the shipped file.

    Raises:
        EnvgenError: The file does not exist.
    """
    path = given or Path(str(resources.files("envgen_usd.landuse.network"))) / SHIPPED
    if not path.is_file():
        raise EnvgenError(
            f"{path}: no weights of a network; run envgen-usd landuse train, or name other weights"
        )
    return path
