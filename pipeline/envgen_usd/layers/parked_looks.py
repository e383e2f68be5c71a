"""Looks of the actors of an environment: assets with the variants that decide their size."""

from collections.abc import Iterator
from itertools import product

from envgen_usd.assets.asset_catalogue import Asset, Catalogue
from envgen_usd.assets.variant_choice import Distribution
from envgen_usd.errors import Issue, Severity
from envgen_usd.layers.prop_distributions import distributions
from envgen_usd.models.actor_rules import ActorRules
from envgen_usd.models.environment_profile import Profile
from envgen_usd.models.parked_actors import ActorLook, Looks

PEOPLE = "pedestrian"
BICYCLES = "bicycle"
BINS = "wheelie_bin"
_MOST_SETS = 2
"""Largest number of variant sets that decide the size of an asset; bounds the number of looks."""


def parked_looks(profile: Profile, catalogue: Catalogue) -> Looks:
    """Returns the looks of all kinds that the environment may place and the library has.

    Raises:
        EnvgenError: The environment names an asset or a variant that the library lacks.
    """
    if profile.actors is None:
        return {}
    known = distributions(profile, catalogue)
    return {
        kind: tuple(_looks(kind, known[kind], catalogue))
        for kind in wanted_kinds(profile.actors)
        if kind in known
    }


def wanted_kinds(rules: ActorRules) -> tuple[str, ...]:
    """Kinds of assets that an environment places as actors."""
    tables = (
        rules.kerbs.vehicles,
        rules.bays.vehicles,
        rules.lots.vehicles,
        rules.lots.yard_vehicles if rules.lots.yards > 0.0 else {},
    )
    vehicles = {kind for table in tables for kind, weight in table.items() if weight > 0.0}
    others = {
        PEOPLE: max(rules.people.density),
        BICYCLES: max(rules.kerbside.bicycles),
        BINS: rules.kerbside.bins,
    }
    return tuple(sorted({*vehicles, *(kind for kind, most in others.items() if most > 0.0)}))


def missing_kinds(profile: Profile, looks: Looks) -> tuple[Issue, ...]:
    """Returns an issue for each kind that the environment places and the library lacks."""
    rules = profile.actors
    return tuple(
        Issue(
            "actors.no_asset",
            Severity.WARNING,
            f"{profile.source}: actors",
            f"the library has no asset of the kind '{kind}'",
            f"no {kind} on the streets; an asset in assets/{kind} adds some",
        )
        for kind in (wanted_kinds(rules) if rules is not None else ())
        if not looks.get(kind)
    )


def _looks(kind: str, weights: Distribution, catalogue: Catalogue) -> Iterator[ActorLook]:
    for name, weight in sorted(weights.assets.items()):
        asset = catalogue.assets[name]
        sets = _deciding_sets(asset)
        shares = [_shares(asset, each, weights) for each in sets]
        for variants in product(*shares):
            selections = dict(zip(sets, variants, strict=True))
            share = weight
            for of_set, variant in zip(shares, variants, strict=True):
                share *= of_set[variant]
            if share > 0.0:
                low, high = asset.extent(selections)
                yield ActorLook(kind, name, selections, share, high - low)


def _deciding_sets(asset: Asset) -> list[str]:
    """Variant sets whose variants have a size of their own."""
    return sorted({of_set for of_set, _ in asset.extents if of_set})[:_MOST_SETS]


def _shares(asset: Asset, of_set: str, weights: Distribution) -> dict[str, float]:
    """Shares of the variants of a set; all alike where the environment does not weight them."""
    stated = weights.variants.get(of_set, {})
    known = {name: stated[name] for name in asset.variants[of_set] if name in stated}
    shares = known or dict.fromkeys(asset.variants[of_set], 1.0)
    total = sum(shares.values()) or 1.0
    return {name: share / total for name, share in shares.items()}
