"""From ids to elements."""

import pytest
from lxml import etree

from envgen_usd.opendrive.checks.element_index import Index


def index(*sections):
    lanes = "".join(
        "<laneSection><right>"
        + "".join(f'<lane id="{id_}"/>' for id_ in ids)
        + "</right></laneSection>"
        for ids in sections
    )
    return Index.of(
        etree.fromstring(f'<OpenDRIVE><road id="7"><lanes>{lanes}</lanes></road></OpenDRIVE>')
    )


def test_a_lane_goes_on_from_the_nearest_section_that_has_it():
    found = index((-1, -2), (-1,), ("-3.0",))
    sections = [found.lane("7", 2, id_).getparent().getparent() for id_ in (-1, -2, -3)]
    all_sections = list(found.root.iter("laneSection"))
    assert [all_sections.index(section) for section in sections] == [1, 0, 2]
    assert found.lane_in_section("7", 2, -1) is None


def test_a_lane_that_is_nowhere_is_an_error_with_its_place():
    with pytest.raises(LookupError, match="road 7: no lane -9 up to lane section 1"):
        index((-1,), (-1,)).lane("7", 1, -9)
