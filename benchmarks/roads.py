"""Times reading an OpenDRIVE file and turning it into a surface, as whole processes.

Run ``python benchmarks/roads.py [FILE ...]``; without files those of the corpus are taken that the
field compares itself on, or the project's own where there is no corpus ($ENVGEN_SHARED or
../shared). Every figure is the median of several runs, beside the median of ``lxml.etree.parse`` of
the same file in a process of its own, measured in turn. The step ``strips`` ends where every lane
is evaluated and nothing is joined yet, which is as far as the lane meshes of other tools go. The
last lines say what twice the length of a road of arcs costs.
"""

import math
import os
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
CORPUS = Path(os.environ.get("ENVGEN_SHARED", ROOT.parent / "shared")) / "corpus"
NAMES = (
    "esmini/fabriksgatan",
    "carla_test/Town01",
    "scenic/Town04_0910",
    "malidrive/LongRoad",
)
RUNS = 5
REPORT = """
import resource, time
print(time.process_time(), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
"""
PARSE = "import sys; from lxml import etree; etree.parse(sys.argv[1])" + REPORT
STRIPS = """
import sys
from pathlib import Path
from envgen_usd.opendrive.geometry.section_grids import section_grids
from envgen_usd.opendrive.reader import read_network
from envgen_usd.opendrive.strips.lane_strips import lane_strips
for road in read_network(Path(sys.argv[1])).roads.values():
    for grid in section_grids(road, 0.02):
        list(lane_strips(grid))
"""
SURFACE = """
import sys
from pathlib import Path
from envgen_usd.opendrive.reader import read_network
from envgen_usd.opendrive.surface import build_surface
build_surface(read_network(Path(sys.argv[1])), 0.02)
"""
STEPS = {"lxml": PARSE, "strips": STRIPS + REPORT, "surface": SURFACE + REPORT}


def run(program: str, path: Path) -> tuple[float, float]:
    """CPU seconds and peak memory in MB of a process."""
    command = [sys.executable, "-c", program, str(path)]
    result = subprocess.run(command, capture_output=True, text=True, check=True)
    seconds, memory = result.stdout.split()
    return float(seconds), float(memory)


def measure(paths: Sequence[Path]) -> dict[Path, dict[str, tuple[float, float]]]:
    """Median of the seconds and peak of the memory of each step for each file, taken in turn."""
    found: dict[Path, dict[str, list[tuple[float, float]]]] = {
        path: {step: [] for step in STEPS} for path in paths
    }
    for _ in range(RUNS):
        for path in paths:
            for step, program in STEPS.items():
                found[path][step].append(run(program, path))
    return {
        path: {
            step: (statistics.median(s for s, _ in runs), max(m for _, m in runs))
            for step, runs in steps.items()
        }
        for path, steps in found.items()
    }


def long_road(arcs: int, path: Path) -> Path:
    """Writes a road that winds: arcs of 20 m, left and right in turn, with two lanes."""
    x, y = 20.0 * math.sin(0.2) / 0.2, 20.0 * (1 - math.cos(0.2)) / 0.2
    geometries = "".join(
        f'<geometry s="{20 * k}" x="{k * x!r}" y="{k * y!r}" hdg="{k % 2 * 0.2}" length="20">'
        f'<arc curvature="{-0.01 if k % 2 else 0.01}"/></geometry>'
        for k in range(arcs)
    )
    lane = '<width sOffset="0" a="3.5" b="0" c="0" d="0"/><roadMark sOffset="0" type="broken"/>'
    sides = "".join(
        f'<{side}><lane id="{number}" type="{kind}">{what}</lane></{side}>'
        for side, number, kind, what in (
            ("left", 1, "driving", lane),
            ("center", 0, "none", ""),
            ("right", -1, "driving", lane),
        )
    )
    path.write_text(
        f'<OpenDRIVE><header/><road id="1" length="{20 * arcs}" junction="-1"><planView>'
        f'{geometries}</planView><lanes><laneSection s="0">{sides}</laneSection></lanes></road>'
        "</OpenDRIVE>",
        encoding="utf-8",
    )
    return path


def main(paths: list[Path]) -> None:
    """Prints a table."""
    print(f"median of {RUNS} processes, CPU seconds; ratio to lxml.etree.parse; peak MB")
    for path, steps in measure(paths).items():
        print(path.name)
        for step, (seconds, memory) in steps.items():
            ratio = seconds / steps["lxml"][0]
            print(f"  {step:8} {seconds:6.2f} s  x{ratio:5.1f}  {memory:5.0f} MB")
    with tempfile.TemporaryDirectory() as folder:
        lengths = [long_road(arcs, Path(folder) / f"{arcs}.xodr") for arcs in (250, 500, 1000)]
        found = measure(lengths)
    print("a road of 5, 10 and 20 km, CPU seconds")
    for step in STEPS:
        print(f"  {step:8}", " ".join(f"{steps[step][0]:6.2f}" for steps in found.values()))


if __name__ == "__main__":
    given = [Path(name) for name in sys.argv[1:]]
    corpus = [CORPUS / f"{name}.xodr" for name in NAMES]
    own = sorted((ROOT / "asset_library" / "roads").glob("*.xodr"))
    main(given or [path for path in corpus if path.exists()] or own)
