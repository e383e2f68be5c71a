"""The commands `envgen-usd environment ...`: environments of real places."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from envgen_usd.commands.terminal_output import print_issues, shell_command, shown_progress
from envgen_usd.environment_files import read_profile
from envgen_usd.errors import EnvgenError

app = typer.Typer(
    name="environment",
    help="Environments: fits them to real places.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)


@app.callback()
def environment() -> None:
    """Environments: fits them to real places."""


@app.command()
def learn(
    place: Annotated[
        Path,
        typer.Argument(help="OpenStreetMap extract (.osm, .osm.gz, .pbf), CityGML or CityJSON."),
    ],
    *,
    out: Annotated[Path, typer.Option(help="File to write: FOLDER/country_<name>/<area>.toml.")],
    base: Annotated[
        str,
        typer.Option(
            metavar="COUNTRY/AREA",
            help="Environment of the library whose values stay where too little is known.",
        ),
    ] = "1/residential",
    landuse: Annotated[
        Literal["all", "residential", "industrial"],
        typer.Option(help="Landuse of the buildings to learn from."),
    ] = "all",
    half: Annotated[
        Literal["all", "west", "east"],
        typer.Option(help="Half of the place to learn from; the other stays for comparison."),
    ] = "all",
) -> None:
    """Fits an environment to a real place, with a report beside its file."""
    from envgen_usd.places.fit_report import write_fit_report
    from envgen_usd.recipe.environment_learning import check_new_environment, learnt_environment
    from envgen_usd.recipe.real_place import read_place
    from envgen_usd.whole_files import make_folder, write_whole

    check_new_environment(out)
    country, _, area = base.partition("/")
    if not area:
        raise EnvgenError(f"--base {base}: expected COUNTRY/AREA, as in 1/residential")
    profile = read_profile(country, area)
    whole = read_place(place)
    part = whole if half == "all" else whole.halves()[half == "east"]
    with shown_progress() as progress:
        chosen = "" if landuse == "all" else landuse
        learnt = learnt_environment(part, profile, chosen, progress=progress)
    make_folder(out.parent)
    report = out.with_suffix(".html")
    write_whole(out, learnt.text)
    write_fit_report(report, part.source, learnt)
    print_issues(whole.issues)
    for value in learnt.values:
        what = "learnt" if value.value is not None else f"kept as in {base}"
        print(f"{f'{value.table}.{value.key}':28} {value.samples:6} samples  {what}")
    print(f"environment: {out}")
    print(f"report:      {report}")
    name = out.resolve().parent.name.removeprefix("country_")
    where = ("--environments", out.parent.parent, "--country", name, "--area", out.stem)
    print(f"next:        {shell_command('build', 'ROAD', *where, '--out', 'FOLDER')}")
