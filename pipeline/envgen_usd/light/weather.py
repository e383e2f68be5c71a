"""Weathers: ranges of what the air and the clouds are like, read from TOML files."""

from dataclasses import dataclass, fields
from importlib import resources
from pathlib import Path
from typing import Annotated

import numpy as np
from msgspec import Meta

from envgen_usd.errors import EnvgenError
from envgen_usd.toml_files import is_there, read_toml

Share = Annotated[float, Meta(ge=0.0, le=1.0)]
RANDOM = "random"
"""Name that asks for a weather drawn by share."""


@dataclass(frozen=True)
class Weather:
    """A weather; each pair is a range that a moment is drawn from.

    Attributes:
        summary: A line for people.
        share: Weight among the weathers when one is drawn at random.
        elevation: Elevation of the sun, degrees.
        turbidity: Turbidity of the air: 2 is clear, 10 is hazy.
        cover: Share of the sky behind single clouds.
        depth: Darkness of the clouds' bases: 0 is white.
        overcast: Share of a closed layer of clouds in the sky's light.
        light: Share of the clear sky's illuminance that a closed layer lets through.
        direct: Share of the sunlight that passes high clouds.
        visibility: Metres at which the contrast to the horizon falls to 2 % (Koschmieder).
        wetness: Share of the ground's surface that water covers.
        rain: Rate of rain, mm/h.
        glow: Luminance of the zenith by the lamps of the town, mcd/m².
    """

    summary: str
    share: Annotated[float, Meta(ge=0.0, le=1000.0)]
    elevation: tuple[
        Annotated[float, Meta(ge=-90.0, le=90.0)], Annotated[float, Meta(ge=-90.0, le=90.0)]
    ]
    turbidity: tuple[
        Annotated[float, Meta(ge=1.9, le=10.0)], Annotated[float, Meta(ge=1.9, le=10.0)]
    ]
    cover: tuple[Share, Share]
    depth: tuple[Share, Share]
    overcast: tuple[Share, Share]
    light: tuple[Share, Share]
    direct: tuple[Share, Share]
    visibility: tuple[
        Annotated[float, Meta(ge=10.0, le=1e6)], Annotated[float, Meta(ge=10.0, le=1e6)]
    ]
    wetness: tuple[Share, Share]
    rain: tuple[Annotated[float, Meta(ge=0.0, le=150.0)], Annotated[float, Meta(ge=0.0, le=150.0)]]
    glow: tuple[
        Annotated[float, Meta(ge=0.0, le=1000.0)], Annotated[float, Meta(ge=0.0, le=1000.0)]
    ]


@dataclass(frozen=True)
class Moment:
    """A weather at a moment: a value of each range of `Weather`."""

    turbidity: float
    cover: float
    depth: float
    overcast: float
    light: float
    direct: float
    visibility: float
    wetness: float
    rain: float
    glow: float

    @staticmethod
    def drawn(weather: Weather, rng: np.random.Generator | None = None) -> "Moment":
        """Draws each value from its range; without a generator takes the middle."""
        names = [field.name for field in fields(Moment)]
        shares = np.full(len(names), 0.5) if rng is None else rng.random(len(names))
        values = {}
        for name, share in zip(names, shares.tolist(), strict=True):
            low, high = getattr(weather, name)
            even = name != "visibility"
            values[name] = low + share * (high - low) if even else low * (high / low) ** share
        return Moment(**values)


def read_weathers() -> dict[str, Weather]:
    """Reads the shipped weathers, by name in alphabetical order."""
    folder = resources.files("envgen_usd.renders") / "weathers"
    files = sorted(Path(str(entry)) for entry in folder.iterdir() if entry.name.endswith(".toml"))
    return {file.stem: read_toml(file, Weather) for file in files}


def read_weather(name: str) -> Weather:
    """Reads a shipped weather by name, or a TOML file.

    Raises:
        EnvgenError: The weather does not exist, or a value of its file is missing or unknown.
    """
    if name.endswith(".toml"):
        if not is_there(Path(name)):
            raise EnvgenError(f"render: no weather {name}")
        return read_toml(Path(name), Weather)
    shipped = read_weathers()
    if name not in shipped:
        known = ", ".join(shipped)
        raise EnvgenError(
            f"render: unknown weather {name}; known: {known}, {RANDOM}, or a .toml file"
        )
    return shipped[name]
