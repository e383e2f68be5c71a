"""Draws an asset and its variants by the weights of an environment."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np

from envgen_usd.assets.asset_catalogue import Asset, Catalogue
from envgen_usd.assets.prim_authoring import SEASON
from envgen_usd.errors import EnvgenError
from envgen_usd.models.figure_types import Weights
from envgen_usd.seeds import Draws


@dataclass(frozen=True)
class Choice:
    """An asset with a selected variant for each of its variant sets.

    The set ``season`` is selected only where the environment weights it; otherwise the season is
    that of the stage.
    """

    asset: Asset
    selections: Mapping[str, str]


@dataclass(frozen=True)
class Distribution:
    """Weights of assets and variants.

    Attributes:
        assets: Weights of assets.
        variants: Weights of variants by variant set. An unlisted set keeps the asset's default;
            assets without a listed set ignore it.
    """

    assets: Weights
    variants: Mapping[str, Weights]


def check_distribution(catalogue: Catalogue, distribution: Distribution, where: str) -> None:
    """Raises an error unless every name of a distribution is in the catalogue.

    Args:
        catalogue: The library.
        distribution: Distribution to check.
        where: The environment's file and table, for the message.

    Raises:
        EnvgenError: Unknown asset, variant set or variant, or no weight above zero.
    """
    _check_names(distribution.assets, tuple(catalogue.assets), "asset", f"{where}.assets")
    assets = [catalogue.assets[name] for name in distribution.assets]
    sets = sorted({name for asset in assets for name in asset.variants})
    for name, weights in distribution.variants.items():
        if name not in sets:
            raise EnvgenError(
                f"{where}.variants: unknown variant set '{name}' of "
                f"{', '.join(distribution.assets)}; known: {', '.join(sets) or 'none'}"
            )
        known = sorted({v for asset in assets for v in asset.variants.get(name, ())})
        _check_names(weights, tuple(known), "variant", f"{where}.variants.{name}")


def _check_names(weights: Weights, known: tuple[str, ...], what: str, where: str) -> None:
    for name in weights:
        if name not in known:
            raise EnvgenError(f"{where}: unknown {what} '{name}'; known: {', '.join(known)}")
    if not any(weight > 0 for weight in weights.values()):
        raise EnvgenError(f"{where}: no {what} has a weight above 0")


def choose(catalogue: Catalogue, distribution: Distribution, rng: np.random.Generator) -> Choice:
    """Draws an asset and a variant for each of its sets; names must be known.

    The number of draws does not depend on their outcome. So a changed weight affects no other
    choice of the same generator.
    """
    asset = catalogue.assets[_draw(distribution.assets, rng.random())]
    usual = {name: variant for name, variant in asset.defaults.items() if name != SEASON}
    return Choice(asset, {**usual, **choose_variants(asset, distribution, rng)})


def choose_variants(
    asset: Asset, distribution: Distribution, rng: np.random.Generator
) -> dict[str, str]:
    """Draws a variant for each set of an asset that has weights."""
    draws = rng.random(len(distribution.variants))
    drawn = {}
    for (name, weights), value in zip(sorted(distribution.variants.items()), draws, strict=True):
        known = {key: w for key, w in weights.items() if key in asset.variants.get(name, ())}
        if known:
            drawn[name] = _draw(known, float(value))
    return drawn


def redrawn(
    choice: Choice, distribution: Distribution, sets: Collection[str], draws: Draws
) -> Choice:
    """Returns a choice of the same asset with some variant sets drawn anew."""
    again = {}
    for name in sorted(sets):
        weights, variants = distribution.variants.get(name, {}), choice.asset.variants.get(name, ())
        known = {key: weight for key, weight in weights.items() if key in variants}
        if known:
            again[name] = _draw(known, draws.share(name))
    return Choice(choice.asset, {**choice.selections, **again}) if again else choice


def drawn_variant(weights: Weights, value: float) -> str:
    """The variant at a value in [0, 1), by weight; several choices of one value agree."""
    return _draw(weights, value)


def _draw(weights: Weights, value: float) -> str:
    """The name at a value in [0, 1) of the cumulative weights, in the order of names."""
    names = sorted(weights)
    limits = np.cumsum([max(weights[name], 0.0) for name in names])
    if limits[-1] <= 0:
        return names[0]
    return names[int(np.searchsorted(limits, value * limits[-1], side="right"))]
