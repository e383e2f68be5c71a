"""Spinning lidars: when a laser fires in which direction, and what it can measure."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from importlib import resources
from pathlib import Path
from typing import Annotated

import numpy as np
from msgspec import Meta

from envgen_usd.errors import EnvgenError
from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.render.render_scene import Floats
from envgen_usd.toml_files import read_toml

_MOST_CHANNELS = 1024
_SIDE = 4
"""Shots along and across a block of neighbours."""


@dataclass(frozen=True)
class LidarModel:
    """A device that turns about its z axis, clockwise seen from above.

    Attributes:
        name: Name of the device.
        elevations: Angle of each laser above the horizon, degrees, from the uppermost down.
        columns: Shots of each laser in a turn.
        rate: Turns a second.
        nearest: Least range that is reported, metres.
        range: Largest range that is reported, metres.
        dim_range: Range at which a Lambertian target of 10 % reflectance that faces the sensor is
            detected by 90 % of the shots, metres.
        noise: Standard deviation of ranges, metres.
        resolution: Step of reported ranges, metres; 0 for none.
        divergence: Full angle of the beam, milliradians. A beam is traced at its axis; the figure
            is recorded.
        wavelength: Of the laser, nanometres; 0 if it is not known. Recorded, too: the reflectances
            of surfaces hold for 850 to 950.
        drop_out: Share of the detected shots that are lost for no cause of the scene.
    """

    name: str
    elevations: tuple[float, ...]
    columns: Annotated[int, Meta(ge=1, le=65535)]
    rate: Annotated[float, Meta(ge=0.01, le=1000.0)]
    range: Annotated[float, Meta(ge=1.0, le=1000.0)]
    dim_range: Annotated[float, Meta(ge=1.0, le=10000.0)]
    nearest: Annotated[float, Meta(ge=0.0, le=100.0)] = 0.5
    noise: Annotated[float, Meta(ge=0.0, le=1.0)] = 0.0
    resolution: Annotated[float, Meta(ge=0.0, le=1.0)] = 0.0
    divergence: Annotated[float, Meta(ge=0.0, le=100.0)] = 0.0
    wavelength: Annotated[float, Meta(ge=0.0, le=3000.0)] = 0.0
    drop_out: Annotated[float, Meta(ge=0.0, le=1.0)] = 0.0

    def __post_init__(self) -> None:
        """Checks the elevations and the ranges."""
        angles = np.array(self.elevations, np.float64)
        if not 1 <= len(angles) <= _MOST_CHANNELS:
            raise ValueError(f"elevations: expected 1 to {_MOST_CHANNELS} angles")
        if (np.abs(angles) > 90.0).any():
            raise ValueError("elevations: expected angles from -90 to 90 degrees")
        unsorted = np.flatnonzero(np.diff(angles) >= 0.0)
        if len(unsorted):
            number = int(unsorted[0])
            pair = f"{angles[number]:g} is followed by {angles[number + 1]:g}"
            raise ValueError(f"elevations: expected angles from the uppermost down; {pair}")
        if self.nearest >= self.range:
            raise ValueError(f"nearest: expected less than the range of {self.range:g} m")

    @property
    def shots(self) -> int:
        """Shots of a turn: those of the uppermost laser, then those of the next."""
        return len(self.elevations) * self.columns

    @cached_property
    def azimuths(self) -> FloatArray:
        """Azimuth of each column, radians, counter-clockwise from ahead.

        The turn begins and ends behind, so that the sensor looks ahead in the middle of it.
        """
        turned = (np.arange(self.columns) + 0.5) / self.columns
        azimuths: FloatArray = np.pi - 2.0 * np.pi * turned
        return azimuths

    @cached_property
    def times(self) -> FloatArray:
        """Time of each column, seconds from the middle of the turn."""
        times: FloatArray = ((np.arange(self.columns) + 0.5) / self.columns - 0.5) / self.rate
        return times

    @cached_property
    def directions(self) -> Floats:
        """Unit vectors of all shots in the lidar's frame (x ahead, y left, z up), shots x 3."""
        up, around = np.radians(self.elevations)[:, None], self.azimuths[None]
        flat = np.cos(up)
        parts = flat * np.cos(around), flat * np.sin(around), np.sin(up) + 0.0 * around
        return np.stack(parts, axis=2).reshape(-1, 3).astype(np.float32)

    @cached_property
    def neighbours(self) -> IntArray:
        """Numbers of all shots, so that 16 that follow each other are 4 of 4 lasers each."""
        ring, column = np.divmod(np.arange(self.shots), self.columns)
        return np.lexsort((column % _SIDE, ring % _SIDE, column // _SIDE, ring // _SIDE))


def known_lidars() -> tuple[str, ...]:
    """Names of the shipped lidars."""
    return tuple(sorted(model.name for model in _shipped().values()))


def read_lidar_model(name: str) -> LidarModel:
    """Reads a lidar by the name of the device, or a TOML file.

    The maker may be left out, and case and punctuation do not count: ``HDL-64E`` is
    ``Velodyne HDL-64E``.

    Raises:
        EnvgenError: No such lidar is known, or a value of the file is missing or unusable.
    """
    if name.endswith(".toml"):
        return read_toml(Path(name), LidarModel)
    wanted, known = _folded(name), ", ".join(known_lidars())
    if not wanted:
        raise EnvgenError(f"is missing; known: {known}, or a .toml file")
    for key, model in _shipped().items():
        if wanted in {key, key.partition("_")[2]}:
            return model
    raise EnvgenError(f"unknown lidar {name}; known: {known}, or a .toml file")


@cache
def _shipped() -> Mapping[str, LidarModel]:
    folder = resources.files("envgen_usd.renders") / "lidars"
    models = [read_toml(file, LidarModel) for file in folder.iterdir() if file.name[-5:] == ".toml"]
    return {_folded(model.name): model for model in models}


def _folded(name: str) -> str:
    return re.sub(r"[^a-z0-9]+", "_", name.casefold()).strip("_")
