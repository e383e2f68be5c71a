"""The city models of an environment, and their validation."""

from pathlib import Path

from envgen_usd.chunks import CITY_FILE
from envgen_usd.citygml.city_validation import geometry_issues, schema_issues
from envgen_usd.citygml.feature_references import reference_issues
from envgen_usd.cityjson.cityjson_validation import cityjson_issues
from envgen_usd.compressed_files import content_suffix
from envgen_usd.errors import EnvgenError, Issue


def city_files(target: Path) -> list[Path]:
    """Returns the city models of an environment with the index last, or the named file.

    Raises:
        EnvgenError: There is no city model.
    """
    if not target.exists():
        raise EnvgenError(f"{target}: does not exist; name an environment or a file")
    if not target.is_dir():
        return [target]
    files = [*sorted(target.glob(f"chunks/*/{CITY_FILE}")), target / CITY_FILE]
    existing = [file for file in files if file.exists()]
    if not existing:
        raise EnvgenError(f"{target}: holds no chunks/*/{CITY_FILE}; name an environment or a file")
    return existing


def file_issues(
    path: Path, schema_folder: Path | None = None, *, schema: bool = True
) -> tuple[Issue, ...]:
    """Validates a city model; CityJSON files are checked without a schema.

    Args:
        path: CityGML, or CityJSON where it ends in ``.json`` or ``.jsonl``.
        schema_folder: Folder of the CityGML schemas; `None` means that they are downloaded once and
            kept.
        schema: False to check geometry and references only.

    Raises:
        EnvgenError: The file cannot be read or is not a city model, or the schemas are missing.
    """
    if content_suffix(path) in (".json", ".jsonl"):
        return cityjson_issues(path)
    misfits = schema_issues(path, schema_folder) if schema else ()
    return (*misfits, *geometry_issues(path), *reference_issues(path))
