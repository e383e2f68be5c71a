"""The command `library import`."""

from pathlib import Path
from typing import Annotated

import typer

from envgen_usd.commands.option_types import EnvironmentFile, OwnLibrary, Weighted


def import_file(
    file: Annotated[Path, typer.Argument(help="File: .glb, .gltf, .obj, .usd or .usdz.")],
    *,
    library: OwnLibrary,
    kind: Annotated[str, typer.Option(help="Kind of object: bench, bin, tree, window, ...")],
    name: Annotated[str, typer.Option(help="Name of the asset; default: that of the file.")] = "",
    label: Annotated[
        str, typer.Option(help="Class of labels; default: that of the kind's other assets.")
    ] = "",
    scale: Annotated[float, typer.Option(help="Factor of all lengths.")] = 1.0,
    height: Annotated[float, typer.Option(help="Height in metres to scale it to.")] = 0.0,
    up: Annotated[str, typer.Option(help="Axis that points up: y or z.")] = "",
    turn: Annotated[
        float, typer.Option(help="Turn about the vertical, degrees; the front is to face +x.")
    ] = 0.0,
    keep_pivot: Annotated[
        bool, typer.Option("--keep-pivot", help="Keep the origin; else the middle of the foot.")
    ] = False,
    replace: Annotated[
        bool, typer.Option("--replace", help="Replace the asset of this name.")
    ] = False,
    weight: Weighted = None,
    environment: EnvironmentFile = None,
) -> None:
    """Makes an asset from a file of another program, with its materials and a far geometry."""
    from envgen_usd.assets.asset_import import ImportOptions, import_asset
    from envgen_usd.commands.option_types import check_weight
    from envgen_usd.commands.terminal_output import print_findings
    from envgen_usd.recipe.environment_edits import asset_weight, library_of, write_environment

    check_weight(weight, environment)
    options = ImportOptions(kind, name, label, scale, height, up, turn, keep_pivot, replace)
    made = import_asset(file, library, options)
    print_findings(made.issues)
    x, y, z = made.size
    near, far = made.triangles
    print(f"{library / made.path}: {x:.2f} x {y:.2f} x {z:.2f} m, {near} triangles, {far} far")
    print(f"materials: {', '.join(made.materials)}")
    if environment is not None and weight is not None:
        edit = asset_weight(environment, made.name, weight)
        write_environment(environment, [edit], library_of(environment))
        print(f"{environment}: [{edit.table}] {edit.line()}")
