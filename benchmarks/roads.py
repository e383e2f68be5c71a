"""Times reading an OpenDRIVE file and turning it into lane surfaces, as whole processes.

Run ``python benchmarks/roads.py [FILE ...]``; without files those of the corpus are taken that the
field compares itself on, or the project's own where there is no corpus ($ENVGEN_SHARED or
../shared). Every figure is the median of several runs, beside the median of ``lxml.etree.parse`` of
the same file in a process of its own, measured in turn.
"""

import os
import statistics
import subprocess
import sys
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
LANES = """
import sys
from pathlib import Path
from envgen_usd.opendrive.lane_surfaces import lane_surfaces
from envgen_usd.opendrive.reader import read_network
lane_surfaces(read_network(Path(sys.argv[1])), 0.02)
"""
SURFACE = """
import sys
from pathlib import Path
from envgen_usd.opendrive.reader import read_network
from envgen_usd.opendrive.surface import build_surface
build_surface(read_network(Path(sys.argv[1])), 0.02)
"""
STEPS = {"lxml": PARSE, "lanes": LANES + REPORT, "surface": SURFACE + REPORT}


def run(program: str, path: Path) -> tuple[float, float]:
    """CPU seconds and peak memory in MB of a process."""
    command = [sys.executable, "-c", program, str(path)]
    result = subprocess.run(command, capture_output=True, text=True, check=True)
    seconds, memory = result.stdout.split()
    return float(seconds), float(memory)


def main(paths: list[Path]) -> None:
    """Prints a table."""
    print(f"median of {RUNS} processes, CPU seconds; ratio to lxml.etree.parse; peak MB")
    for path in paths:
        found: dict[str, list[tuple[float, float]]] = {step: [] for step in STEPS}
        for _ in range(RUNS):
            for step, program in STEPS.items():
                found[step].append(run(program, path))
        seconds = {step: statistics.median(s for s, _ in runs) for step, runs in found.items()}
        memory = {step: max(m for _, m in runs) for step, runs in found.items()}
        print(path.name)
        for step in STEPS:
            ratio = seconds[step] / seconds["lxml"]
            print(f"  {step:8} {seconds[step]:6.2f} s  x{ratio:5.1f}  {memory[step]:5.0f} MB")


if __name__ == "__main__":
    given = [Path(name) for name in sys.argv[1:]]
    corpus = [CORPUS / f"{name}.xodr" for name in NAMES]
    own = sorted((ROOT / "asset_library" / "roads").glob("*.xodr"))
    main(given or [path for path in corpus if path.exists()] or own)
