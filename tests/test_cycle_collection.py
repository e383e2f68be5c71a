"""The collector of reference cycles pauses, and returns to its former state."""

import gc
from pathlib import Path

import pytest

from envgen_usd.cycle_collection import paused_collection
from envgen_usd.opendrive.reader import read_network
from envgen_usd.opendrive.surface import build_surface

ROAD = Path(__file__).resolve().parents[1] / "asset_library" / "roads" / "straight.xodr"


@pytest.mark.parametrize("enabled", [True, False])
def test_the_collector_returns_to_its_former_state(enabled):
    before = gc.isenabled()
    (gc.enable if enabled else gc.disable)()
    try:
        with paused_collection():
            assert not gc.isenabled()
        assert gc.isenabled() == enabled
        with pytest.raises(ValueError, match="stop"), paused_collection():
            raise ValueError("stop")
        assert gc.isenabled() == enabled
    finally:
        (gc.enable if before else gc.disable)()


def test_reading_and_building_leave_the_collector_running():
    assert gc.isenabled()
    build_surface(read_network(ROAD))
    assert gc.isenabled()


def test_what_a_step_leaves_is_not_visited_with_the_youngest():
    with paused_collection():
        kept = [[] for _ in range(1000)]
    young = {id(each) for each in gc.get_objects(generation=0)}
    assert not young & {id(each) for each in kept}
    assert gc.get_freeze_count() == 0


def test_objects_kept_from_the_collector_stay_so():
    gc.freeze()
    try:
        before = gc.get_freeze_count()
        with paused_collection():
            pass
        assert gc.get_freeze_count() == before
    finally:
        gc.unfreeze()
