"""Writes weights and figures into the file of an environment."""

import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

from envgen_usd.assets.asset_catalogue import Asset, Catalogue, read_catalogue
from envgen_usd.errors import EnvgenError
from envgen_usd.layers.prop_distributions import weighted_choices
from envgen_usd.models.environment_profile import Profile
from envgen_usd.recipe.environment_check import environment_faults
from envgen_usd.toml_edits import Edit, edited
from envgen_usd.toml_files import read_toml
from envgen_usd.whole_files import write_whole


def library_of(file: Path) -> Catalogue:
    """The library that holds the file of an environment, or else the shipped library."""
    folder = file.resolve().parents[2]
    return read_catalogue(folder if (folder / "materials").is_dir() else None)


def read_environment(file: Path) -> Profile:
    """Reads ``environments/country_<name>/<area>.toml``.

    Raises:
        EnvgenError: The file is missing or not a valid environment.
    """
    country = file.resolve().parent.name.removeprefix("country_")
    return read_toml(file, Profile, country=country, area=file.stem, source=str(file))


def edited_environment(file: Path, edits: Sequence[Edit], catalogue: Catalogue) -> str:
    """The text of an environment's file with new values; comments stay.

    Raises:
        EnvgenError: A value cannot be changed, or the result is not a valid environment.
    """
    try:
        text = file.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise EnvgenError(f"{file}: cannot be read as text: {error}") from error
    text = edited(text, edits, str(file))
    with tempfile.TemporaryDirectory() as name:
        draft = Path(name) / file.parent.name / file.name
        draft.parent.mkdir()
        draft.write_text(text, encoding="utf-8")
        try:
            faults = environment_faults(read_environment(draft), catalogue)
        except EnvgenError as error:
            faults = (str(error),)
    if faults:
        raise EnvgenError(faults[0].replace(str(draft), str(file)))
    return text


def write_environment(file: Path, edits: Sequence[Edit], catalogue: Catalogue) -> None:
    """Writes new values into an environment's file, whole or not at all.

    Raises:
        EnvgenError: As `edited_environment`, or the file cannot be written.
    """
    write_whole(file, edited_environment(file, edits, catalogue))


def asset_weight(file: Path, asset: str, weight: float) -> Edit:
    """The edit that gives an asset a weight among those of its kind.

    Without weights, all assets of the kind are equally likely: each other one keeps 1.

    Raises:
        EnvgenError: The library or the environment is unusable.
    """
    catalogue = library_of(file)
    made = _known(catalogue, asset)
    table, assets, _ = _weights(read_environment(file), catalogue, made.kind)
    others = {name: value for name, value in assets.items() if name != asset}
    return Edit(table, "assets", {**others, asset: weight})


def variant_weight(file: Path, asset: str, variant_set: str, variant: str, weight: float) -> Edit:
    """The edit that gives a variant a weight among those of its set.

    Without weights, the asset keeps its default: that gets the weight 1.

    Raises:
        EnvgenError: The library or the environment is unusable.
    """
    catalogue = library_of(file)
    made = _known(catalogue, asset)
    table, _, variants = _weights(read_environment(file), catalogue, made.kind)
    usual = made.defaults.get(variant_set, "")
    before = variants.get(variant_set, {usual: 1.0} if usual and usual != variant else {})
    return Edit(table, f"variants.{variant_set}", {**before, variant: weight})


def _known(catalogue: Catalogue, asset: str) -> Asset:
    if asset not in catalogue.assets:
        raise EnvgenError(f"unknown asset '{asset}'; known: {', '.join(catalogue.assets)}")
    return catalogue.assets[asset]


def _weights(
    profile: Profile, catalogue: Catalogue, kind: str
) -> tuple[str, Mapping[str, float], Mapping[str, Mapping[str, float]]]:
    """Table, weights of assets, and weights of variants of a kind."""
    choices = weighted_choices(profile, catalogue)
    if kind in choices:
        table, distribution = choices[kind]
        return table, distribution.assets, distribution.variants
    return f"props.{kind}", {asset.name: 1.0 for asset in catalogue.of_kind(kind)}, {}
