import numpy as np
import pytest
import shapely

from envgen_usd.chunks import Chunk
from envgen_usd.errors import Severity
from envgen_usd.models.land_rules import TerrainRules
from envgen_usd.terrain.heightmaps import build_heightmaps
from envgen_usd.terrain.steep_ground import find_steep_ground

RULES = TerrainRules(0.0, 100.0, 0.5)


def issues(make_surface, apart: float):
    low, high = shapely.box(-50.0, 90.0, 250.0, 97.0), shapely.box(-50.0, 97.0, 250.0, 104.0)
    both = shapely.union(low, shapely.affinity.translate(high, 0.0, apart))
    surface = make_surface(both, lambda x, y: np.where(y + 0 * x > 97.5, 8.0, 0.0))
    maps = build_heightmaps(surface, [Chunk(0, 0), Chunk(0, 2)], RULES, 0)
    return find_steep_ground(maps, surface, RULES)


def test_roads_too_close_for_a_bank_are_one_issue_of_their_chunk(make_surface):
    (issue,) = issues(make_surface, 6.0)
    assert issue.severity == Severity.WARNING
    assert issue.where == "chunk 0_0"
    # 8 m of height over 6 m, the whole width of the chunk.
    assert "up to 1." in issue.message
    area = float(issue.message.split(" m²")[0])
    assert 600.0 < area < 1300.0


@pytest.mark.parametrize("apart", [25.0, 60.0])
def test_roads_with_room_for_a_bank_are_no_issue(make_surface, apart):
    assert issues(make_surface, apart) == ()
