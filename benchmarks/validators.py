"""Counts the findings of OpenUSD's and NVIDIA's validators on all that is shipped and built.

    python benchmarks/validators.py [library] [environments]

Validates every combination of variants of every asset of the library, and all environments
on a street of 60 m; an argument chooses one of both. The exit code is 1 where a validator reports
anything.
"""

import argparse
import sys
import tempfile
import time
import warnings
from collections import Counter
from collections.abc import Iterator
from itertools import product
from pathlib import Path

import usd_validation_nvidia as nvidia
from pxr import Usd, UsdValidation

from envgen_usd.assets.asset_catalogue import read_catalogue
from envgen_usd.environment_files import known_environments
from envgen_usd.recipe.build_options import BuildOptions, demo_road
from envgen_usd.recipe.environment_build import build

OPENUSD_RULES = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
OPENUSD = UsdValidation.ValidationContext(OPENUSD_RULES)
# A stage has thousands of prims with variants; those of assets are validated one by one.
NVIDIA = nvidia.ValidationEngine(variants=False)
PARTS = ("library", "environments")


def findings(stage: Usd.Stage) -> Iterator[str]:
    """Names of the rules that a stage breaks, with the variants that it selects."""
    for error in OPENUSD.Validate(stage):
        yield f"OpenUSD {error.GetName()}"
    for issue in NVIDIA.validate(stage).issues():
        yield f"NVIDIA {issue.rule.__name__ if issue.rule else issue.message}"


def combinations() -> Iterator[tuple[str, Usd.Stage]]:
    """Each asset with each combination of its variants."""
    catalogue = read_catalogue()
    for asset in catalogue.assets.values():
        stage = Usd.Stage.Open(str(catalogue.folder / asset.path))
        stage.SetEditTarget(stage.GetSessionLayer())
        for chosen in product(*asset.variants.values()):
            for name, variant in zip(asset.variants, chosen, strict=True):
                stage.GetDefaultPrim().GetVariantSet(name).SetVariantSelection(variant)
            yield asset.name, stage


def environments(folder: Path) -> Iterator[tuple[str, Usd.Stage]]:
    """A street in each environment."""
    road = folder / "street.xodr"
    road.write_text(demo_road("straight").read_text().replace('length="400"', 'length="60"'))
    for country, areas in known_environments().items():
        for area in areas:
            name = f"{country}/{area}"
            result = build(BuildOptions(road, country, area, folder / country / area))
            yield name, Usd.Stage.Open(str(result.stage))


def size(stage: Usd.Stage) -> int:
    """Number of prims, those of instances counted each time."""
    return sum(1 for _ in Usd.PrimRange.Stage(stage, Usd.TraverseInstanceProxies()))


def main() -> int:
    """Prints the counts of both parts."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("parts", nargs="*", choices=[[], *PARTS], help="default: both")
    chosen = parser.parse_args().parts or PARTS
    warnings.simplefilter("ignore")
    print(f"rules: {len(OPENUSD_RULES)} of OpenUSD, {len(NVIDIA.rules)} of NVIDIA")
    total: Counter[tuple[str, str]] = Counter()
    with tempfile.TemporaryDirectory() as folder:
        stages = {"library": combinations(), "environments": environments(Path(folder))}
        for title in chosen:
            start, count = time.perf_counter(), 0
            for name, stage in stages[title]:
                began = time.perf_counter()
                found = Counter((name, rule) for rule in findings(stage))
                total.update(found)
                count += 1
                for (_, rule), times in sorted(found.items()):
                    print(f"  {name}: {rule}: {times}", flush=True)
                if title == "environments":
                    seconds = time.perf_counter() - began
                    print(f"  {name}: {size(stage)} prims in {seconds:.0f} s", flush=True)
            print(f"{title}: {count} stages in {time.perf_counter() - start:.0f} s", flush=True)
    for (name, rule), times in sorted(total.items()):
        print(f"{name}: {rule}: {times}")
    print(f"findings: {total.total()}")
    return 1 if total else 0


if __name__ == "__main__":
    sys.exit(main())
