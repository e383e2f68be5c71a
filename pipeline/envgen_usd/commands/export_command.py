"""The command `export`."""

from pathlib import Path
from typing import Annotated

import typer

from envgen_usd.commands.option_types import Environment


def export(
    environment: Environment,
    *,
    gltf: Annotated[bool, typer.Option("--gltf", help="Write a .glb for each chunk.")] = False,
    to: Annotated[
        Path | None, typer.Option("--to", help="Folder to write; default: OUT/gltf.")
    ] = None,
    metadata: Annotated[
        str,
        typer.Option(
            help="Metadata 'embedded' in the nodes, or 'only': a .json for each chunk, no geometry."
        ),
    ] = "embedded",
    instancing: Annotated[
        bool,
        typer.Option(
            help="Batches of instances (EXT_mesh_gpu_instancing), or a node for each instance."
        ),
    ] = True,
) -> None:
    """Writes a built environment for other programs."""
    from envgen_usd.commands.terminal_output import print_issues, shown_progress
    from envgen_usd.errors import EnvgenError
    from envgen_usd.exchange.environment_export import export_gltf, stage_of

    if not gltf:
        raise EnvgenError("export: choose a format: --gltf")
    target = to or stage_of(environment).parent / "gltf"
    with shown_progress() as progress:
        result = export_gltf(
            environment, target, metadata_kind=metadata, instancing=instancing, progress=progress
        )
    print_issues(result.issues)
    size = sum(path.stat().st_size for path in result.files) / 1e6
    print(f"{result.folder}: {len(result.files)} chunks, {size:.1f} MB, {result.kept} kept")
