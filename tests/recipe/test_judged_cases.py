"""The cases of val3dity in CityJSON and in CityGML get the code that val3dity gives them."""

import csv
import os
from pathlib import Path

import pytest

from envgen_usd.recipe.city_files import file_issues

SHARED = os.environ.get("ENVGEN_SHARED", Path(__file__).resolve().parents[3] / "shared")
CASES = Path(SHARED) / "judges/val3dity/cases"
# Code 304 was joined with 303 in val3dity 2. Holes of this case also run as their outer ring.
RENAMED = {"304_1.poly": "303", "304_2.obj": "303", "207_2.poly": "208"}


def expected():
    table = CASES / "expected.tsv"
    if not table.is_file():
        return []
    with table.open() as lines:
        return [(row["case"], row["expected"]) for row in csv.DictReader(lines, delimiter="\t")]


@pytest.mark.parametrize("suffix", ["json", "gml"])
@pytest.mark.parametrize(("case", "code"), expected())
def test_the_first_code_is_that_of_val3dity(case, code, suffix):
    issues = file_issues(CASES / f"{case}.{suffix}", schema=False)

    first = issues[0].kind if issues else "valid"
    assert first.removeprefix("iso19107.") == RENAMED.get(case, code)
