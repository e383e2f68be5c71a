"""OpenDRIVE files made by the tests."""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from envgen_usd.models.road import RoadNetwork
from envgen_usd.models.road_surface import RoadSurface
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
    """Reads the content of an OpenDRIVE element and keeps the repaired tree."""
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


@dataclass(frozen=True)
class MeshReport:
    """What an independent look at a surface's mesh finds."""

    crowded_edges: int
    odd_edges: int
    border_equals_outline: bool
    loops_are_simple: bool
    fallen_triangles: int
    area: float
    area_within_outline: float


@pytest.fixture(scope="session")
def inspect_mesh() -> Callable[[RoadSurface], MeshReport]:
    """Checks the ground level of a surface edge by edge."""

    def look(surface: RoadSurface) -> MeshReport:
        ground = surface.triangle_level == 0
        triangles = surface.triangles[ground].tolist()
        directed = Counter(edge for a, b, c in triangles for edge in ((a, b), (b, c), (c, a)))
        whole = Counter(frozenset(edge) for edge in directed.elements())
        border = {edge for edge in directed if edge[::-1] not in directed}
        loops = [loop.tolist() for loop in surface.outline]
        outline = {edge for loop in loops for edge in zip(loop, loop[1:] + loop[:1], strict=True)}
        corners = surface.vertices[surface.triangles[ground]][..., :2]
        first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        area = (first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]) / 2
        kerb = np.array([patch.kind == "kerb" for patch in surface.patches])
        flat = ~kerb[surface.triangle_patch[ground]]
        return MeshReport(
            crowded_edges=sum(count > 2 for count in whole.values()),
            odd_edges=sum(count > 1 for count in directed.values()),
            border_equals_outline=border == outline,
            loops_are_simple=all(len(set(loop)) == len(loop) for loop in loops),
            fallen_triangles=int((area[flat] <= 0).sum() + (np.abs(area[~flat]) > 1e-9).sum()),
            area=float(area[flat].sum()),
            area_within_outline=sum(
                float(
                    np.cross(
                        np.c_[ring[:, :2], np.zeros(len(ring))],
                        np.c_[np.roll(ring[:, :2], -1, 0), np.zeros(len(ring))],
                    )[:, 2].sum()
                    / 2
                )
                for ring in surface.outline_loops()
            ),
        )

    return look


@pytest.fixture(scope="session")
def assert_watertight(inspect_mesh) -> Callable[[RoadSurface], None]:
    """Every inner edge is shared by two triangles, and every other one is part of the outline."""

    def check(surface: RoadSurface) -> None:
        report = inspect_mesh(surface)
        assert report.crowded_edges == report.odd_edges == report.fallen_triangles == 0
        assert report.border_equals_outline
        assert report.loops_are_simple
        assert report.area == pytest.approx(report.area_within_outline, rel=1e-9, abs=1e-3)
        grid = surface.vertices * 1000
        assert np.abs(grid - np.round(grid)).max() < 1e-4
        assert len({patch.id for patch in surface.patches}) == len(surface.patches)

    return check
