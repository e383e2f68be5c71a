"""The pages: links and anchors lead somewhere; `make docs` also checks what is generated."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PAGES = sorted((*ROOT.glob("*.md"), *ROOT.glob("docs/*.md"), ROOT / "asset_library" / "README.md"))
GENERATED = {"docs/commands.md", "docs/reference.md"}
"""Pages that `tools/site_pages.py` makes."""
FENCE = re.compile(r"^```.*?^```", re.DOTALL | re.MULTILINE)
LINK = re.compile(r"\]\(([^)\s]+)\)")
TOP = "asset_library|benchmarks|docs|pipeline|renders|schemas|tests|tools"
PATH = re.compile(rf"`((?:{TOP})/[^`\s]*)`")


def text_of(page: Path) -> str:
    return FENCE.sub("", page.read_text(encoding="utf-8"))


def anchors(page: Path) -> set[str]:
    """Anchors of the headings, as Python-Markdown makes them."""
    titles = re.findall(r"^#+ (.+)$", text_of(page), re.MULTILINE)
    words = (re.sub(r"[^\w\s-]", "", title.replace("`", "")).strip().lower() for title in titles)
    return {re.sub(r"[-\s]+", "-", word) for word in words}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_links_and_named_files_exist(page: Path) -> None:
    text = text_of(page)
    for target in LINK.findall(text):
        if re.match(r"[a-z]+:", target):
            continue
        name, _, anchor = target.partition("#")
        file = (page.parent / name).resolve() if name else page
        assert file.exists(), target  # also in the repository, where no page is generated
        assert not anchor or anchor in anchors(file), target
    for path in PATH.findall(text):
        assert list(ROOT.glob(re.sub(r"<[^>]*>", "*", path).rstrip("/"))), path


def test_the_gallery_shows_every_picture() -> None:
    text = text_of(ROOT / "docs" / "gallery.md")
    pictures = {path.name for path in (ROOT / "renders" / "gallery").iterdir()}
    assert set(re.findall(r"gallery/([^)]+)\)", text)) == pictures


def test_the_site_lists_every_page() -> None:
    listed = set(
        re.findall(r": (\S+\.md)$", (ROOT / "mkdocs.yml").read_text("utf-8"), re.MULTILINE)
    )
    assert listed == {page.relative_to(ROOT).as_posix() for page in PAGES} | GENERATED
