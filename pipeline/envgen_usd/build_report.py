"""The report of a build as an HTML page."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path

from envgen_usd.build_manifest import Manifest
from envgen_usd.errors import Issue
from envgen_usd.whole_files import write_whole

STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; max-width: 70rem; margin: 2rem auto;
  padding: 0 1rem }
table { border-collapse: collapse; margin: 1rem 0 }
td, th { padding: .25rem .75rem; text-align: left; border-bottom: 1px solid #ddd;
  vertical-align: top }
svg, img { max-width: 100%; height: auto }
figure { margin: 1rem 0 } figcaption { color: #555 }
.error { color: #b00020 } .warning { color: #8a5a00 }
"""


_PICTURES = "<!-- pictures -->"
"""Where the pictures of the town go."""


@dataclass(frozen=True)
class Picture:
    """A picture of the report.

    Attributes:
        url: Its file, relative to the page.
        title: What it shows.
    """

    url: str
    title: str


def write_report(  # noqa: PLR0913 - the parts of the page
    path: Path,
    manifest: Manifest,
    counts: Mapping[str, int],
    issues: Sequence[Issue],
    road_map: str,
    *,
    environment: Mapping[str, str],
) -> None:
    """Writes `report.html`.

    Args:
        path: File to write.
        manifest: Inputs, versions and times of the build.
        counts: Kind of feature to number of features.
        issues: Warnings about the input, and parts of buildings without room.
        road_map: URL of the road map, relative to the page.
        environment: Properties of the environment in words (Table A1 of the article).
    """
    title = f"{escape(str(manifest.inputs['road']))}: build report"
    parts = [
        f"<!doctype html><html lang=en><meta charset=utf-8><title>{title}</title>",
        f"<style>{STYLE}</style><h1>{title}</h1>",
        f'<img src="{escape(road_map)}" alt="Map of the road">',
        _PICTURES,
        "<h2>Made</h2>",
        _table(("feature", "number"), counts.items()),
        "<h2>From</h2>",
        _table(("input", "value"), manifest.inputs.items()),
        _table(("environment", "in words"), environment.items()),
        _table(("package", "version"), manifest.versions.items()),
        "<h2>Time</h2>",
        _table(("step", "seconds"), ((k, f"{v:.2f}") for k, v in manifest.seconds.items())),
        f"<h2>Warnings: the input was used after these repairs and decisions ({len(issues)})</h2>",
        _issues(issues),
        "</html>",
    ]
    write_whole(path, "\n".join(parts) + "\n")


def show_pictures(path: Path, pictures: Sequence[Picture], note: str = "") -> None:
    """Shows pictures of the town in a report that `write_report` has written.

    Args:
        path: The report.
        pictures: Pictures in their order.
        note: A sentence below them, e.g. why there are none.
    """
    figures = [
        f'<figure><img src="{escape(each.url)}" alt="{escape(each.title)}">'
        f"<figcaption>{escape(each.title)}</figcaption></figure>"
        for each in pictures
    ]
    lines = ["<h2>The town</h2>", *figures, *([f"<p>{escape(note)}</p>"] if note else [])]
    page = path.read_text(encoding="utf-8").replace(_PICTURES, "\n".join(lines), 1)
    write_whole(path, page)


def _table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    cells = "".join(
        "<tr>" + "".join(f"<td>{escape(str(cell))}</td>" for cell in row) + "</tr>" for row in rows
    )
    return f"<table><tr>{''.join(f'<th>{escape(name)}</th>' for name in head)}</tr>{cells}</table>"


def _issues(issues: Sequence[Issue]) -> str:
    if not issues:
        return "<p>Nothing.</p>"
    rows = "".join(
        f'<tr class="{issue.severity}"><td>{issue.severity}<td>{escape(issue.kind)}'
        f"<td>{escape(issue.where)}<td>{issue.line or ''}<td>{escape(issue.message)}"
        f"<td>{escape(issue.action)}</tr>"
        for issue in issues
    )
    head = "".join(f"<th>{n}" for n in ("severity", "kind", "where", "line", "found", "done"))
    return f"<table><tr>{head}</tr>{rows}</table>"
