"""The command `library new-variant`."""

from pathlib import Path
from typing import Annotated

import typer

from envgen_usd.commands.option_types import EnvironmentFile, OwnLibrary, Weighted


def new_variant(
    asset: Annotated[str, typer.Argument(help="Name of the asset.")],
    variant: Annotated[str, typer.Argument(help="Name of the new variant.")],
    *,
    library: OwnLibrary,
    existing: Annotated[str, typer.Option("--from", help="Existing variant that is copied.")],
    variant_set: Annotated[
        str, typer.Option("--set", help="Variant set; default: the one with the existing variant.")
    ] = "",
    material: Annotated[
        list[str] | None,
        typer.Option(metavar="PART=MATERIAL", help="Material of a part; may be repeated."),
    ] = None,
    size: Annotated[str, typer.Option(metavar="X,Y,Z", help="Extent in metres.")] = "",
    geometry: Annotated[
        Path | None, typer.Option(help="File (.glb, .obj, .usd) that replaces the geometry.")
    ] = None,
    weight: Weighted = None,
    environment: EnvironmentFile = None,
) -> None:
    """Makes a variant from an existing one, with other materials, size, geometry and weight."""
    from envgen_usd.assets.asset_variant import VariantOptions
    from envgen_usd.assets.asset_variant import new_variant as make
    from envgen_usd.commands.option_types import check_weight, numbers
    from envgen_usd.commands.terminal_output import print_findings
    from envgen_usd.errors import EnvgenError
    from envgen_usd.recipe.environment_edits import library_of, variant_weight, write_environment

    check_weight(weight, environment)
    parts = dict(pair.partition("=")[::2] for pair in material or [])
    extent = numbers(size, "--size")
    if len(extent) not in {0, 3}:
        raise EnvgenError(f"--size {size}: give three numbers: x,y,z in metres")
    stated = (extent[0], extent[1], extent[2]) if extent else None
    options = VariantOptions(variant_set, parts, stated, geometry)
    made = make(library, asset, variant, existing, options)
    print_findings(made.issues)
    print(f"{library / made.interface}: {made.variant_set}={variant}")
    if made.payload:
        print(f"its geometry: {library / made.payload}")
    if environment is not None and weight is not None:
        edit = variant_weight(environment, asset, made.variant_set, variant, weight)
        write_environment(environment, [edit], library_of(environment))
        print(f"{environment}: [{edit.table}] {edit.line()}")
