"""Changes single places of the program and asks whether a test of behaviour notices.

Usage: `make mutants`, or `make mutants SAMPLE=300 SEED=1`.

1. Copy the tree to `.mutants/tree`; the user's files stay as they are.
2. Run all tests once and record which test reaches which line.
3. Draw a sample of the mutants that cosmic-ray proposes.
4. Run, for each mutant, the tests that reach its line, quick ones of its own layer first.

Interrupt it at any time; the next start goes on, and asks again only what a change can answer
differently: all mutants of a changed package, survivors after a change of the tests.

These mutants are left out, because they cannot change behaviour or because every test kills them:

- annotations, aliases of types, bodies of `if TYPE_CHECKING`;
- `__repr__`; the decorators `cache`, `lru_cache` and `overload`;
- `is` for `==`, whose answer depends on how Python stores equal objects;
- bit operators for arithmetic and the other way round, which raise `TypeError` on floats.

A line outside of functions runs when a module is imported. The tests that reach it are those that
reach a line with a name that it defines.
"""

import argparse
import ast
import collections
import compileall
import hashlib
import importlib
import json
import multiprocessing
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import time
import types
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

import cosmic_ray.plugins
from cosmic_ray.ast import ast_nodes, get_ast
from cosmic_ray.mutating import use_mutation

ROOT = Path(__file__).resolve().parents[1]
WORK = ROOT / ".mutants"
TREE = WORK / "tree"
SOURCES = "pipeline/envgen_usd"
PACKAGES = ("geometry", "opendrive", "city", "render")
DATA_PACKAGES = ("asset_library", "schemas", "renders")

TESTS = 150
"""Tests that are asked about a mutant; more find more and take longer."""
SECONDS = 60.0
"""Time that these tests take together on the unchanged program; at least one is asked."""
PATIENCE = 4.0
"""A mutant may take so many times as long; beyond that it counts as killed."""
PRELOADED = (
    *("numpy", "scipy.spatial", "shapely", "lxml.etree", "pyproj", "PIL.Image", "pytest"),
    *("trimesh", "manifold3d", "rasterio", "torch", "pxr.Usd", "rich.console", "typer"),
)
"""Imported once here rather than once for each mutant."""

_ARITHMETIC = {"Add", "Sub", "Mul", "Div", "FloorDiv", "Mod", "Pow", "UAdd", "USub"}
_TIMELESS = {"cache", "lru_cache", "overload"}


@dataclass(frozen=True)
class Mutant:
    """A place in a file and what cosmic-ray does to it."""

    path: str
    """Relative to the package."""
    line: int
    column: int
    operator: str
    occurrence: int

    @property
    def name(self) -> str:
        """Names the mutant in the results."""
        return f"{self.path}:{self.line}:{self.column} {self.operator} {self.occurrence}"


@dataclass(frozen=True)
class Statement:
    """A statement, or the head of a compound one."""

    path: str
    first: int
    last: int
    body_last: int
    is_called: bool
    """Whether it stands in a function, so that it runs when that is called."""
    is_function: bool
    defines: frozenset[str]
    mentions: frozenset[str]


# ---- mutants


def operators() -> dict[str, object]:
    """The operators of cosmic-ray that need no arguments, without those that say nothing."""
    classes = {name: cosmic_ray.plugins.get_operator(name)
               for name in cosmic_ray.plugins.operator_names()}  # fmt: skip
    return {name: each() for name, each in classes.items()
            if not each.arguments() and _says_something(name)}  # fmt: skip


def _says_something(operator: str) -> bool:
    kind, *swapped = operator.split("/")[1].split("_")
    if len(swapped) < 2:
        return True
    if kind == "ReplaceComparisonOperator":
        return len({each in ("Is", "IsNot") for each in swapped}) == 1
    return "Delete" in swapped or len({each in _ARITHMETIC for each in swapped}) == 1


def mutants_of(path: str) -> list[Mutant]:
    """All mutants of a file of the package."""
    source = (TREE / SOURCES / path).read_text()
    left_out = list(_left_out(ast.parse(source)))
    nodes = list(ast_nodes(get_ast(source)))
    found = []
    for name, operator in operators().items():
        places = (start for node in nodes for start, _ in operator.mutation_positions(node))
        for occurrence, start in enumerate(places):
            if not any(first <= start < last for first, last in left_out):
                found.append(Mutant(path, *start, name, occurrence))
    return found


def _left_out(tree: ast.Module) -> Iterator[tuple[tuple[int, int], tuple[int, int]]]:
    """Places (line, column), from and to, where a mutant changes no behaviour."""
    for node in ast.walk(tree):
        spans: list[ast.AST | None] = []
        if isinstance(node, ast.FunctionDef):
            spans = [node.returns, *(each for each in node.decorator_list if _is_timeless(each))]
            spans += [node] if node.name == "__repr__" else []
        elif isinstance(node, ast.arg | ast.AnnAssign):
            spans = [node.annotation]
        elif isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            spans = [node]
        elif isinstance(node, ast.Assign) and node in tree.body and _is_type(node.value):
            spans = [node.value]
        for span in spans:
            if span is not None:
                # A decorator's place is that of its @, one column before the expression.
                yield (span.lineno, span.col_offset - 1), (span.end_lineno, span.end_col_offset)


def _is_timeless(decorator: ast.expr) -> bool:
    called = decorator.func if isinstance(decorator, ast.Call) else decorator
    return ast.unparse(called).split(".")[-1] in _TIMELESS


def _is_type(value: ast.expr) -> bool:
    """Whether an expression is a union of types: its names begin with capitals or are built in."""
    if isinstance(value, ast.BinOp) and isinstance(value.op, ast.BitOr):
        return _is_type(value.left) and _is_type(value.right)
    if isinstance(value, ast.Constant):
        return value.value is None
    name = ast.unparse(value).split("[")[0].split(".")[-1]
    return bool(re.fullmatch(r"[A-Z]\w*[a-z]\w*|int|float|str|bool|bytes|tuple|list|dict", name))


# ---- the tests that reach a line


def statements_of(path: str) -> list[Statement]:
    """The statements of a file of the package."""
    found: list[Statement] = []

    def visit(body: list[ast.stmt], is_called: bool, owner: frozenset[str]) -> None:
        for node in body:
            inner = [
                each
                for _, part in ast.iter_fields(node)
                for each in (part if isinstance(part, list) else ())
                if isinstance(each, ast.stmt | ast.ExceptHandler)
            ]
            last = node.end_lineno or node.lineno
            first = min([node.lineno, *(d.lineno for d in getattr(node, "decorator_list", []))])
            head_last = max(node.lineno, min(each.lineno for each in inner) - 1) if inner else last
            is_scope = isinstance(node, ast.FunctionDef | ast.ClassDef)
            parts = [each for each in ast.iter_child_nodes(node) if each not in inner]
            names = _names(parts)
            defines = frozenset([node.name]) if is_scope else _targets(node)
            found.append(Statement(path, first, head_last, last, is_called,
                                   isinstance(node, ast.FunctionDef),
                                   defines if is_called else defines or owner, names))  # fmt: skip
            visit(inner, is_called or isinstance(node, ast.FunctionDef),
                  defines if is_scope else owner)  # fmt: skip

    visit(ast.parse((TREE / SOURCES / path).read_text()).body, False, frozenset())
    return found


def _names(nodes: list[ast.AST]) -> frozenset[str]:
    walked = [each for node in nodes for each in ast.walk(node)]
    return frozenset(
        [each.id for each in walked if isinstance(each, ast.Name)]
        + [each.attr for each in walked if isinstance(each, ast.Attribute)]
        + [each.arg for each in walked if isinstance(each, ast.keyword) and each.arg]
    )


def _targets(node: ast.stmt) -> frozenset[str]:
    targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
    return _names([each for each in targets if each is not None])


class Reach:
    """Which tests reach which statement."""

    def __init__(self) -> None:
        """Reads what `record_reach` has written."""
        self.tests: dict[str, list[str]] = {}
        self.seconds: dict[str, float] = collections.defaultdict(float)
        self.lines: dict[str, dict[int, set[str]]] = {}
        for file in sorted(WORK.glob("reached-*.json")):
            part = json.loads(file.read_text())
            self.tests |= part["tests"]
            for context, seconds in part["seconds"].items():
                self.seconds[context] = max(self.seconds[context], seconds)
            for path, lines in part["lines"].items():
                kept = self.lines.setdefault(path, {})
                for line, contexts in lines.items():
                    kept.setdefault(int(line), set()).update(contexts)
        self.users: dict[str, list[str]] = collections.defaultdict(list)
        for test, fixtures in self.tests.items():
            for fixture in fixtures:
                self.users[fixture].append(test)
        self.statements = {path: statements_of(path) for path in package_files()}
        self.mentions: dict[str, list[Statement]] = collections.defaultdict(list)
        for statement in (each for file in self.statements.values() for each in file):
            for name in statement.mentions:
                self.mentions[name].append(statement)

    def cost(self, test: str) -> float:
        """Seconds of a test with the shared fixtures that it needs."""
        return self.seconds[test] + sum(self.seconds[each] for each in self.tests[test])

    def tests_of(self, mutant: Mutant) -> list[str]:
        """The tests to ask about a mutant, in the order in which they are asked."""
        around = [each for each in self.statements[mutant.path]
                  if each.first <= mutant.line <= each.last]  # fmt: skip
        contexts = self._contexts(max(around, key=lambda each: each.first), set())
        tests = {test for context in contexts for test in self.users.get(context, [context])}
        layer = mutant.path.split("/")[0]
        ordered = sorted(
            tests & self.tests.keys(),
            key=lambda test: (not test.startswith(f"tests/{layer}/"), self.cost(test), test),
        )
        asked: list[str] = []
        for test in ordered:
            if asked and self.expected([*asked, test]) > SECONDS:
                continue
            asked.append(test)
            if len(asked) == TESTS:
                break
        return asked

    def expected(self, tests: list[str]) -> float:
        """Seconds of some tests that share their fixtures."""
        fixtures = {fixture for test in tests for fixture in self.tests[test]}
        return sum(self.seconds[each] for each in [*tests, *fixtures])

    def _contexts(self, statement: Statement, seen: set[Statement]) -> set[str]:
        seen.add(statement)
        if statement.is_called or statement.is_function:
            lines = self.lines.get(statement.path, {})
            first = statement.last + 1 if not statement.is_called else statement.first
            last = statement.last if statement.is_called else statement.body_last
            return set().union(*(lines.get(line, ()) for line in range(first, last + 1)))
        users = [each for name in statement.defines for each in self.mentions[name]
                 if each not in seen
                 and (each.path == statement.path or not name.startswith("_"))]  # fmt: skip
        return set().union(*(self._contexts(each, seen) for each in users if each not in seen))


def package_files() -> list[str]:
    """All modules of the package, relative to it."""
    folder = TREE / SOURCES
    return sorted(
        file.relative_to(folder).as_posix()
        for file in folder.rglob("*.py")
        if not any(part in DATA_PACKAGES for part in file.relative_to(folder).parts)
    )


def record_reach(environment: dict[str, str], key: str) -> None:
    """Runs each folder of tests under coverage, except those that were recorded before."""
    folders = sorted({file.relative_to(TREE / "tests").parts[0]
                      for file in (TREE / "tests").rglob("test_*.py")})  # fmt: skip
    for folder in folders:
        digest = key + digest_of(TREE / "tests" / folder) + digest_of(TREE / "tests/conftest.py")
        written = WORK / f"reached-{folder}.json"
        stamp = written.with_suffix(".digest")
        if written.exists() and stamp.exists() and stamp.read_text() == digest:
            continue
        print(f"recording which lines tests/{folder} reaches", flush=True)
        extra = {"REACHED_LINES": str(written), "REACHED_LINES_OF": str(TREE / SOURCES)}
        command = [sys.executable, "-m", "pytest", "-q", "--no-header", "--tb=no",
                   "-p", "reached_lines", f"tests/{folder}"]  # fmt: skip
        done = subprocess.run(command, cwd=TREE, env=environment | extra, check=False)
        if done.returncode in (0, 1):
            stamp.write_text(digest)
        else:
            sys.exit(f"tests/{folder} could not be run")


# ---- the run of a mutant


def run_mutant(mutant: Mutant, tests: list[str], limit: float) -> tuple[str, str]:
    """Applies a mutant to the copy, runs tests, and takes it back.

    Returns:
        `killed` or `survived`, and the changed line.
    """
    operator = cosmic_ray.plugins.get_operator(mutant.operator)()
    with use_mutation(TREE / SOURCES / mutant.path, operator, mutant.occurrence) as (before, after):
        pairs = zip(before.split("\n"), after.split("\n"), strict=False)
        change = next((f"{a.strip()}  =>  {b.strip()}" for a, b in pairs if a != b), "")
        code = _exit_code(tests, limit)
    return "survived" if code == 0 else "killed", change


def _exit_code(tests: list[str], limit: float | None) -> int | None:
    """Exit code of pytest, `None` if it takes longer than `limit` seconds."""
    process = multiprocessing.get_context("fork").Process(target=_run_tests, args=(tests,))
    process.start()
    try:
        process.join(limit)
        return process.exitcode
    finally:
        if process.is_alive():
            os.killpg(process.pid or 0, signal.SIGKILL)
            process.join()


def check_tests(tests: set[str]) -> None:
    """Stops the program when a test fails on the unchanged copy: it would kill every mutant."""
    # Without names, pytest would run all tests.
    if tests and _exit_code(sorted(tests), None) != 0:
        sys.exit(f"tests fail on the unchanged program, see {WORK / 'last_tests.txt'}")


def _run_tests(tests: list[str]) -> None:
    """Runs in a process of its own; its exit code is 0 when all tests pass."""
    os.setsid()
    output = os.open(WORK / "last_tests.txt", os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    os.dup2(output, 1)
    os.dup2(output, 2)
    os.chdir(TREE)
    sys.modules["__main__"] = types.ModuleType("__main__")  # worker processes would import this
    sys.path.insert(0, str(TREE / "pipeline"))
    sys.dont_write_bytecode = True  # a mutant of the same length would be read from an old file
    import pytest  # noqa: PLC0415 - imported already, by `_preload`

    code = pytest.main(["-q", "-x", "--tb=short", "-p", "no:cacheprovider", *tests])
    sys.stdout.flush()
    os._exit(int(code))


def _preload() -> None:
    for module in PRELOADED:
        importlib.import_module(module)


# ---- the whole


def copy_tree() -> None:
    """Copies what git tracks or would track; the package finds its data beside it."""
    listed = subprocess.run(
        ["git", "ls-files", "-co", "--exclude-standard", "-z"],
        cwd=ROOT, capture_output=True, text=True, check=True,
    )  # fmt: skip
    shutil.rmtree(TREE, ignore_errors=True)
    for name in filter(None, listed.stdout.split("\0")):
        if (ROOT / name).is_file():
            (TREE / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, TREE / name)
    for package in DATA_PACKAGES:
        (TREE / SOURCES / package).symlink_to(TREE / package)
    compileall.compile_dir(TREE / "pipeline", quiet=2)


def digest_of(*folders: Path) -> str:
    """Digest of the text of all modules under some folders."""
    digest = hashlib.sha256()
    for folder in folders:
        for file in sorted(folder.rglob("*.py")) if folder.is_dir() else [folder]:
            digest.update(file.relative_to(TREE).as_posix().encode() + file.read_bytes())
    return digest.hexdigest()[:16]


def draw(size: int, seed: int, key: str) -> list[Mutant]:
    """Draws mutants of the four packages, each as likely as another, in a random order."""
    kept = WORK / f"mutants-{key}.json"
    if not kept.exists():
        paths = [path for path in package_files() if path.split("/")[0] in PACKAGES]
        kept.write_text(json.dumps([asdict(each) for path in paths for each in mutants_of(path)]))
    everything = [Mutant(**each) for each in json.loads(kept.read_text())]
    print(f"{len(everything)} mutants in {', '.join(PACKAGES)}; {size} are drawn", flush=True)
    return random.Random(seed).sample(everything, min(size, len(everything)))


def test_environment() -> dict[str, str]:
    """Variables under which the tests run on the copy, with the files that other people made."""
    path = os.pathsep.join([str(TREE / "pipeline"), str(ROOT / "tools")])
    shared = os.environ.get("ENVGEN_SHARED", str(ROOT.parent / "shared"))
    return os.environ | {"PYTHONPATH": path, "ENVGEN_SHARED": shared, "OMP_NUM_THREADS": "1"}


def main() -> None:
    """Runs all steps and prints a table."""
    options = argparse.ArgumentParser(description=(__doc__ or "").split("\n", maxsplit=1)[0])
    options.add_argument("--sample", type=int, default=120, help="number of mutants")
    options.add_argument("--seed", type=int, default=0)
    given = options.parse_args()
    WORK.mkdir(exist_ok=True)
    copy_tree()
    os.environ |= test_environment()
    key = digest_of(TREE / "pipeline")
    sample = draw(given.sample, given.seed, key)
    record_reach(dict(os.environ), key)
    reach = Reach()
    tests_key = key + digest_of(TREE / "tests")
    results = WORK / f"results-{key}.jsonl"
    known = {}
    for line in results.read_text().splitlines() if results.exists() else []:
        known[json.loads(line)["mutant"]] = json.loads(line)
    open_ones = [each for each in sample if not _is_known(known.get(each.name), tests_key)]
    _preload()
    print(f"checking the tests that reach {len(open_ones)} mutants", flush=True)
    check_tests({test for mutant in open_ones for test in reach.tests_of(mutant)})
    for number, mutant in enumerate(sample, 1):
        if mutant in open_ones:
            start = time.monotonic()
            tests = reach.tests_of(mutant)
            limit = 60 + PATIENCE * reach.expected(tests)
            outcome, change = run_mutant(mutant, tests, limit) if tests else ("not reached", "")
            result = {"mutant": mutant.name, "outcome": outcome, "change": change,
                      "asked": len(tests), "tests": tests_key,
                      "seconds": round(time.monotonic() - start, 1)}  # fmt: skip
            with results.open("a") as file:
                file.write(json.dumps(result) + "\n")
            known[mutant.name] = result
        result = known[mutant.name]
        told = f"{result['outcome']:11} {result['seconds']:6} s {result['asked']:3} tests"
        print(f"{number:4}/{len(sample)} {told}  {mutant.name}", flush=True)
        print(f"{'':40}{result['change']}", flush=True)
    print_table(sample, {each.name: known[each.name]["outcome"] for each in sample})


def _is_known(result: dict[str, str] | None, tests_key: str) -> bool:
    """Whether an earlier run has answered for a mutant; more tests may kill what survived."""
    return bool(result) and (result["outcome"] == "killed" or result["tests"] == tests_key)


def print_table(sample: list[Mutant], outcomes: dict[str, str]) -> None:
    """Prints, for each package and kind of mutant, how many were killed."""
    columns = ("killed", "survived", "not reached")
    rows: dict[str, collections.Counter[str]] = collections.defaultdict(collections.Counter)
    for mutant in sample:
        kind = mutant.operator.split("/")[1].split("_")[0]
        for row in (mutant.path.split("/")[0], kind, "all"):
            rows[row][outcomes[mutant.name]] += 1
    print(f"\n{'':28}" + "".join(f"{column:>13}" for column in columns))
    for row in [*PACKAGES, *sorted(rows.keys() - {*PACKAGES, "all"}), "all"]:
        print(f"{row:28}" + "".join(f"{rows[row][column]:13}" for column in columns))
    share = rows["all"]["killed"] / max(len(sample), 1)
    print(f"killed: {share:.0%} of {len(sample)}")


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        sys.exit("interrupted; the next start goes on")
