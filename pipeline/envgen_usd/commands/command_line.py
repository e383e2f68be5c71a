"""The program `envgen-usd` with all its commands."""

from importlib import metadata
from typing import Annotated

import typer

from envgen_usd.commands.build_command import build
from envgen_usd.commands.citygml_command import citygml
from envgen_usd.commands.dataset_command import app as dataset_app
from envgen_usd.commands.environment_commands import app as environment_app
from envgen_usd.commands.export_command import export
from envgen_usd.commands.flatten_command import flatten
from envgen_usd.commands.inspect_command import inspect
from envgen_usd.commands.landuse_commands import app as landuse_app
from envgen_usd.commands.library_commands import app as library_app
from envgen_usd.commands.package_command import package
from envgen_usd.commands.render_command import render
from envgen_usd.commands.study_commands import app as study_app
from envgen_usd.commands.synth_road_command import synth_road
from envgen_usd.commands.traffic_command import traffic
from envgen_usd.commands.validate_command import validate
from envgen_usd.commands.verify_command import verify
from envgen_usd.commands.view_command import view

app = typer.Typer(
    pretty_exceptions_enable=False,
)


def _print_version(wanted: bool) -> None:
    if wanted:
        print(f"envgen-usd {metadata.version('envgen-usd')}")
        raise typer.Exit


@app.callback(no_args_is_help=True)
def program(
    *,
    version: Annotated[
        bool,
        typer.Option(
            "--version", help="Print the version.", is_eager=True, callback=_print_version
        ),
    ] = False,
) -> None:
    """Builds a labelled 3D environment in OpenUSD from an OpenDRIVE road, and renders it."""
    del version  # The option's callback has already printed the version.


SINGLE = (
    *(build, traffic, render, inspect, citygml, validate, verify),
    *(flatten, export, package, view),
)
for command in SINGLE:
    app.command()(command)
app.command("synth-road")(synth_road)
app.add_typer(dataset_app)
app.add_typer(environment_app)
app.add_typer(landuse_app)
app.add_typer(library_app)
app.add_typer(study_app)
