"""The environment's weights for each category of props."""

from collections.abc import Mapping
from typing import TypeAlias

from envgen_usd.assets.asset_catalogue import Asset, Catalogue
from envgen_usd.assets.signs.sign_choice import SignalFacts, sign_face
from envgen_usd.assets.variant_choice import Choice, Distribution, check_distribution
from envgen_usd.models.building_rules import OpeningRules
from envgen_usd.models.city_model import CityObject
from envgen_usd.models.environment_profile import (
    Profile,
    PropRules,
    StreetLightRules,
    StreetTreeRules,
    TreeRules,
)

DECIDED = {
    "tree": "trees",
    "street_tree": "street_trees",
    "street_light": "street_lights",
    "main_street_light": "main_street_lights",
    "window": "buildings.windows",
    "door": "buildings.doors",
}
"""Kinds that a table of their own decides, and not ``props.<kind>``."""
STREET_SIGN = "street_sign"
"""Kind of small signs on posts at the kerb."""
_FACE = "face"
_Rules: TypeAlias = TreeRules | StreetTreeRules | StreetLightRules | OpeningRules | PropRules


def distributions(profile: Profile, catalogue: Catalogue) -> dict[str, Distribution]:
    """Returns the weighted choices of each category.

    Trees, street lights, windows, doors and the kinds of the table `props` follow the environment.
    For every other kind, all assets of the library are equally likely, besides the sheets of sign
    faces: signals name those.

    Raises:
        EnvgenError: The environment names an asset or variant that the library lacks.
    """
    by_category = {}
    for category, (table, distribution) in weighted_choices(profile, catalogue).items():
        check_distribution(catalogue, distribution, f"{profile.source}: {table}")
        by_category[category] = distribution
    for kind in sorted({asset.kind for asset in catalogue.assets.values()} - set(by_category)):
        by_category[kind] = Distribution(_equal_weights(kind, catalogue), {})
    return by_category


def _equal_weights(kind: str, catalogue: Catalogue) -> dict[str, float]:
    """Weights of all assets of a kind, without the sheets of sign faces."""
    sheets = {sheet.asset for sheet in catalogue.signs}
    names = {asset.name for asset in catalogue.of_kind(kind)}
    return dict.fromkeys(sorted(names - sheets or names), 1.0)


def weighted_choices(profile: Profile, catalogue: Catalogue) -> dict[str, tuple[str, Distribution]]:
    """Table of the environment's file and its weights, for each category that it decides."""
    buildings = profile.buildings
    decided: dict[str, _Rules] = {
        "tree": profile.trees,
        "street_tree": profile.street_trees,
        "street_light": profile.street_lights,
        "window": buildings.windows,
        "door": buildings.doors,
    }
    if profile.main_street_lights is not None:
        decided["main_street_light"] = profile.main_street_lights
    rules: dict[str, tuple[str, _Rules]] = {
        **{
            kind: (f"props.{kind}", rule)
            for kind, rule in profile.props.items()
            if rule.assets or catalogue.of_kind(kind)
        },
        **{kind: (DECIDED[kind], rule) for kind, rule in decided.items()},
    }
    return {
        category: (
            table,
            Distribution(rule.assets or _equal_weights(category, catalogue), rule.variants),
        )
        for category, (table, rule) in rules.items()
    }


def fitting(
    distribution: Distribution, kind: str, catalogue: Catalogue, width: float
) -> Distribution:
    """Returns the distribution, limited to assets of a suitable width.

    If no weighted asset fits (a garage is wider than a front door), all fitting assets of the kind
    are equally likely. If none fits either, the distribution is unchanged.
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


def without_bans(
    known: Mapping[str, Distribution], catalogue: Catalogue
) -> dict[str, Distribution]:
    """Returns the weights of small signs at kerbs where vehicles park: none forbids it.

    Args:
        known: Weighted choices of each category.
        catalogue: Its sheets say which faces forbid parking.
    """
    rows = (row for sheet in catalogue.signs for row in sheet.face if row.forbids_parking)
    bans = {name for row in rows for name in row.variants()}
    if STREET_SIGN not in known:
        return {}
    assets, variants = known[STREET_SIGN].assets, known[STREET_SIGN].variants
    faces = {name: 0.0 if name in bans else w for name, w in variants.get(_FACE, {}).items()}
    return {STREET_SIGN: Distribution(assets, {**variants, _FACE: faces} if faces else variants)}


def sign_asset(feature: CityObject, catalogue: Catalogue) -> Choice | None:
    """Returns the sign with the face that a signal names; `None` for an unknown sign."""
    face = sign_face(SignalFacts.of(feature.attributes), catalogue.signs)
    return Choice(catalogue.assets[face[0]], {"face": face[1]}) if face else None


def sign_selections(feature: CityObject, asset: Asset) -> dict[str, str]:
    """Variants that a feature's attributes select, e.g. a sign's ``shape``.

    An attribute selects a variant if it has the name of a variant set and the value of a variant.
    The prefix ``sign_`` before the set's name is allowed and takes precedence.
    """
    selections = {}
    for name, variants in asset.variants.items():
        wishes = [str(feature.attributes.get(key, "")) for key in (f"sign_{name}", name)]
        asked = [wish for wish in wishes if wish in variants]
        if asked:
            selections[name] = asked[0]
    return selections
