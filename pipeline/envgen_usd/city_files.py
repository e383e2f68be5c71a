"""The city models of an environment, and what is wrong with them."""

from pathlib import Path

from envgen_usd.chunks import CITY_FILE
from envgen_usd.citygml.references import reference_issues
from envgen_usd.citygml.validate import geometry_issues, schema_issues
from envgen_usd.cityjson.read import read_cityjson
from envgen_usd.errors import EnvgenError, Issue
from envgen_usd.geometry.iso19107.report import city_issues


def city_files(target: Path) -> list[Path]:
    """Returns the files of an environment, its index last, or the file that was named.

    Raises:
        EnvgenError: There is none.
    """
    if not target.exists():
        raise EnvgenError(f"{target}: is not there; name an environment or a file")
    if not target.is_dir():
        return [target]
    files = [*sorted(target.glob(f"chunks/*/{CITY_FILE}")), target / CITY_FILE]
    found = [file for file in files if file.exists()]
    if not found:
        raise EnvgenError(f"{target}: holds no chunks/*/{CITY_FILE}; name an environment or a file")
    return found


def file_issues(
    path: Path, schema_folder: Path | None = None, *, schema: bool = True
) -> tuple[Issue, ...]:
    """Returns what is wrong with a city model; CityJSON has no schema here.

    Args:
        path: CityGML, or CityJSON where it ends in ``.json`` or ``.jsonl``.
        schema_folder: Holds the schemas of CityGML; none: they are fetched once and kept.
        schema: False to check geometry and references only.

    Raises:
        EnvgenError: The file cannot be read, is no city model, or there are no schemas.
    """
    if path.suffix.lower() in (".json", ".jsonl"):
        city = read_cityjson(path)
        return (*city.issues, *city_issues(city))
    misfits = schema_issues(path, schema_folder) if schema else ()
    return (*misfits, *geometry_issues(path), *reference_issues(path))
