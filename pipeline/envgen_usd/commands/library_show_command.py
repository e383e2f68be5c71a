"""The command `library show`."""

from typing import Annotated

import typer

from envgen_usd.commands.option_types import Library


def show(
    asset: Annotated[str, typer.Argument(help="Name of the asset.")],
    *,
    library: Library = None,
) -> None:
    """Shows the variants of an asset with their figures, and where environments use it."""
    from envgen_usd.assets.asset_catalogue import read_catalogue
    from envgen_usd.assets.asset_summary import summarise
    from envgen_usd.errors import EnvgenError
    from envgen_usd.label_taxonomy import label
    from envgen_usd.recipe.asset_uses import asset_uses

    catalogue = read_catalogue(library)
    if asset not in catalogue.assets:
        known = ", ".join(catalogue.assets)
        raise EnvgenError(f"unknown asset '{asset}'; known: {known}")
    found = catalogue.assets[asset]
    print(f"{found.kind}/{found.name}  {catalogue.folder / found.path}")
    print(f"labels: class {found.label}, cityscapes {label(found.label).cityscapes}")
    print("\nvariant | size, m | triangles near, far | lamps | materials | parts")
    for each in summarise(catalogue.folder, found):
        size = " x ".join(f"{value:.2f}" for value in each.size)
        lists = f"{', '.join(each.materials)} | {', '.join(each.parts)}"
        print(f"{each.name or '-'} | {size} | {each.near}, {each.far} | {each.lamps} | {lists}")
    print("\nenvironment | table | share | spacing, m | weights of variants")
    for use in asset_uses(catalogue, found):
        weights = "; ".join(
            f"{name}: " + ", ".join(f"{each} {weight:g}" for each, weight in of.items())
            for name, of in use.variants.items()
        )
        spacing = f"{use.spacing:g}" if use.spacing else "-"
        print(f"{use.environment} | {use.table} | {use.share:.2f} | {spacing} | {weights or '-'}")
