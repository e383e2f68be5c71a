"""Fits the weights and spacings of an environment to counts of real streets.

Shares of variants: maximum likelihood of a multinomial distribution with `smoothing` added to each
count; 1 is Laplace's rule of succession (Laplace 1774), other values are Lidstone's (1920), and 0
is the plain share. Spacing of furniture: maximum likelihood of a Poisson process along the street,
length / count. Spacing of lights and of trees along streets: maximum likelihood of a uniform
distribution, the least and the largest spacing of several rows. Density of trees: count / area.
"""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path

from envgen_usd.assets.asset_catalogue import Asset, Catalogue
from envgen_usd.assets.observed_counts import Observed, read_counts
from envgen_usd.errors import EnvgenError
from envgen_usd.layers.prop_distributions import weighted_choices
from envgen_usd.models.environment_profile import FurnitureRules, Profile
from envgen_usd.recipe.environment_edits import library_of, read_environment
from envgen_usd.toml_edits import Edit

HECTARE = 1e4
_FURNITURE = {entry.name for entry in fields(FurnitureRules)}
_ASSETS = {
    "street_tree": "tree",
    "main_street_light": "street_light",
    "street_sign": "traffic_sign",
}
"""Kind of the assets of kinds that an environment places under another name."""


@dataclass(frozen=True)
class _Fit:
    """Counts of a kind, and what they are fitted to."""

    kind: str
    table: str
    assets: Mapping[str, Asset]
    weighted: Mapping[str, Mapping[str, float]]
    where: str


def learned_edits(counts: Path, file: Path, smoothing: float = 1.0) -> tuple[Edit, ...]:
    """The values of an environment that fit counts.

    Variants that neither were counted nor have a weight in the environment get none.

    Args:
        counts: CSV file, see `observed_counts.read_counts`.
        file: File of the environment.
        smoothing: Added to each count; a larger value makes shares more equal.

    Raises:
        EnvgenError: A file cannot be used, or a row names what the library lacks.
    """
    if not 0.0 <= smoothing < float("inf"):
        raise EnvgenError(f"smoothing {smoothing}: expected a number of at least 0")
    rows = read_counts(counts)
    catalogue, profile = library_of(file), read_environment(file)
    by_kind: dict[str, list[Observed]] = defaultdict(list)
    for row in rows:
        by_kind[row.kind].append(row)
    edits: list[Edit] = []
    for kind, of_kind in by_kind.items():
        fit = _fit(kind, of_kind[0], catalogue, profile, counts)
        edits += _shares(fit, of_kind, smoothing, catalogue)
        edits += _spacing(fit, of_kind, profile)
        edits += _density(fit, of_kind)
    return tuple(edits)


def _fit(kind: str, row: Observed, catalogue: Catalogue, profile: Profile, counts: Path) -> _Fit:
    assets = {asset.name: asset for asset in catalogue.of_kind(_ASSETS.get(kind, kind))}
    if not assets:
        known = sorted({asset.kind for asset in catalogue.assets.values()} | {"street_tree"})
        raise EnvgenError(
            f"{counts}: line {row.line}: the library has no asset of the kind '{kind}'; "
            f"known: {', '.join(known)}"
        )
    choices = weighted_choices(profile, catalogue)
    if kind not in choices:
        return _Fit(kind, f"props.{kind}", assets, {}, str(counts))
    table, distribution = choices[kind]
    weighted = {"": distribution.assets, **distribution.variants}
    return _Fit(kind, table, assets, weighted, str(counts))


def _shares(
    fit: _Fit, rows: Sequence[Observed], smoothing: float, catalogue: Catalogue
) -> list[Edit]:
    """Weights of the assets (set ``""``) and of each variant set that was counted."""
    counted: dict[str, dict[str, int]] = defaultdict(lambda: defaultdict(int))
    for row in rows:
        if row.variant:
            name, variant = _variant(fit, row)
            counted[name][variant] += row.count
    edits = []
    for name, numbers in counted.items():
        usual = _default_weights(fit, name, catalogue)
        names = sorted({*numbers, *fit.weighted.get(name, usual)})
        total = sum(numbers.values()) + smoothing * len(names)
        if total <= 0.0:
            raise EnvgenError(f"{fit.where}: {fit.kind}: all counts are 0; use --smoothing 1")
        shares = {each: (numbers.get(each, 0) + smoothing) / total for each in names}
        note = f"from {Path(fit.where).name}: {sum(numbers.values())} counted, +{smoothing:g} each"
        edits.append(Edit(fit.table, f"variants.{name}" if name else "assets", shares, note))
    return edits


def _default_weights(fit: _Fit, name: str, catalogue: Catalogue) -> dict[str, float]:
    """All that may occur in a set without weights."""
    if not name:
        sheets = {sheet.asset for sheet in catalogue.signs}
        return dict.fromkeys(set(fit.assets) - sheets or fit.assets, 1.0)
    return {v: 1.0 for asset in fit.assets.values() for v in asset.variants.get(name, ())}


def _variant(fit: _Fit, row: Observed) -> tuple[str, str]:
    """Variant set and variant of a row; an asset has the set ``""``.

    Raises:
        EnvgenError: The library lacks it, or several sets have it.
    """
    where = f"{fit.where}: line {row.line}"
    name, mark, variant = row.variant.partition("=")
    sets: dict[str, set[str]] = defaultdict(set)
    for asset in fit.assets.values():
        for of, variants in asset.variants.items():
            sets[of] |= set(variants)
    if mark:
        if variant.strip() in sets.get(name.strip(), set()):
            return name.strip(), variant.strip()
    elif row.variant in fit.assets:
        return "", row.variant
    else:
        found = [of for of, variants in sets.items() if row.variant in variants]
        if len(found) == 1:
            return found[0], row.variant
        if found:
            text = f"variant '{row.variant}' is in the sets {', '.join(sorted(found))}"
            raise EnvgenError(f"{where}: {text}; write {found[0]}={row.variant}")
    known = [f"{of}={each}" for of, variants in sorted(sets.items()) for each in sorted(variants)]
    raise EnvgenError(
        f"{where}: unknown variant '{row.variant}' of {fit.kind}; known: "
        f"{', '.join([*sorted(fit.assets), *known])}"
    )


def _spacing(fit: _Fit, rows: Sequence[Observed], profile: Profile) -> list[Edit]:
    stated = [(row.spacing, max(row.count, 1)) for row in rows if row.spacing is not None]
    if not stated:
        return []
    total = sum(count for _, count in stated)
    mean = sum(spacing * count for spacing, count in stated) / total
    note = f"from {Path(fit.where).name}: {total} counted"
    if fit.kind in _FURNITURE:
        return [Edit("furniture", fit.kind, mean, note)]
    ranges = {
        "street_light": profile.street_lights.spacing,
        "street_tree": profile.street_trees.spacing,
        "window": profile.buildings.windows.spacing,
        "door": profile.buildings.doors.spacing,
    }
    if fit.kind not in ranges:
        known = ", ".join(sorted(_FURNITURE | set(ranges)))
        raise EnvgenError(f"{fit.where}: {fit.kind} has no spacing; kinds with one: {known}")
    spacings = [spacing for spacing, _ in stated]
    low, high = min(spacings), max(spacings)
    if len(stated) == 1:
        # A single figure says nothing of the range: the environment's keeps its relative width.
        before = ranges[fit.kind]
        low, high = (mean * limit * 2.0 / sum(before) for limit in before)
    return [Edit(fit.table, "spacing", [low, high], note)]


def _density(fit: _Fit, rows: Sequence[Observed]) -> list[Edit]:
    stated = [(row.count, row.area) for row in rows if row.area is not None]
    if not stated:
        return []
    if fit.kind != "tree":
        raise EnvgenError(f"{fit.where}: area is for the kind 'tree', not for '{fit.kind}'")
    searched = sum(area for _, area in stated)
    count = sum(number for number, _ in stated)
    note = f"from {Path(fit.where).name}: {count} on {searched:g} m2"
    return [Edit(fit.table, "density", count / searched * HECTARE, note)]
