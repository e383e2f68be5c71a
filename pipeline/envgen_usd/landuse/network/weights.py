"""Where the weights of the network are."""

from importlib import resources
from pathlib import Path

from envgen_usd.errors import EnvgenError

SHIPPED = "weights/small.safetensors"
"""The weights that come with the package."""


def find_weights(given: Path | None = None) -> Path:
    """Path of the weights to use: those that are given, else those that are shipped.

    Raises:
        EnvgenError: The file is not there.
    """
    path = given or Path(str(resources.files("envgen_usd.landuse.network"))) / SHIPPED
    if not path.is_file():
        raise EnvgenError(f"{path}: no weights of a network; train some, or name others")
    return path
