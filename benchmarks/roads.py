"""Times reading an OpenDRIVE file and turning it into a surface, as whole processes.

Run ``python benchmarks/roads.py [--judge PROGRAM] [FILE ...]``; without files those of the corpus
are taken that the field compares itself on, or the project's own where there is no corpus
($ENVGEN_SHARED or ../shared). Every figure is the least of several runs in user and system CPU
seconds of a process, beside that of ``lxml.etree.parse`` of the same file, measured in turn. The
step ``strips`` ends where every lane is evaluated and nothing is joined yet, which is as far as the
lane meshes of other tools go. The judge is the program ``lanes`` of libOpenDRIVE (also
$ENVGEN_LIBOPENDRIVE): its lane meshes, and its mesh of the whole network. The last lines say what
twice the length of a road of arcs costs.
"""

import argparse
import math
import os
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
    "scenic/Issue295a",
)
RUNS = 5
TOLERANCE = "0.02"
PARSE = "import sys; from lxml import etree; etree.parse(sys.argv[1])"
STRIPS = f"""
import sys
from pathlib import Path
from envgen_usd.opendrive.geometry.section_grids import section_grids
from envgen_usd.opendrive.reader import read_network
from envgen_usd.opendrive.strips.lane_strips import lane_strips
for grid in section_grids(read_network(Path(sys.argv[1])).roads.values(), {TOLERANCE}):
    list(lane_strips(grid))
"""
SURFACE = f"""
import sys
from pathlib import Path
from envgen_usd.opendrive.reader import read_network
from envgen_usd.opendrive.surface import build_surface
build_surface(read_network(Path(sys.argv[1])), {TOLERANCE})
"""
Steps = dict[str, tuple[list[str], list[str]]]
"""Names of steps with the command before and after the file."""


def own_steps() -> Steps:
    """Returns the steps of the product, and that of the parser alone."""
    programs = {"lxml": PARSE, "strips": STRIPS, "surface": SURFACE}
    return {name: ([sys.executable, "-c", text], []) for name, text in programs.items()}


def judge_steps(judge: str) -> Steps:
    """Returns the steps of libOpenDRIVE."""
    kinds = {"lanes": "lanes", "network": "all"}
    return {f"libOpenDRIVE {name}": ([judge], [TOLERANCE, kind]) for name, kind in kinds.items()}


def run(command: list[str]) -> tuple[float, float]:
    """CPU seconds (user and system) and peak memory in MB of a process."""
    with Path(os.devnull).open("w") as nowhere:
        outputs = [(os.POSIX_SPAWN_DUP2, nowhere.fileno(), stream) for stream in (1, 2)]
        process = os.posix_spawn(command[0], command, os.environ, file_actions=outputs)
        _, status, used = os.wait4(process, 0)
    if status:
        raise SystemExit(f"{command[0]} ended with status {status}: {' '.join(command[1:])}")
    return used.ru_utime + used.ru_stime, used.ru_maxrss / 1024


def measure(paths: Sequence[Path], steps: Steps) -> dict[Path, dict[str, tuple[float, float]]]:
    """Least seconds and peak of the memory of each step for each file, taken in turn."""
    found: dict[Path, dict[str, list[tuple[float, float]]]] = {
        path: {step: [] for step in steps} for path in paths
    }
    for _ in range(RUNS):
        for path in paths:
            for step, (before, after) in steps.items():
                found[path][step].append(run([*before, str(path), *after]))
    return {
        path: {
            step: (min(s for s, _ in runs), max(m for _, m in runs)) for step, runs in each.items()
        }
        for path, each in found.items()
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


def main(paths: Sequence[Path], judge: str) -> None:
    """Prints a table."""
    steps = own_steps()
    if judge and Path(judge).exists():
        steps |= judge_steps(judge)
    else:
        print("libOpenDRIVE is left out: give its program lanes by --judge or ENVGEN_LIBOPENDRIVE")
    print(f"least of {RUNS} processes, CPU seconds; ratio to lxml.etree.parse; peak MB")
    for path, figures in measure(paths, steps).items():
        print(path.name)
        for step, (seconds, memory) in figures.items():
            ratio = seconds / figures["lxml"][0]
            print(f"  {step:20} {seconds:6.2f} s  x{ratio:5.1f}  {memory:5.0f} MB")
    with tempfile.TemporaryDirectory() as folder:
        lengths = [long_road(arcs, Path(folder) / f"{arcs}.xodr") for arcs in (250, 500, 1000)]
        found = measure(lengths, steps)
    print("a road of 5, 10 and 20 km, CPU seconds")
    for step in steps:
        print(f"  {step:20}", " ".join(f"{each[step][0]:6.2f}" for each in found.values()))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("files", type=Path, nargs="*")
    parser.add_argument("--judge", default=os.environ.get("ENVGEN_LIBOPENDRIVE", ""))
    given = parser.parse_args()
    corpus = [CORPUS / f"{name}.xodr" for name in NAMES]
    own = sorted((ROOT / "asset_library" / "roads").glob("*.xodr"))
    main(given.files or [path for path in corpus if path.exists()] or own, given.judge)
