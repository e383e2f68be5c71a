"""Reads damaged and hostile files, and reports whatever is no clear refusal.

    python tools/fuzz.py --seconds 60 opendrive citygml stages
    python tools/fuzz.py --seconds 5            # a short round of all targets
    python tools/fuzz.py --again FILE opendrive # a file of an earlier report

Each target (`fuzz_targets.py`) has seeds, which are files of the corpus where it is there, and a
function that reads a file as a command would. Each reading runs in a process of its own, which may
use `CPU` seconds and `MEMORY` bytes more than the begin. Only `EnvgenError` may come out of it, and
nothing may be written outside of the folder of the file.
"""

import argparse
import os
import random
import re
import resource
import shutil
import signal
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Callable
from pathlib import Path

from fuzz_changes import changed
from fuzz_targets import TARGETS, Target

from envgen_usd.errors import EnvgenError

CPU = 10
"""Seconds of processor time for a file; a larger value forgives slower files."""
MEMORY = 2 << 30
"""Bytes for a file, beyond what all imports take."""
_WALL = 120.0
"""Seconds after which a process that waits, and does not compute, counts as hanging."""
_REFUSED, _RAISED, _WROTE = 10, 11, 12
"""Exit codes of a reading; 0 for a file that was read."""


def main() -> None:
    """Prints a line for each finding and a table; exit code 1 with findings.

    An interrupt ends the round; its line says how far it came.
    """
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n", maxsplit=1)[0])
    parser.add_argument("targets", nargs="*", metavar="TARGET", help=", ".join(TARGETS))
    parser.add_argument("--seconds", type=float, default=10.0, help="of processor time each")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--shared", type=Path, help="folder of the corpus, else $ENVGEN_SHARED")
    parser.add_argument("--findings", type=Path, default=Path("fuzz_findings"))
    parser.add_argument("--again", type=Path, help="read this file alone")
    options = parser.parse_args()
    unknown = [name for name in options.targets if name not in TARGETS]
    if unknown:
        parser.error(f"unknown {', '.join(unknown)}; targets: {', '.join(TARGETS)}")
    shared = options.shared or Path(os.environ.get("ENVGEN_SHARED", "../shared"))
    bad = 0
    for name in options.targets or TARGETS:
        target, results, begin = TARGETS[name](shared), Counter[str](), _spent()
        try:
            if options.again:
                results[_again(target, options.again)] += 1
            else:
                _round(name, target, options, results)
        except KeyboardInterrupt:
            options.seconds = 0.0
        bad += results.total() - results["read"] - results["refused"]
        took = _spent() - begin
        print(f"{name:12} {results.total():6} files in {took:.0f} s: {dict(results)}", flush=True)
        if not options.seconds:
            sys.exit(130)
    sys.exit(bool(bad))


def _round(name: str, target: Target, options: argparse.Namespace, results: Counter[str]) -> None:
    """Reads changed seeds for some seconds, and counts what became of them."""
    said: set[str] = set()
    end, number = _spent() + options.seconds, 0
    with tempfile.TemporaryDirectory(prefix="envgen-fuzz-") as folder:
        while _spent() < end:
            rng = random.Random(f"{options.seed} {name} {number}")
            seed = rng.choice(target.seeds)
            place = Path(folder) / "in"
            shutil.rmtree(place, ignore_errors=True)
            place.mkdir()
            path = place / seed.name
            if seed.is_dir():
                shutil.copytree(seed, path)
                _change_one(path, rng)
            else:
                path.write_bytes(changed(seed.read_bytes(), rng))
            result = _reported(target, path, Path(folder), said)
            results[result] += 1
            if result not in {"read", "refused"} and result not in said:
                said.add(result)
                said.add(result.partition(" ")[2])
                options.findings.mkdir(exist_ok=True)
                kept = options.findings / f"{name}_{options.seed}_{number}_{seed.name}"
                shutil.move(path, kept)
                print(f"  {kept}: {result}", flush=True)
            number += 1


def _again(target: Target, path: Path) -> str:
    """Reads a copy of a file or folder that was kept."""
    with tempfile.TemporaryDirectory(prefix="envgen-fuzz-") as folder:
        place = Path(folder) / "in"
        place.mkdir()
        copied = place / path.name
        if path.is_dir():
            shutil.copytree(path, copied, symlinks=True)
        else:
            shutil.copy(path, copied)
        return _reported(target, copied, Path(folder))


def _spent() -> float:
    """Seconds of processor time so far, here and in readings: what else runs shortens no round."""
    return sum(os.times()[:4])


def _change_one(folder: Path, rng: random.Random) -> None:
    """Changes, removes or links a file of a folder."""
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    path = rng.choice(files)
    chance = rng.random()
    if chance < 0.1:
        path.unlink()
    elif chance < 0.2:
        path.unlink()
        path.symlink_to(rng.choice(["/etc/passwd", "/dev/zero", "..", path.name, str(files[0])]))
    else:
        path.write_bytes(changed(path.read_bytes(), rng))


def _reported(target: Target, path: Path, folder: Path, said: set[str] | None = None) -> str:
    """Reads a file in a new process, and prints a traceback that is new."""
    before = _listing(folder)
    with tempfile.TemporaryFile("w+") as report:
        process = os.fork()
        if process == 0:
            _child(target.read, path, report.fileno())
        result = _waited(process)
        report.seek(0)
        text = report.read()
    if result in {"read", "refused"}:
        outside = sorted(_listing(folder) - before)
        if outside:
            return f"wrote {outside[0]}"
        return result
    place = _place(text)
    if said is None or place not in said:
        print(text, file=sys.stderr, flush=True)
    return f"{result} {place}".rstrip()


def _place(text: str) -> str:
    """Kind of an exception, and the deepest line of the package that it left."""
    lines = re.findall(r'envgen_usd/(\S+\.py)", line (\d+)', text)
    kind = text.rstrip().rpartition("\n")[2].partition(":")[0] if lines else ""
    return f"{kind} {':'.join(lines[-1])}" if lines else ""


def _listing(folder: Path) -> set[str]:
    """Files beside the folder of the input, in which alone a reading may write."""
    return {path.name for path in folder.iterdir()}


def _child(read: Callable[[Path], object], path: Path, report: int) -> None:
    code = 0
    try:
        used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (used + MEMORY, used + MEMORY))
        spent = sum(resource.getrusage(resource.RUSAGE_SELF)[:2])
        resource.setrlimit(resource.RLIMIT_CPU, (int(spent) + CPU, int(spent) + CPU + 2))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        silent = os.open(os.devnull, os.O_WRONLY)
        os.dup2(silent, 1)
        os.dup2(silent, 2)
        os.chdir(path.parent)
        read(path)
    except EnvgenError as error:
        code = _REFUSED
        if "\n" in str(error) and not str(error).startswith("render"):
            os.write(report, f"an error of several lines: {error}".encode())
            code = _RAISED
    except BaseException:
        os.write(report, traceback.format_exc().encode())
        code = _RAISED
    os._exit(code)


def _waited(process: int) -> str:
    """What became of a process."""
    end = time.monotonic() + _WALL
    while True:
        done, status = os.waitpid(process, os.WNOHANG)
        if done:
            break
        if time.monotonic() > end:
            os.kill(process, signal.SIGKILL)
            os.waitpid(process, 0)
            return "hangs"
        time.sleep(0.002)
    if os.WIFSIGNALED(status):
        number = os.WTERMSIG(status)
        slow = number in {signal.SIGXCPU, signal.SIGKILL}
        return f"takes more than {CPU} s" if slow else f"killed by {signal.Signals(number).name}"
    code = os.WEXITSTATUS(status)
    return {0: "read", _REFUSED: "refused", _RAISED: "raised", _WROTE: "wrote"}.get(
        code, f"exit code {code}"
    )


if __name__ == "__main__":
    main()
