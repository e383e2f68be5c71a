"""Reads the environments of the asset library."""

import dataclasses
import tomllib
import typing
from collections.abc import Mapping
from importlib import resources
from pathlib import Path
from typing import Any

from envgen_usd.errors import EnvgenError
from envgen_usd.models.landuse import LanduseClass
from envgen_usd.models.profile import Profile


def environments_folder() -> Path:
    """Folder of the environments that come with the package."""
    return Path(str(resources.files("envgen_usd.asset_library"))) / "environments"


def known_environments(folder: Path | None = None) -> dict[str, tuple[str, ...]]:
    """Returns the area types of each country, both sorted: ``{"1": ("industrial", ...)}``."""
    root = folder or environments_folder()
    return {
        country.name.removeprefix("country_"): tuple(sorted(f.stem for f in country.glob("*.toml")))
        for country in sorted(root.glob("country_*"))
    }


def profile_path(country: str, area: str, folder: Path | None = None) -> Path:
    """File of an environment."""
    return (folder or environments_folder()) / f"country_{country}" / f"{area}.toml"


def read_profile(country: str, area: str, folder: Path | None = None) -> Profile:
    """Reads one environment.

    Args:
        country: Name, e.g. ``1``.
        area: Area type, e.g. ``residential``.
        folder: Folder of environments; the package's own if none is given.

    Raises:
        EnvgenError: The name is unknown, or the file is not a valid environment.
    """
    root = folder or environments_folder()
    known = known_environments(root)
    if country not in known:
        raise EnvgenError(
            f"unknown country '{country}'; known: {', '.join(known) or 'none'}. "
            f"A new country is a new folder {root}/country_<name>."
        )
    if area not in known[country]:
        raise EnvgenError(
            f"unknown area type '{area}' for country '{country}'; known: "
            f"{', '.join(known[country])}. A new area type is a new file in "
            f"{root}/country_{country}."
        )
    path = profile_path(country, area, root)
    try:
        data = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise EnvgenError(f"{path}: cannot be read as TOML: {error}") from error
    profile = _convert(
        Profile, {"country": country, "area": area, "source": str(path), **data}, str(path)
    )
    assert isinstance(profile, Profile)
    return profile


def _convert(kind: Any, value: object, where: str) -> object:  # noqa: ANN401 - any annotation
    """Turns TOML data into the annotated type, or says what does not fit and where."""
    if dataclasses.is_dataclass(kind) and isinstance(kind, type):
        return _convert_dataclass(kind, value, where)
    origin = typing.get_origin(kind)
    if origin is Mapping:
        if not isinstance(value, dict):
            raise EnvgenError(f"{where}: expected a table, found {value!r}")
        of = typing.get_args(kind)[1]
        return {key: _convert(of, item, f"{where}.{key}") for key, item in value.items()}
    if origin is tuple:
        return _convert_range(value, where)
    if kind is LanduseClass:
        if str(value).upper() not in LanduseClass.__members__:
            names = ", ".join(member.name.lower() for member in LanduseClass)
            raise EnvgenError(f"{where}: unknown landuse {value!r}; known: {names}")
        return LanduseClass[str(value).upper()]
    if kind is float and isinstance(value, int | float) and not isinstance(value, bool):
        return float(value)
    if not isinstance(value, kind) or isinstance(value, bool):
        raise EnvgenError(f"{where}: expected {kind.__name__}, found {value!r}")
    return value


def _convert_dataclass(kind: type, value: object, where: str) -> object:
    if not isinstance(value, dict):
        raise EnvgenError(f"{where}: expected a table, found {value!r}")
    hints = typing.get_type_hints(kind)
    names = [f.name for f in dataclasses.fields(kind)]
    missing = [name for name in names if name not in value]
    unknown = [name for name in value if name not in names]
    faults = [f"missing {', '.join(missing)}"] if missing else []
    faults += [f"unknown {', '.join(unknown)}; known: {', '.join(names)}"] if unknown else []
    if faults:
        raise EnvgenError(f"{where}: {'; '.join(faults)}")
    return kind(**{name: _convert(hints[name], value[name], f"{where}: {name}") for name in names})


def _convert_range(value: object, where: str) -> tuple[float, float]:
    numbers = isinstance(value, list) and all(
        isinstance(item, int | float) and not isinstance(item, bool) for item in value
    )
    if not isinstance(value, list) or not numbers or len(value) != 2 or value[0] > value[1]:
        raise EnvgenError(f"{where}: expected a range [low, high], found {value!r}")
    return float(value[0]), float(value[1])
