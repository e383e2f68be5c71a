"""Presets of the experiment: the default protocol, and that of the article."""

from collections.abc import Mapping
from dataclasses import dataclass

from envgen_usd.errors import EnvgenError
from envgen_usd.study.study_protocol import ALL, ARMS, Protocol

_RATIOS = Protocol().ratios


@dataclass(frozen=True)
class Preset:
    """Values that hold where the user gives none.

    Attributes:
        protocol: What is compared.
        network: Network.
        epochs: Passes over N images; 0 takes steps instead.
        batches: How a batch is drawn.
    """

    protocol: Protocol
    network: str
    epochs: int
    batches: str


DEFAULT, ARTICLE = "", "article"
_PRESETS: Mapping[str, Preset] = {
    DEFAULT: Preset(Protocol((50, 100, ALL), _RATIOS, tuple(ARMS)), "small", 0, "even"),
    ARTICLE: Preset(
        Protocol((100, 500, 2000), _RATIOS, ("mix",), random_split=True),
        "yolov8n",
        300,
        "proportional",
    ),
}


def preset(name: str) -> Preset:
    """The preset of that name; empty for the default protocol.

    Raises:
        EnvgenError: There is none.
    """
    if name not in _PRESETS:
        raise EnvgenError(f"--preset {name}: unknown; known: {ARTICLE}")
    return _PRESETS[name]
