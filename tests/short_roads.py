"""Roads whose build takes a small part of the time that one of a town takes."""

from pathlib import Path

from envgen_usd.recipe.build_options import demo_road

TINY_ROAD = """<OpenDRIVE><header revMajor="1" revMinor="7"/><road id="7" length="30" junction="-1">
<planView><geometry s="0" x="185" y="200" hdg="0" length="30"><line/></geometry></planView>
<lanes><laneSection s="0"><center><lane id="0" type="none"/></center><right>
<lane id="-1" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane>
</right></laneSection></lanes></road></OpenDRIVE>"""
IN_NINE_CHUNKS = TINY_ROAD.replace('x="185" y="200"', 'x="90" y="90"')
"""The same road in the middle of a chunk, so that its land reaches into all around it."""


def write_short_road(path: Path) -> Path:
    """Writes the shipped straight road, cut to 99 m.

    It lies at a corner of four chunks, so its land reaches into no more of them.

    Returns:
        Its path.
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
