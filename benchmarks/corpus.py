"""Builds each road file of a folder and renders a frame of it, without anybody watching.

    python benchmarks/corpus.py ../shared/corpus --minutes 60 --out corpus.md

Each file ends as built, built with issues, or refused with a line for the user; anything else is a
failure. The smallest files come first, so that a short run sees many. The table names for each file
its chunks, processor seconds, peak memory and, if it was refused, the reason.
"""

import argparse
import json
import os
import resource
import shutil
import sys
import tempfile
import time
import traceback
from collections import Counter
from pathlib import Path

from envgen_usd.errors import EnvgenError, Severity
from envgen_usd.recipe.build_options import BuildOptions
from envgen_usd.recipe.environment_build import build
from envgen_usd.render.frames.frame_export import render_frames

RIG = "[camera]\nwidth = 176\nheight = 47\nfx = 69.0\nfy = 69.0\ncx = 87.5\ncy = 23.0\n"
GOOD = ("built", "built with issues", "refused")
HEADER = ("file", "kB", "outcome", "chunks", "CPU s", "peak MB", "issues", "reason")


def outcome(road: Path, folder: Path, limit: int) -> dict[str, object]:
    """Builds and renders a file in a process of its own."""
    report = folder / "report.json"
    process = os.fork()
    if process == 0:
        resource.setrlimit(resource.RLIMIT_CPU, (limit, limit + 5))
        _write(report, road, folder)
        os._exit(0)
    _, status, usage = os.wait4(process, 0)
    row: dict[str, object] = {"outcome": f"ended by signal {status & 127}"}
    if report.exists():
        row = json.loads(report.read_text("utf-8"))
    seconds = round(usage.ru_utime + usage.ru_stime, 1)
    return row | {"CPU s": seconds, "peak MB": usage.ru_maxrss >> 10}


def _write(report: Path, road: Path, folder: Path) -> None:
    """Writes what became of a file, in the new process."""
    silent = os.open(os.devnull, os.O_WRONLY)
    os.dup2(silent, 2)
    row: dict[str, object]
    try:
        row = _built(road, folder)
    except EnvgenError as error:
        named = str(road) in str(error)  # a fault of the installation is no reason
        reason = str(error).replace(f"{road}: ", "")
        row = {"outcome": "refused" if named else "failed", "reason": reason}
    except BaseException as error:
        traceback.print_exc()
        row = {"outcome": "failed", "reason": f"{type(error).__name__}: {error}"}
    report.write_text(json.dumps(row), "utf-8")


def _built(road: Path, folder: Path) -> dict[str, object]:
    result = build(BuildOptions(road, "1", "residential", folder / "town", workers=1))
    rig = folder / "rig.toml"
    rig.write_text(RIG)
    frames = render_frames(result.stage, folder / "frames", 1, rig=str(rig), cache=False)
    images = [*(folder / "frames").glob("rgb/*.png")]
    if len(images) != 1:
        raise ValueError(f"{len(images)} images")
    issues = [*result.issues, *frames.issues]
    grave = [issue for issue in issues if issue.severity != Severity.INFO]
    kinds = Counter(issue.kind for issue in grave)
    return {
        "outcome": "built with issues" if grave else "built",
        "chunks": result.built,
        "issues": len(grave),
        "reason": ", ".join(kind for kind, _ in kinds.most_common(3)),
    }


def main() -> None:
    """Prints a row for each file, and writes the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n", maxsplit=1)[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--minutes", type=float, default=60.0, help="no file begins after them")
    parser.add_argument("--largest", type=float, default=1e9, help="largest file, kB")
    parser.add_argument("--limit", type=int, default=1800, help="CPU seconds of a file")
    parser.add_argument("--out", type=Path, help="file for the table, Markdown")
    options = parser.parse_args()
    roads = sorted(options.folder.rglob("*.xodr"), key=lambda path: (path.stat().st_size, path))
    end = time.monotonic() + 60.0 * options.minutes
    rows = []
    for road in roads:
        size = road.stat().st_size / 1000
        if time.monotonic() > end or size > options.largest:
            break
        folder = Path(tempfile.mkdtemp(prefix="envgen-corpus-"))
        row = outcome(road.absolute(), folder, options.limit)
        shutil.rmtree(folder)
        name = road.relative_to(options.folder).as_posix()
        rows.append(row | {"file": name, "kB": round(size, 1)})
        print(" ".join(str(rows[-1].get(key, "")) for key in HEADER), flush=True)
    counts = Counter(str(row["outcome"]) for row in rows)
    summary = ", ".join(f"{number} {kind}" for kind, number in counts.most_common())
    print(f"{len(rows)} of {len(roads)} files: {summary}")
    if options.out:
        lines = ["| " + " | ".join(HEADER) + " |", "|" + "---|" * len(HEADER)]
        lines += ["| " + " | ".join(str(row.get(key, "")) for key in HEADER) + " |" for row in rows]
        options.out.write_text("\n".join([*lines, "", summary, ""]), "utf-8")
    sys.exit(any(kind not in GOOD for kind in counts))


if __name__ == "__main__":
    main()
