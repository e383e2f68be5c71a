"""Hooks of MkDocs: pages lie where they lie in the repository, so its relative links lead on.

Two pages are generated: the commands from their own help, and the names of the Python API, whose
docstrings mkdocstrings reads. `make docs` builds the site and fails at a link that leads nowhere.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import typer.main
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files

import envgen_usd
from envgen_usd.commands.command_line import app

ROOT = Path(__file__).resolve().parents[1]
PAGES = ("*.md", "asset_library/README.md", "docs/*.md", "docs/images/*", "renders/gallery/*")
"""Files of the repository that the site shows."""
OTHER_NAMES = ("datasets.Frames", "datasets.read_scans")
"""Documented names of sub-packages."""

ONLY_THERE = {"../pipeline/envgen_usd/__init__.py": "reference.md"}
"""Links of pages in `docs` to files that the site does not show, and its pages in their place."""


def on_page_markdown(markdown: str, **_: object) -> str:
    """Lets links to code lead to the page that the site makes of it."""
    for file, page in ONLY_THERE.items():
        markdown = markdown.replace(f"]({file})", f"]({page})")
    return markdown


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Puts the pages of the repository beside the files of the theme."""
    own = [file for file in files if file.src_dir != config.docs_dir]
    shown = [
        File.generated(config, path.relative_to(ROOT).as_posix(), abs_src_path=str(path))
        for pattern in PAGES
        for path in sorted(ROOT.glob(pattern))
    ]
    pages = {"docs/commands.md": commands_page(), "docs/reference.md": reference_page()}
    made = [File.generated(config, name, content=text) for name, text in pages.items()]
    return Files([*own, *shown, *made])


def reference_page() -> str:
    """Markdown that asks mkdocstrings for each public name, types first."""
    names = [name for name in envgen_usd.__all__ if name != "__version__"]
    functions = sorted(name for name in names if name[0].islower())
    types = sorted(set(names) - set(functions))
    homes = {name: f"envgen_usd.{envgen_usd._HOMES[name]}.{name}" for name in names}
    lines = [
        "# Names of the Python API",
        "Everything here is imported from `envgen_usd`, and the data sets from "
        "`envgen_usd.datasets`. [Python API](api.md) shows how they are used.",
        "## Functions",
        *(f"::: {homes[name]}" for name in functions),
        "## Classes",
        *(f"::: {homes[name]}" for name in types),
        "## Data sets",
        *(f"::: envgen_usd.{name}" for name in OTHER_NAMES),
    ]
    return "\n\n".join(lines)


def commands_page() -> str:
    """Markdown of all commands with their arguments and options."""
    program = typer.main.get_command(app)
    lines = [
        "# Commands",
        "The same text as `envgen-usd COMMAND --help`. Exit codes: 0, 2 for input that cannot be "
        "used and for files that cannot be read or written, 130 for an interrupt; `validate` "
        "and `verify` end with 1 where they find faults, `library check` with 1 for warnings.",
    ]
    return "\n\n".join([*lines, *_command(program, "envgen-usd")])


# Typer may bring a click of its own, whose types differ from those of the package click.
def _command(command: Any, name: str) -> Iterator[str]:  # noqa: ANN401
    context = command.context_class(command, info_name=name)
    nested = getattr(command, "commands", {})
    if " " in name or not nested:
        yield f"{'#' * min(name.count(' ') + 1, 3)} {name}"
    if command.help and name.count(" "):
        yield _text(command.help.replace("\b", ""))
    if not nested:
        yield f"```\n{command.get_usage(context).removeprefix('Usage: ')}\n```"
        records = (each.get_help_record(context) for each in command.get_params(context))
        rows = [f"| `{_cell(name)}` | {_text(said)} |" for name, said in filter(None, records)]
        yield "\n".join(
            ("| option | |", "|---|---|", *(row for row in rows if "`--help`" not in row))
        )
    for key, inner in sorted(nested.items()):
        yield from _command(inner, f"{name} {key}")


def _cell(text: str) -> str:
    return text.replace("|", "\\|")


def _text(said: str) -> str:
    """Help as a line of Markdown that a table can hold."""
    return _cell(" ".join(said.split())).replace("<", "&lt;").replace("[", "\\[")
