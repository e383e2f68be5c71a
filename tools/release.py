"""Makes wheel and source archive of a commit, and tries the wheel where nothing else is installed.

    python tools/release.py --out dist --work .release

Both are made from `git archive`, so that no file outside of the commit gets in. Then

1. the wheel that the source archive gives has the bytes of the wheel that the commit gives,
2. the wheel holds every file that the package needs, and no other (`wheel_files`),
3. an empty virtual environment takes the wheel, with the versions of `constraints.txt`, and
4. in an empty folder, the installed program builds the demo, renders a frame, and verifies it.

It needs the package `build`, and the index that pip is configured for.
"""

import argparse
import filecmp
import os
import shutil
import subprocess
import sys
import tarfile
import time
import venv
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path, PurePosixPath

ROOT = Path(__file__).resolve().parents[1]
HOMES = {
    "pipeline/envgen_usd": "envgen_usd",
    "asset_library": "envgen_usd/asset_library",
    "schemas": "envgen_usd/schemas",
    "renders": "envgen_usd/renders",
}
"""Folder of the repository to its folder in the wheel."""
ONLY_IN_THE_REPOSITORY = ("asset_library/README.md", "renders/gallery/")
"""What these folders hold for readers: beginnings of paths."""
DEMO = (
    ("build", "--demo", "--country", "1", "--area", "residential", "--out", "town"),
    ("render", "town/stage.usda", "--frames", "1"),
    ("verify", "town"),
)
"""Commands that the installed program is tried with."""


def wheel_files(tracked: Sequence[str]) -> dict[str, str]:
    """Paths in the wheel that tracked files of the repository have, to their paths there."""
    return {
        str(PurePosixPath(home, PurePosixPath(path).relative_to(folder))): path
        for path in tracked
        for folder, home in HOMES.items()
        if path.startswith(f"{folder}/") and not path.startswith(ONLY_IN_THE_REPOSITORY)
    }


def main() -> None:
    """Makes a release, or ends with a line that says what is wrong with it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("dist"), help="folder of the archives")
    parser.add_argument("--work", type=Path, default=Path(".release"), help="removed at the start")
    parser.add_argument("--no-install", action="store_true", help="only make and compare")
    options = parser.parse_args()
    work = options.work.absolute()
    shutil.rmtree(work, ignore_errors=True)
    archive, wheel = _made(_source(work / "source"), work)
    _compare(wheel)
    if not options.no_install:
        _try(wheel, work)
    options.out.mkdir(parents=True, exist_ok=True)
    for file in (archive, wheel):
        shutil.copy(file, options.out)
        print(f"{options.out / file.name}: {file.stat().st_size / 1e6:.1f} MB")
    shutil.rmtree(work)


def _source(folder: Path) -> Path:
    """The files of the commit, in a folder of their own."""
    folder.mkdir(parents=True)
    if changed := _git("status", "--porcelain", "--untracked-files=no"):
        print(f"not in the release, as not committed:\n{changed}")
    packed = folder.with_suffix(".tar")
    _git("archive", "--output", str(packed), "HEAD")
    with tarfile.open(packed) as file:
        file.extractall(folder, filter="data")
    return folder


def _made(source: Path, work: Path) -> tuple[Path, Path]:
    """Source archive and wheel; the wheel from the archive equals that from the files."""
    epoch = _git("log", "-1", "--format=%ct")
    build = (sys.executable, "-m", "build", "--outdir")
    variables = {**os.environ, "SOURCE_DATE_EPOCH": epoch}
    _run((*build, str(work / "dist"), str(source)), work, variables)
    # After the first, as it leaves files beside the source, which this one must not take in.
    _run((*build, str(work / "direct"), "--wheel", str(_source(work / "again"))), work, variables)
    (archive,), (wheel,) = (work / "dist").glob("*.tar.gz"), (work / "dist").glob("*.whl")
    if not filecmp.cmp(wheel, work / "direct" / wheel.name, shallow=False):
        sys.exit("the source archive gives another wheel than the commit")
    return archive, wheel


def _compare(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as file:
        packed = {name for name in file.namelist() if ".dist-info/" not in name}
        size = sum(entry.file_size for entry in file.infolist())
    expected = wheel_files(_git("ls-tree", "-r", "--name-only", "HEAD").splitlines())
    missing, others = expected.keys() - packed, packed - expected.keys()
    if missing or others:
        lines = [*(f"missing: {expected[name]}" for name in sorted(missing))]
        sys.exit(
            "\n".join((*lines, *(f"not of the repository: {name}" for name in sorted(others))))
        )
    print(f"wheel: {len(packed)} files, {size / 1e6:.1f} MB unpacked")


def _try(wheel: Path, work: Path) -> None:
    """Installs the wheel into an empty environment and builds the demo in an empty folder."""
    begin, environment, empty = time.monotonic(), work / "environment", work / "empty"
    venv.create(environment, with_pip=True)
    empty.mkdir()
    constraints = ("--constraint", str(ROOT / "constraints.txt"))
    pip = (str(environment / "bin" / "python"), "-m", "pip", "install", "--quiet")
    _run((*pip, *constraints, str(wheel)), empty)
    print(f"installed into an empty environment in {time.monotonic() - begin:.0f} s")
    # Neither the repository nor the cache of an earlier run may help.
    variables = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    variables["ENVGEN_USD_CACHE"] = ""
    for arguments in DEMO:
        begin = time.monotonic()
        _run((str(environment / "bin" / "envgen-usd"), *arguments), empty, variables)
        print(f"envgen-usd {' '.join(arguments)}: {time.monotonic() - begin:.0f} s")


def _git(*arguments: str) -> str:
    command = ("git", "-C", str(ROOT), *arguments)
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()


def _run(command: Sequence[str], folder: Path, variables: Mapping[str, str] | None = None) -> None:
    """Runs a program; prints its output and ends, if it fails."""
    done = subprocess.run(
        command, cwd=folder, env=variables, capture_output=True, text=True, check=False
    )
    if done.returncode:
        sys.exit(f"{' '.join(command)}: exit code {done.returncode}\n{done.stdout}{done.stderr}")


if __name__ == "__main__":
    main()
