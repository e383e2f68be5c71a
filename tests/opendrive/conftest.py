"""OpenDRIVE files made by the tests."""

from collections.abc import Callable
from pathlib import Path

import pytest

from envgen_usd.models.road import RoadNetwork
from envgen_usd.opendrive.reader import Reading, read

LINE = '<geometry s="0" x="0" y="0" hdg="0" length="100"><line/></geometry>'
LANES = """
<laneSection s="0">
  <left><lane id="1" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane></left>
  <center><lane id="0" type="none"/></center>
  <right><lane id="-1" type="driving"><width sOffset="0" a="3" b="0" c="0" d="0"/></lane></right>
</laneSection>
"""


@pytest.fixture(scope="session")
def road_xml() -> Callable[..., str]:
    """Writes a road; by default 100 m straight along +x with a lane on either side."""

    def make(
        id_: str = "1",
        *,
        length: str = "100",
        attributes: str = 'junction="-1"',
        link: str = "",
        plan_view: str = LINE,
        elevation: str = "",
        lateral: str = "",
        lanes: str = LANES,
        rest: str = "",
    ) -> str:
        return f"""
        <road id="{id_}" name="" length="{length}" {attributes}>
          <link>{link}</link>
          <planView>{plan_view}</planView>
          <elevationProfile>{elevation}</elevationProfile>
          <lateralProfile>{lateral}</lateralProfile>
          <lanes>{lanes}</lanes>
          {rest}
        </road>"""

    return make


@pytest.fixture
def write_xodr(tmp_path: Path) -> Callable[[str], Path]:
    """Writes the content of an OpenDRIVE element into a file."""

    def write(content: str, head: str = '<header revMajor="1" revMinor="8"/>') -> Path:
        path = tmp_path / "map.xodr"
        path.write_text(f"<OpenDRIVE>{head}{content}</OpenDRIVE>", encoding="utf-8")
        return path

    return write


@pytest.fixture
def read_xodr(write_xodr: Callable[..., Path]) -> Callable[..., Reading]:
    """Reads the content of an OpenDRIVE element and keeps the mended tree."""
    return lambda content, **more: read(write_xodr(content, **more))


@pytest.fixture
def network_of(read_xodr: Callable[..., Reading]) -> Callable[..., RoadNetwork]:
    """Reads the content of an OpenDRIVE element."""
    return lambda content, **more: read_xodr(content, **more).network


@pytest.fixture(scope="session")
def xodr_reader(
    road_xml: Callable[..., str], tmp_path_factory: pytest.TempPathFactory
) -> Callable[..., RoadNetwork]:
    """Reads one road, made of the parts of `road_xml`; for tests that make many."""
    path = tmp_path_factory.mktemp("xodr") / "map.xodr"

    def read_parts(**parts: str) -> RoadNetwork:
        path.write_text(f"<OpenDRIVE><header/>{road_xml(**parts)}</OpenDRIVE>", encoding="utf-8")
        return read(path).network

    return read_parts


@pytest.fixture(scope="session")
def kinds() -> Callable[[RoadNetwork], list[str]]:
    """Kinds of a network's issues, in order of appearance."""
    return lambda network: [issue.kind for issue in network.issues]
