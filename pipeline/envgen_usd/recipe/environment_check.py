"""Checks that a library has all that an environment names, and that it is sound."""

from collections.abc import Mapping
from pathlib import Path

from envgen_usd.assets.asset_catalogue import Catalogue
from envgen_usd.assets.library_check import check_used
from envgen_usd.assets.variant_choice import check_distribution
from envgen_usd.environment_files import known_environments, read_profile
from envgen_usd.errors import EnvgenError, Severity, noted
from envgen_usd.layers.prop_distributions import DECIDED, distributions, weighted_choices
from envgen_usd.models.environment_profile import Profile

OPENINGS = ("window", "door")
"""Kinds of assets that are chosen by width, see `prop_distributions.fitting`."""


def check_environment(profile: Profile, catalogue: Catalogue) -> None:
    """Checks that the library has all assets, variants and materials of an environment.

    Raises:
        EnvgenError: Something is missing; the message names the environment's file and table.
    """
    _refuse(environment_faults(profile, catalogue), catalogue)


def check_used_assets(profile: Profile, catalogue: Catalogue) -> None:
    """Checks the materials of a library, and the assets that an environment uses.

    Raises:
        EnvgenError: `library_check.check_library` reports an error about one of them.
    """
    issues = check_used(catalogue, _used_assets(profile, catalogue), catalogue.materials)
    errors = [issue for issue in issues if issue.severity == Severity.ERROR]
    faults = [f"{catalogue.folder}/{issue.where}: {issue.message}" for issue in errors]
    _refuse(tuple(faults), catalogue)


def _used_assets(profile: Profile, catalogue: Catalogue) -> list[str]:
    """Assets with a weight; of windows and doors all, as one without weight may fit better."""
    choices = distributions(profile, catalogue)
    names = {asset.name for kind in OPENINGS for asset in catalogue.of_kind(kind)}
    for choice in choices.values():
        names |= {name for name, weight in choice.assets.items() if weight > 0}
    return sorted(names)


def library_environment_faults(catalogue: Catalogue) -> tuple[str, ...]:
    """Faults of all environments in a library: their figures, and the names in them."""
    folder, faults = Path(catalogue.folder) / "environments", list[str]()
    for country, areas in known_environments(folder).items():
        for area in areas:
            with noted(faults):
                profile = read_profile(country, area, folder)
                faults += environment_faults(profile, catalogue)
    return tuple(faults)


def environment_faults(profile: Profile, catalogue: Catalogue) -> tuple[str, ...]:
    """Names in an environment that its library lacks, with the environment's file and table."""
    faults = [
        f"{profile.source}: props.{kind}: another table decides this kind; "
        f"write its weights in [{table}]"
        for kind, table in DECIDED.items()
        if kind in profile.props
    ]
    for table, distribution in weighted_choices(profile, catalogue).values():
        with noted(faults):
            check_distribution(catalogue, distribution, f"{profile.source}: {table}")
    for table, names in _materials(profile).items():
        for name in names:
            with noted(faults):
                catalogue.material(name, f"{profile.source}: {table}")
    for kind, spacing in vars(profile.furniture).items():
        if spacing > 0 and kind not in profile.props and not catalogue.of_kind(kind):
            faults.append(
                f"{profile.source}: furniture.{kind}: the library has no asset of the kind "
                f"'{kind}'; add one, or set {kind} = 0"
            )
    return tuple(faults)


def _materials(profile: Profile) -> Mapping[str, tuple[str, ...]]:
    """Names of materials by table of the environment's file."""
    buildings, road = profile.buildings, profile.road
    return {
        "ground_materials": tuple(profile.ground_materials.values()),
        "road.materials": tuple(road.materials),
        "road.sidewalk_materials": tuple(road.sidewalk_materials),
        "road.kerb_materials": tuple(road.kerb_materials),
        "buildings.materials": tuple(buildings.materials),
        "buildings.roof_materials": tuple(buildings.roof_materials),
        "buildings.flat_roof_materials": tuple(buildings.flat_roof_materials),
        "buildings.barns.materials": tuple(buildings.barns.materials),
        "buildings.barns.roof_materials": tuple(buildings.barns.roof_materials),
        **{
            f"enclosures.materials.{kind}": tuple(weights)
            for kind, weights in profile.enclosures.materials.items()
        },
    }


def _refuse(faults: tuple[str, ...], catalogue: Catalogue) -> None:
    """Raises the first of the faults."""
    if faults:
        rest = len(faults) - 1
        more = f" (and {rest} more: envgen-usd library check {catalogue.folder})" if rest else ""
        raise EnvgenError(f"{faults[0]}{more}")
