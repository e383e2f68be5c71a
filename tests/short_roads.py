"""The shipped straight road, cut short: a build of it takes a small part of the time."""

from pathlib import Path

from envgen_usd.recipe.build_options import demo_road


def write_short_road(path: Path) -> Path:
    """Writes a road of 99 m at a corner of four chunks, so its land reaches into no more of them.

    Returns its path.
    """
    text = demo_road("straight").read_text("utf-8")
    for old, new in (
        ('length="400"', 'length="99"'),
        ('x="0" y="0" hdg="0"', 'x="150.5" y="200" hdg="0"'),
    ):
        assert old in text
        text = text.replace(old, new)
    path.write_text(text, "utf-8")
    return path
