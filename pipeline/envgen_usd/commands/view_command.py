"""The command `view`."""

from typing import Annotated

import typer

from envgen_usd.commands.option_types import Environment


def view(
    environment: Environment,
    *,
    port: Annotated[
        int, typer.Option(min=0, max=65535, help="Port of the page; 0 takes a free port.")
    ] = 0,
    export: Annotated[
        bool, typer.Option(help="Bring the glTF files up to date first, or show them as they are.")
    ] = True,
) -> None:
    """Shows an environment in a browser of this machine, until Ctrl-C.

    Nothing is asked from another host; other machines cannot reach the page.
    """
    from envgen_usd.commands.terminal_output import print_issues, shown_progress
    from envgen_usd.exchange.environment_export import export_gltf, stage_of
    from envgen_usd.exchange.exported_files import read_index
    from envgen_usd.exchange.viewer.page_server import PageServer
    from envgen_usd.interrupts import Interrupted

    folder = environment
    if export:
        folder = stage_of(environment).parent / "gltf"
        with shown_progress() as progress:
            print_issues(export_gltf(environment, folder, progress=progress).issues)
    elif not (folder / "tiles.json").is_file():
        folder = environment / "gltf"
    read_index(folder)
    with PageServer(folder, port) as server:
        print(f"open {server.url} in a browser; Ctrl-C ends", flush=True)
        try:
            server.serve_forever()
        except Interrupted:
            print("ended")
