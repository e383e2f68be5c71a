"""The command `export`."""

from pathlib import Path
from typing import Annotated

import typer

from envgen_usd.commands.option_types import Environment

_TILE = 2000.0
"""Largest side of a tile for CARLA, metres; a larger value makes fewer and larger tiles."""
_FULL = "full"
"""Meshes as drawn from near."""


def export(
    environment: Environment,
    *,
    gltf: Annotated[bool, typer.Option("--gltf", help="Write a .glb for each chunk.")] = False,
    carla: Annotated[
        bool, typer.Option("--carla", help="Write a package for CARLA's import; needs --road.")
    ] = False,
    to: Annotated[
        Path | None, typer.Option("--to", help="Folder to write; default: OUT/gltf or OUT/carla.")
    ] = None,
    metadata: Annotated[
        str,
        typer.Option(
            help="glTF: metadata 'embedded' in the nodes, or 'only': a .json for each chunk, "
            "no geometry."
        ),
    ] = "embedded",
    instancing: Annotated[
        bool,
        typer.Option(
            help="glTF: batches of instances (EXT_mesh_gpu_instancing), or a node for each "
            "instance."
        ),
    ] = True,
    road: Annotated[
        Path | None,
        typer.Option(help="CARLA: OpenDRIVE file of the build; its name is that of the map."),
    ] = None,
    tile_size: Annotated[
        float, typer.Option(help="CARLA: largest side of a tile, metres; larger maps get several.")
    ] = _TILE,
    detail: Annotated[
        str,
        typer.Option(help="CARLA: meshes as drawn from near, 'full', or from far, 'simple'."),
    ] = _FULL,
) -> None:
    """Writes a built environment for other programs."""
    from envgen_usd.commands.terminal_output import print_issues, shown_progress
    from envgen_usd.errors import EnvgenError
    from envgen_usd.exchange.carla.carla_export import export_carla
    from envgen_usd.exchange.environment_export import EMBEDDED, export_gltf, stage_of
    from envgen_usd.idle_options import refuse_idle

    if gltf == carla:
        raise EnvgenError("export: choose a format: --gltf or --carla")
    if gltf:
        of_carla = {"--road": road, "--tile-size": tile_size != _TILE, "--detail": detail != _FULL}
        refuse_idle(of_carla, "with --gltf")
    else:
        of_gltf = {"--metadata": metadata != EMBEDDED, "--no-instancing": not instancing}
        refuse_idle(of_gltf, "with --carla")
    if carla and road is None:
        raise EnvgenError("--carla needs the build's OpenDRIVE file: --road FILE")
    target = to or stage_of(environment).parent / ("gltf" if gltf else "carla")
    with shown_progress() as progress:
        if road is not None and carla:
            result = export_carla(
                environment,
                target,
                road=road,
                tile_size=tile_size,
                detail=detail,
                progress=progress,
            )
        else:
            result = export_gltf(
                environment,
                target,
                metadata_kind=metadata,
                instancing=instancing,
                progress=progress,
            )
    print_issues(result.issues)
    size = sum(path.stat().st_size for path in result.files) / 1e6
    parts = "chunks" if gltf else "tiles"
    print(f"{result.folder}: {len(result.files)} {parts}, {size:.1f} MB, {result.kept} kept")
