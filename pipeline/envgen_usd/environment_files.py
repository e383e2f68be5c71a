"""Reads the environment files of the asset library."""

from importlib import resources
from pathlib import Path

from envgen_usd.errors import EnvgenError
from envgen_usd.models.environment_profile import Profile
from envgen_usd.toml_files import read_toml


def environments_folder() -> Path:
    """Folder of the shipped environments."""
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
    """Reads an environment.

    Args:
        country: Name, e.g. ``1``.
        area: Area type, e.g. ``residential``.
        folder: Folder of environments; `None` means the shipped environments.

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
    return read_toml(path, Profile, country=country, area=area, source=str(path))
