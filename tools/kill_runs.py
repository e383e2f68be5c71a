"""Kills commands at random moments, repeats them, and compares with a run that nobody disturbed.

    python tools/kill_runs.py --moments 30 --work /tmp/kills build dataset traffic train

Each round starts a command in a new folder, ends all its processes with SIGKILL at a random moment
of the time that it takes, and gives the same command again. Then

1. all files have the bytes of an undisturbed run, but for times (``seconds`` of the manifest and
   the report),
2. no part of a file is left (the cache of `render` removes such parts when they are old), and
3. what was finished at the moment of the kill (chunks, frames, training samples) was not written
   again.

Commands take turns, so that a run which is stopped early has rounds of all of them.
"""

import argparse
import hashlib
import json
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from envgen_usd.recipe.build_options import demo_road
from envgen_usd.whole_files import PART_PREFIX

ROOM = ["--country", "1", "--area", "residential"]
RIG = "[camera]\nwidth = 96\nheight = 64\nfx = 60.0\nfy = 60.0\ncx = 47.5\ncy = 31.5\n"
RECIPE = """
frames = 3
weathers = ["clear"]
rigs = ["rig.toml"]
[[road]]
file = "street.xodr"
[[environment]]
country = "1"
area = "residential"
"""
STEPS = 40
"""Steps of the trace of traffic, tenths of a second."""
_SECONDS = re.compile(rb'"seconds": \{[^}]*\}')
_TIMES = re.compile(rb"<h2>Time</h2>.*?<h2>Warnings", re.DOTALL)
Finished = Callable[[Path], Sequence[Path]]


@dataclass(frozen=True)
class Case:
    """A command that is killed.

    Attributes:
        command: Arguments of the program; they name files of the folder in which it runs.
        out: Folder of its products.
        finished: Files in that folder that no second run may write again.
        inputs: Folders that are copied into each new folder, by name.
    """

    command: Sequence[str]
    out: str
    finished: Finished
    inputs: Mapping[str, Path]


@dataclass(frozen=True)
class Round:
    """What a kill and the repeated command gave.

    Attributes:
        moment: Seconds from the start to the kill.
        finished: Number of finished files at the kill.
        again: Those that the repeated command wrote again.
        differ: Files with other bytes than those of the undisturbed run, missing, or too many.
        code: Exit code of the repeated command.
    """

    moment: float
    finished: int
    again: tuple[str, ...]
    differ: tuple[str, ...]
    code: int

    @property
    def is_good(self) -> bool:
        """True if nothing was lost and nothing was done twice."""
        return not self.again and not self.differ and self.code == 0


def prepare(work: Path, only: Sequence[str]) -> dict[str, Case]:
    """Writes the inputs of the cases; a town for traffic and for the data set is built once."""
    work.mkdir(parents=True, exist_ok=True)
    road = demo_road("straight").read_text().replace('length="400"', 'length="30"')
    for name, text in (
        ("street.xodr", road),
        ("rig.toml", RIG),
        ("recipe.toml", RECIPE),
        ("fcd.xml", _trace()),
    ):
        (work / name).write_text(text)
    build = ["build", "street.xodr", *ROOM, "--out", "out", "--workers", "2"]
    cases = {
        "build": Case(build, "out", lambda out: [*out.glob("chunks/[!.]*/made.json")], {}),
        "train": Case(
            ["landuse", "train", "--out=out", "--images=420", "--size=64", "--samples=4"],
            "out",
            lambda out: [*out.glob("samples/*.npz")],
            {},
        ),
    }
    if {"traffic", "dataset"} & set(only):
        town = work / "town"
        if not (town / "manifest.json").exists():
            run(work, ["build", "street.xodr", *ROOM, "--out", "town", "--workers", "2"])
        traffic = ["traffic", "out", "--fcd", "fcd.xml"]
        cases["traffic"] = Case(traffic, "out", lambda _: [], {"out": town})
        place = "towns/street_1_residential_0"
        dataset = ["dataset", "recipe.toml", "--out", "out", "--jobs", "1"]
        cases["dataset"] = Case(dataset, "out", _frames, {f"out/{place}": town})
    return {name: cases[name] for name in only}


def _trace() -> str:
    """Floating car data of a car along the street."""
    steps = (
        f'<timestep time="{step / 10:.1f}"><vehicle id="car" x="{5 + step / 4:.1f}" y="-1.75" '
        'angle="90" type="car" speed="2.5"/></timestep>'
        for step in range(STEPS)
    )
    return f"<fcd-export>{''.join(steps)}</fcd-export>"


def _frames(out: Path) -> Sequence[Path]:
    """Images of frames of which all are there."""
    takes = [path.parent for path in out.rglob("frames/**/depth")]
    whole: list[Path] = []
    for take in takes:
        kinds = [path for path in take.iterdir() if path.is_dir()]
        for depth in (take / "depth").glob("[0-9]*.tif"):
            images = [file for kind in kinds for file in kind.glob(f"{depth.stem}.*")]
            whole += images if len(images) == len(kinds) else []
    return whole


def start(folder: Path, command: Sequence[str]) -> subprocess.Popen[bytes]:
    """Starts the program in a process group of its own, with a cache of its own."""
    environment = os.environ | {"ENVGEN_USD_CACHE": str(folder / "cache"), "OMP_NUM_THREADS": "1"}
    with (folder / "said.txt").open("ab") as said:
        return subprocess.Popen(
            [sys.executable, "-m", "envgen_usd", *command],
            cwd=folder,
            env=environment,
            stdout=said,
            stderr=said,
            start_new_session=True,
        )


def run(folder: Path, command: Sequence[str]) -> int:
    """Runs the program to its end; returns its exit code."""
    return start(folder, command).wait()


def new_folder(work: Path, name: str, case: Case) -> Path:
    """A folder with the inputs of a case, as copies."""
    folder = work / name
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    for path in work.iterdir():
        if path.is_file():
            shutil.copy2(path, folder / path.name)
    for place, source in case.inputs.items():
        shutil.copytree(source, folder / place)
    return folder


def digests(out: Path) -> dict[str, str]:
    """SHA-256 of all files by their path; without times."""
    found = {}
    for path in sorted(each for each in out.rglob("*") if each.is_file()):
        content = path.read_bytes()
        if path.name == "manifest.json":
            content = _SECONDS.sub(b"", content)
        if path.name == "report.html":
            content = _TIMES.sub(b"", content)
        found[path.relative_to(out).as_posix()] = hashlib.sha256(content).hexdigest()
    return found


def states(paths: Sequence[Path], out: Path) -> dict[str, tuple[int, int]]:
    """What changes when a file is written again."""
    facts = {path.relative_to(out).as_posix(): path.stat() for path in paths}
    return {name: (stat.st_ino, stat.st_mtime_ns) for name, stat in facts.items()}


def kill(folder: Path, case: Case, seconds: float) -> bool:
    """Starts the command and kills its processes after a time; False if it had ended before."""
    process = start(folder, case.command)
    try:
        process.wait(timeout=seconds)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        return True
    return False


def disturbed(
    work: Path, case: Case, seconds: float, truth: Mapping[str, str], rng: random.Random
) -> Round:
    """A round: the command is killed, and given again."""
    longest = seconds
    while True:
        folder = new_folder(work, "round", case)
        moment = rng.uniform(0.0, longest)
        if kill(folder, case, moment):
            break
        longest = moment
    out = folder / case.out
    before = states(case.finished(out), out)
    code = run(folder, case.command)
    after = digests(out)
    now = states([out / name for name in before if (out / name).exists()], out)
    again = tuple(name for name, state in before.items() if now.get(name) != state)
    differ = [name for name in sorted({*truth, *after}) if truth.get(name) != after.get(name)]
    parts = [str(path) for path in out.rglob(f"{PART_PREFIX}*")]
    return Round(moment, len(before), again, (*differ, *parts), code)


def main() -> None:
    """Prints a line for each round, and the sums."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n", maxsplit=1)[0])
    parser.add_argument("cases", nargs="+", choices=("build", "dataset", "traffic", "train"))
    parser.add_argument("--moments", type=int, default=30)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--work", type=Path, required=True, help="folder for all runs")
    options = parser.parse_args()
    work = options.work.absolute()
    cases = prepare(work, options.cases)
    truths, times = {}, {}
    for name, case in cases.items():
        folder = new_folder(work, f"whole_{name}", case)
        begin = time.monotonic()
        if run(folder, case.command):
            sys.exit(f"{name}: the undisturbed run failed, see {folder / 'said.txt'}")
        times[name] = time.monotonic() - begin
        truths[name] = digests(folder / case.out)
        print(f"{name}: {len(truths[name])} files in {times[name]:.0f} s", flush=True)
    rounds: dict[str, list[Round]] = {name: [] for name in cases}
    for number in range(options.moments):
        for name, case in cases.items():
            rng = random.Random(f"{options.seed} {name} {number}")
            each = disturbed(work, case, times[name], truths[name], rng)
            rounds[name].append(each)
            faults = {"again": each.again[:3], "differ": each.differ[:3], "code": each.code}
            said = "" if each.is_good else f" BAD {json.dumps(faults)}"
            print(
                f"{number:3} {name:8} {each.moment:6.1f} s {each.finished:4} kept{said}", flush=True
            )
            if not each.is_good:
                shutil.move(work / "round", work / f"bad_{name}_{number}")
    for name, results in rounds.items():
        good = sum(each.is_good for each in results)
        kept = sum(each.finished for each in results)
        print(f"{name}: {good} of {len(results)} rounds good; {kept} finished files kept")
    sys.exit(any(not each.is_good for results in rounds.values() for each in results))


if __name__ == "__main__":
    main()
