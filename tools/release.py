"""Makes wheel and source archive of a commit, and tries the wheel where nothing else is installed.

    python tools/release.py --out dist --work .release

Both are made from the files of the commit, so that no file outside of it gets in. Then

1. the wheel that the source archive gives has the bytes of the wheel that the commit gives,
2. the wheel holds every file that the package needs, and no other (`differences`),
3. an empty virtual environment takes the wheel, with the versions of `constraints.txt`, and
4. in an empty folder, the installed program builds the demo, renders a frame, and verifies it.

It needs the package `build`, and the index that pip is configured for. `tests/test_release.py`
does the same without an index, with the libraries of the environment that it runs in.
"""

import argparse
import filecmp
import os
import shutil
import subprocess
import sys
import sysconfig
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


def main() -> None:
    """Makes a release, or ends with a line that says what is wrong with it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("dist"), help="folder of the archives")
    parser.add_argument("--work", type=Path, default=Path(".release"), help="removed at the start")
    parser.add_argument("--no-install", action="store_true", help="only make and compare")
    options = parser.parse_args()
    work = options.work.absolute()
    shutil.rmtree(work, ignore_errors=True)
    files = committed_files()
    archive, wheel = made(files, work)
    _compare_direct(wheel, files, work)
    if lines := differences(wheel, files):
        sys.exit("\n".join(lines))
    if not options.no_install:
        _try(wheel, work)
    options.out.mkdir(parents=True, exist_ok=True)
    for file in (archive, wheel):
        shutil.copy(file, options.out)
        print(f"{options.out / file.name}: {file.stat().st_size / 1e6:.1f} MB")
    shutil.rmtree(work)


def wheel_files(tracked: Sequence[str]) -> dict[str, str]:
    """Paths in the wheel that tracked files of the repository have, to their paths there."""
    return {
        str(PurePosixPath(home, PurePosixPath(path).relative_to(folder))): path
        for path in tracked
        for folder, home in HOMES.items()
        if path.startswith(f"{folder}/") and not path.startswith(ONLY_IN_THE_REPOSITORY)
    }


def committed_files() -> list[str]:
    """Paths of the files of the commit, which are those of the folder."""
    if changed := _git("status", "--porcelain", "--untracked-files=no"):
        sys.exit(f"not committed, so no release:\n{changed}")
    return _git("ls-files").splitlines()


def files_of_folder() -> list[str]:
    """Paths of the files of the folder that a commit of all would have."""
    named = _git("ls-files", "--cached", "--others", "--exclude-standard").splitlines()
    return [path for path in named if (ROOT / path).is_file()]


def made(files: Sequence[str], work: Path, *more: str) -> tuple[Path, Path]:
    """Source archive of files, and the wheel that the archive gives.

    Args:
        files: Paths in the repository.
        work: Folder for copies and results.
        more: Options of `build`.
    """
    _build(_copied(files, work / "source"), work / "dist", *more)
    (archive,), (wheel,) = (work / "dist").glob("*.tar.gz"), (work / "dist").glob("*.whl")
    return archive, wheel


def differences(wheel: Path, files: Sequence[str]) -> list[str]:
    """A line for each file that the wheel lacks or that is none of the repository's files."""
    with zipfile.ZipFile(wheel) as file:
        packed = {name for name in file.namelist() if ".dist-info/" not in name}
    expected = wheel_files(files)
    missing, others = expected.keys() - packed, packed - expected.keys()
    return [
        *(f"missing: {expected[name]}" for name in sorted(missing)),
        *(f"not of the repository: {name}" for name in sorted(others)),
    ]


def environment_with_libraries(folder: Path) -> Path:
    """An environment with the libraries of this one, without what is installed as editable.

    A path in a `.pth` file adds a folder of libraries, but no `.pth` file inside it counts, and an
    editable package is one. So what this environment imports from the repository, that one cannot.

    Returns:
        Its folder of programs.
    """
    venv.create(folder, with_pip=False)
    variables = {"base": str(folder), "platbase": str(folder)}
    libraries = {sysconfig.get_path(name) for name in ("purelib", "platlib")}
    own = Path(sysconfig.get_path("purelib", vars=variables))
    (own / "libraries.pth").write_text("\n".join(sorted(libraries)), encoding="utf-8")
    return folder / "bin"


def demo(area: str, *more: str) -> tuple[tuple[str, ...], ...]:
    """Commands that build the demo into `town`, render a frame, and verify the files.

    Args:
        area: Area type.
        more: Options of `build`.
    """
    return (
        ("build", "--demo", "--country", "1", "--area", area, "--out", "town", *more),
        ("render", "town/stage.usda", "--frames", "1"),
        ("verify", "town"),
    )


def alone() -> dict[str, str]:
    """Variables of a program that neither the repository nor the cache of an earlier run helps."""
    others = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    return {**others, "ENVGEN_USD_CACHE": ""}


def run(command: Sequence[str], folder: Path, variables: Mapping[str, str] | None = None) -> None:
    """Runs a program; prints its output and ends, if it fails."""
    done = subprocess.run(
        command, cwd=folder, env=variables, capture_output=True, text=True, check=False
    )
    if done.returncode:
        sys.exit(f"{' '.join(command)}: exit code {done.returncode}\n{done.stdout}{done.stderr}")


def _copied(files: Sequence[str], folder: Path) -> Path:
    """The files, in a folder of their own, with the time of the commit."""
    seconds = float(_commit_time())
    for path in files:
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / path, folder / path)
        os.utime(folder / path, (seconds, seconds))
    return folder


def _build(source: Path, out: Path, *more: str) -> None:
    command = (sys.executable, "-m", "build", "--outdir", str(out), *more, str(source))
    run(command, source.parent, {**os.environ, "SOURCE_DATE_EPOCH": _commit_time()})


def _commit_time() -> str:
    """Seconds since 1970."""
    return _git("log", "-1", "--format=%ct")


def _compare_direct(wheel: Path, files: Sequence[str], work: Path) -> None:
    # From another copy, as a build leaves files beside the source, which must not get in.
    _build(_copied(files, work / "again"), work / "direct", "--wheel")
    if not filecmp.cmp(wheel, work / "direct" / wheel.name, shallow=False):
        sys.exit("the source archive gives another wheel than the commit")


def _try(wheel: Path, work: Path) -> None:
    """Installs the wheel into an empty environment and builds the demo in an empty folder."""
    begin, environment, empty = time.monotonic(), work / "environment", work / "empty"
    venv.create(environment, with_pip=True)
    empty.mkdir()
    constraints = ("--constraint", str(ROOT / "constraints.txt"))
    pip = (str(environment / "bin" / "python"), "-m", "pip", "install", "--quiet")
    run((*pip, *constraints, str(wheel)), empty)
    print(f"installed into an empty environment in {time.monotonic() - begin:.0f} s")
    for arguments in demo("residential"):
        begin = time.monotonic()
        run((str(environment / "bin" / "envgen-usd"), *arguments), empty, alone())
        print(f"envgen-usd {' '.join(arguments)}: {time.monotonic() - begin:.0f} s")


def _git(*arguments: str) -> str:
    command = ("git", "-C", str(ROOT), *arguments)
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()


if __name__ == "__main__":
    main()
