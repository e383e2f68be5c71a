"""A pytest plugin that records which test and which shared fixture reaches which line.

Coverage's own contexts know no fixtures: what a fixture of a module reaches would count for the
first test alone that uses it. Here the lines count for the fixture, and so for all its tests.

`REACHED_LINES` names the JSON file that this writes, `REACHED_LINES_OF` the folder to watch.
"""

import json
import os
import sys
import time
from collections.abc import Generator
from pathlib import Path
from typing import Any

import coverage
import pytest

_FOLDER = Path(os.environ["REACHED_LINES_OF"])
_coverage = coverage.Coverage(
    include=[f"{_FOLDER}/*"], data_file=None, config_file=False, messages=False
)
_contexts = [""]
_seconds: dict[str, float] = {}
_fixtures: dict[str, list[str]] = {}
_passed: set[str] = set()


def pytest_configure() -> None:
    """Starts before the package is imported."""
    _coverage.start()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None, Any, Any]:
    """Counts lines for the test; then forgets what the package keeps between calls.

    A cached function would count for the first test alone that calls it.
    """
    definitions = getattr(item, "_fixtureinfo").name2fixturedefs.values()  # noqa: B009
    _fixtures[item.nodeid] = [_name(each[-1]) for each in definitions if _is_shared(each[-1])]
    _enter(item.nodeid)
    try:
        return (yield)
    finally:
        _leave()
        for name, module in list(sys.modules.items()):
            for kept in vars(module).values() if name.startswith("envgen_usd.") else ():
                getattr(kept, "cache_clear", lambda: None)()


@pytest.hookimpl(wrapper=True)
def pytest_fixture_setup(fixturedef: Any) -> Generator[None, Any, Any]:  # noqa: ANN401
    """Counts lines for the fixture when several tests share it."""
    if not _is_shared(fixturedef):
        return (yield)
    _enter(_name(fixturedef))
    try:
        return (yield)
    finally:
        _leave()


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """Keeps the tests that pass: another test says nothing about a mutant."""
    if report.when == "call" and report.passed:
        _passed.add(report.nodeid)


def pytest_sessionfinish() -> None:
    """Writes the tests, the fixtures and, for each line, which of them reach it."""
    _coverage.stop()
    data = _coverage.get_data()
    lines = {
        Path(file).relative_to(_FOLDER).as_posix(): {
            line: [context for context in contexts if context]
            for line, contexts in data.contexts_by_lineno(file).items()
        }
        for file in sorted(data.measured_files())
    }
    tests = {test: _fixtures[test] for test in _fixtures if test in _passed}
    written = {"tests": tests, "seconds": _seconds, "lines": lines}
    Path(os.environ["REACHED_LINES"]).write_text(json.dumps(written))


_times = [0.0]
"""Seconds spent in each open context, those of contexts within it left out."""
_since = time.monotonic()


def _switch() -> None:
    global _since  # noqa: PLW0603 - there is one clock
    now = time.monotonic()
    _times[-1] += now - _since
    _since = now


def _enter(context: str) -> None:
    _switch()
    _contexts.append(context)
    _times.append(0.0)
    _coverage.switch_context(context)


def _leave() -> None:
    _switch()
    context = _contexts.pop()
    _seconds[context] = _seconds.get(context, 0.0) + _times.pop()
    _coverage.switch_context(_contexts[-1])


def _is_shared(fixture: Any) -> bool:  # noqa: ANN401 - pytest names no public type
    return bool(fixture.scope != "function")


def _name(fixture: Any) -> str:  # noqa: ANN401
    return f"fixture {fixture.baseid}::{fixture.argname}"
