"""Path of the network's weights."""

from importlib import resources
from pathlib import Path

from envgen_usd.errors import EnvgenError

OF_RULES = "weights/small.safetensors"
"""The shipped network that draws landuse as the rules do, for hand-written environments."""
OF_PLACES = "weights/places.safetensors"
"""The shipped network that draws landuse as in real places, for learnt environments."""


def find_weights(given: Path | None = None, *, learnt: bool = False) -> Path:
    """Path of the weights: the given file, or else a shipped file.

    Args:
        given: The user's file.
        learnt: True for an environment that was learnt from a place.

    Raises:
        EnvgenError: The file does not exist.
    """
    shipped = OF_PLACES if learnt else OF_RULES
    path = given or Path(str(resources.files("envgen_usd.landuse.network"))) / shipped
    if not path.is_file():
        raise EnvgenError(
            f"{path}: no weights of a network; run envgen-usd landuse train, or name other weights"
        )
    return path
