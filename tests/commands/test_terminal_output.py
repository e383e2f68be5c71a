"""Progress in a log: lines when a step ends, and seldom before."""

from io import StringIO

import pytest
import rich.progress
from rich.console import Console
from rich.progress import TimeRemainingColumn
from typer.testing import CliRunner

from envgen_usd.commands.command_line import app
from envgen_usd.commands.terminal_output import (
    LINE_INTERVAL,
    ProgressBars,
    ProgressLines,
    RateColumn,
)
from envgen_usd.environment_files import known_environments


def lines_of(capsys: pytest.CaptureFixture[str]) -> list[str]:
    return capsys.readouterr().err.splitlines()


def test_long_steps_say_rate_and_time_left_every_interval(
    capsys: pytest.CaptureFixture[str],
) -> None:
    now = 0.0
    lines = ProgressLines(lambda: now)
    for done in range(101):
        now = float(done)  # A frame a second.
        lines("frames", done, 100)
    said = lines_of(capsys)
    assert said[0] == f"frames: {LINE_INTERVAL:.0f}/100, 1 a second, 1 min 30 s left"
    assert said[-1] == "frames: 100/100 in 1 min 40 s"
    assert len(said) == 100 / LINE_INTERVAL


def test_a_step_that_ends_says_so_once(capsys: pytest.CaptureFixture[str]) -> None:
    lines = ProgressLines(lambda: 0.0)
    for done in (0, 1, 1):
        lines("road", done, 1)
    assert lines_of(capsys) == ["road: 1/1 in 0.0 s"]


def test_a_step_that_reports_nothing_still_says_that_it_runs(
    capsys: pytest.CaptureFixture[str],
) -> None:
    now = 0.0
    lines = ProgressLines(lambda: now)
    lines("read stage", 0, 1)
    for second in range(1, 36):
        now = float(second)
        lines.remind()
    lines("read stage", 1, 1)
    said = [f"read stage: 0/1, for {at}.0 s" for at in (10, 20, 30)]
    assert lines_of(capsys) == [*said, "read stage: 1/1 in 35.0 s"]


def test_a_step_says_nothing_when_it_begins(capsys: pytest.CaptureFixture[str]) -> None:
    now = 0.0
    lines = ProgressLines(lambda: now)
    now = 25.0  # nothing to report before
    lines("draw frames", 0, 9)
    now = 30.0
    lines("draw frames", 3, 9)
    assert not lines_of(capsys)
    now = 35.0
    lines("draw frames", 6, 9)
    assert lines_of(capsys) == ["draw frames: 6/9, 0.6 a second, 5.0 s left"]


def test_a_terminal_shows_rate_and_time_left() -> None:
    now = 0.0
    screen = Console(file=StringIO(), force_terminal=True, color_system=None)
    columns = (RateColumn(), TimeRemainingColumn())
    with rich.progress.Progress(
        *columns, console=screen, auto_refresh=False, get_time=lambda: now
    ) as display:
        bars = ProgressBars(display)
        for done in range(41):
            now = 2.0 * done
            bars("draw frames", done, 100)
        display.refresh()
        assert isinstance(screen.file, StringIO)
        assert "0.5 a second, left: 0:02:00" in screen.file.getvalue()


def test_the_help_names_countries_and_areas_and_the_version_is_told() -> None:
    runner = CliRunner()
    text = " ".join(runner.invoke(app, ["build", "--help"]).output.split())
    for country, areas in known_environments().items():
        assert country in text
        assert all(area in text for area in areas)
    assert runner.invoke(app, ["--version"]).output.startswith("envgen-usd 0.")
    assert "--install-completion" in runner.invoke(app, ["--help"]).output
    assert "Commands" in runner.invoke(app, []).output
