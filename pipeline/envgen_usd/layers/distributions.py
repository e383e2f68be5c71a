"""The environment's weights for each category of prop."""

from envgen_usd.assets.catalogue import Asset, Catalogue
from envgen_usd.assets.choose import Distribution, check_distribution
from envgen_usd.models.city import CityObject
from envgen_usd.models.profile import OpeningRules, Profile, StreetLightRules, TreeRules


def distributions(profile: Profile, catalogue: Catalogue) -> dict[str, Distribution]:
    """Returns what may be chosen for each category.

    Trees, street lights, windows and doors follow the environment; for every other kind of asset
    that the library has, all assets of that kind are equally likely.

    Raises:
        EnvgenError: The environment names something that the library does not have.
    """
    rules: dict[str, TreeRules | StreetLightRules | OpeningRules] = {
        "tree": profile.trees,
        "street_light": profile.street_lights,
        "window": profile.buildings.windows,
        "door": profile.buildings.doors,
    }
    found = {name: Distribution(rule.assets, rule.variants) for name, rule in rules.items()}
    tables = {"window": "buildings.windows", "door": "buildings.doors", "tree": "trees"}
    for name, distribution in found.items():
        table = tables.get(name, "street_lights")
        check_distribution(catalogue, distribution, f"{profile.source}: {table}")
    for kind in sorted({asset.kind for asset in catalogue.assets.values()} - set(found)):
        weights = {asset.name: 1.0 for asset in catalogue.of_kind(kind)}
        found[kind] = Distribution(weights, {})
    return found


def fitting(
    distribution: Distribution, kind: str, catalogue: Catalogue, width: float
) -> Distribution:
    """Returns the distribution with the assets that can be this wide.

    Where none of them can (a house's garage is wider than its front door), all assets of the kind
    that can are equally likely; where there is none either, the distribution stays as it is.
    """
    fits = {
        name: weight
        for name, weight in distribution.assets.items()
        if catalogue.assets[name].fits(width)
    }
    if fits:
        return Distribution(fits, distribution.variants)
    others = {asset.name: 1.0 for asset in catalogue.of_kind(kind) if asset.fits(width)}
    return Distribution(others, distribution.variants) if others else distribution


def sign_selections(thing: CityObject, asset: Asset) -> dict[str, str]:
    """Variants that a feature's own attributes ask for: a sign's ``shape``, for example.

    An attribute counts if it has the name of a variant set of the asset, or that name after
    ``sign_`` (which is finer and comes first), and the value of one of its variants.
    """
    found = {}
    for name, variants in asset.variants.items():
        wishes = [str(thing.attributes.get(key, "")) for key in (f"sign_{name}", name)]
        asked = [wish for wish in wishes if wish in variants]
        if asked:
            found[name] = asked[0]
    return found
