"""Arguments and options that several commands share."""

from collections.abc import Iterable
from pathlib import Path
from typing import Annotated

import typer

from envgen_usd.environment_files import known_environments
from envgen_usd.errors import EnvgenError
from envgen_usd.input_paths import check_input_file
from envgen_usd.recipe.build_options import TOLERANCES

ENVIRONMENTS = known_environments()
AREAS = sorted({area for areas in ENVIRONMENTS.values() for area in areas})


def _listed(names: Iterable[str]) -> str:
    return f"of the library: {', '.join(names)}"


Country = Annotated[
    str,
    typer.Option(
        help=f"Country of the environment; {_listed(ENVIRONMENTS)}.",
        autocompletion=lambda: [*ENVIRONMENTS],
    ),
]
Area = Annotated[
    str,
    typer.Option(
        help=f"Area type of the environment; {_listed(AREAS)}.", autocompletion=lambda: AREAS
    ),
]
AnyCountry = Annotated[
    str | None,
    typer.Option(
        help="Country of the environments; default: all.", autocompletion=lambda: [*ENVIRONMENTS]
    ),
]
AnyArea = Annotated[
    str | None,
    typer.Option(help="Area type of the environments; default: all.", autocompletion=lambda: AREAS),
]
RoadFile = Annotated[Path, typer.Argument(help="OpenDRIVE file (.xodr, .xodr.gz, .xodr.bz2).")]
Environment = Annotated[
    Path, typer.Argument(metavar="OUT", help="Folder of a build, or a stage file.")
]
StageFile = Annotated[Path, typer.Argument(help="Composed stage, OUT/stage.usda.")]
ExecutorName = Annotated[
    str,
    typer.Option(
        "--executor",
        help="Who works: 'local' processes, the cluster of 'ray', or Slurm by 'submitit'.",
    ),
]
Address = Annotated[
    str,
    typer.Option(
        "--address", help="Of the Ray cluster; of submitit slurm, local or debug; auto finds one."
    ),
]
Strict = Annotated[
    bool, typer.Option("--strict", help="Make every issue an error, with exit code 2.")
]
Seed = Annotated[int, typer.Option(help="Random seed; the same seed gives the same output.")]
Tolerance = Annotated[
    float,
    typer.Option(
        min=TOLERANCES[0],
        max=TOLERANCES[1],
        help="Largest distance between road curves and their mesh, metres.",
    ),
]
Landuse = Annotated[
    str, typer.Option(help="Landuse by 'rules', by 'network', or from a GeoTIFF of class values.")
]
LanduseNetwork = Annotated[
    Path | None, typer.Option(help="Weights for --landuse network; default: the shipped weights.")
]
Heightmap = Annotated[
    Path | None, typer.Option(help="GeoTIFF of ground heights, metres; replaces generated terrain.")
]
TerrainNetwork = Annotated[
    Path | None,
    typer.Option(help="Weights of a network that generates the terrain, or `shipped`."),
]
GivenCity = Annotated[
    Path | None,
    typer.Option(help="CityGML or CityJSON file whose buildings replace generated buildings."),
]
CityOffset = Annotated[
    str,
    typer.Option(
        metavar="X,Y[,Z]",
        help="Metres to the east and north by which --city is moved; with Z, also upwards, and "
        "its heights stay as they are.",
    ),
]
Environments = Annotated[
    Path | None, typer.Option(help="Folder of environment files; default: those of the library.")
]
Library = Annotated[
    Path | None, typer.Option(help="Folder of the asset library; default: the shipped library.")
]
OwnLibrary = Annotated[
    Path,
    typer.Option(
        "--library", help="Folder of your asset library; 'envgen-usd library new' makes one."
    ),
]
Weighted = Annotated[
    float | None, typer.Option(min=0.0, help="Weight in the environment of --environment.")
]
EnvironmentFile = Annotated[
    Path | None, typer.Option(help="File of the environment, .toml, that gets the weight.")
]


def check_weight(weight: float | None, environment: Path | None) -> None:
    """Checks that a weight and an environment are given together.

    Raises:
        EnvgenError: One of them is missing, or the environment does not exist.
    """
    if (weight is None) != (environment is None):
        raise EnvgenError("--weight and --environment FILE belong together")
    if environment is not None:
        check_input_file(environment, "name the .toml of an environment", "--environment")


def numbers(text: str, option: str) -> tuple[float, ...]:
    """Returns the numbers of an option, separated by commas.

    Raises:
        EnvgenError: A part of the text is not a number.
    """
    try:
        return tuple(float(part) for part in text.split(",")) if text else ()
    except ValueError as error:
        raise EnvgenError(f"{option} {text}: give numbers separated by commas") from error
