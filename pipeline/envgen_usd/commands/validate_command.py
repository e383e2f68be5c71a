"""The command `validate`."""

from pathlib import Path
from typing import Annotated

import typer


def validate(
    target: Annotated[
        Path, typer.Argument(help="Folder of an environment, or a CityGML or CityJSON file.")
    ],
    *,
    schemas: Annotated[
        Path | None, typer.Option(help="Folder of the CityGML schemas; default: downloaded once.")
    ] = None,
    schema: Annotated[bool, typer.Option(help="Also check against the CityGML schema.")] = True,
) -> None:
    """Checks city models against their schema and ISO 19107; exit code 1 for invalid models."""
    from envgen_usd.idle_options import refuse_idle
    from envgen_usd.recipe.city_files import city_files, file_issues

    if not schema:
        refuse_idle({"--schemas": schemas}, "with --no-schema")
    files = city_files(target)
    findings = 0
    for file in files:
        for issue in file_issues(file, schemas, schema=schema):
            findings += 1
            print(f"{file}: {issue.kind}: {issue.where}: {issue.message}")
    print(f"{len(files)} files, {findings} findings")
    if findings:
        raise typer.Exit(1)
