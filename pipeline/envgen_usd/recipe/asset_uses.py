"""Where the environments of a library use an asset."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from envgen_usd.assets.asset_catalogue import Asset, Catalogue
from envgen_usd.environment_files import known_environments, read_profile
from envgen_usd.layers.prop_distributions import distributions, weighted_choices


@dataclass(frozen=True)
class AssetUse:
    """A use of an asset.

    Attributes:
        environment: Country and area type, e.g. ``1/residential``.
        table: Table of the environment's file, or the kind where no table names it.
        share: Share of the choices of that table, 0 to 1.
        spacing: Metres of sidewalk for each of its kind; 0 where the environment places none.
        variants: Weights by variant set.
    """

    environment: str
    table: str
    share: float
    spacing: float
    variants: Mapping[str, Mapping[str, float]]


def asset_uses(catalogue: Catalogue, asset: Asset) -> Iterator[AssetUse]:
    """Yields the uses of an asset in all environments of its library.

    Raises:
        EnvgenError: An environment is not valid.
    """
    folder = Path(catalogue.folder) / "environments"
    for country, areas in known_environments(folder).items():
        for area in areas:
            profile = read_profile(country, area, folder)
            tables = weighted_choices(profile, catalogue)
            for kind, choice in distributions(profile, catalogue).items():
                weight = choice.assets.get(asset.name, 0.0)
                if weight <= 0.0:
                    continue
                used = {
                    name: weights
                    for name, weights in choice.variants.items()
                    if name in asset.variants
                }
                yield AssetUse(
                    f"{country}/{area}",
                    tables[kind][0] if kind in tables else kind,
                    weight / sum(choice.assets.values()),
                    float(getattr(profile.furniture, kind, 0.0)),
                    used,
                )
