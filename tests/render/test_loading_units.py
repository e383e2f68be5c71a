"""An artist's assets are drawn wherever they lie, and nothing else is lost by them."""

import numpy as np
import pytest
from tests.render.artist_stages import AT, CASES, STEP, edited

import envgen_usd.render.stage.stage_scene as scene_module
from envgen_usd.render.stage.stage_scene import StageScene
from envgen_usd.render.user_cache import FOLDER

TOWN = {f"/World/chunk_{n}/{layer}/thing" for n in range(2) for layer in ("houses", "props")}


def boxes_of(scene):
    """Least and largest corner of each object by its path, world, metres."""
    found = {}
    for use in scene.uses:
        points = scene.geometries[use.geometry].points
        for matrix, number in zip(use.matrices, use.scene_objects, strict=True):
            placed = points @ matrix[:3, :3].T + matrix[:3, 3]
            found.setdefault(scene.scene_objects[number].path, []).append(placed)
    joined = {path: np.concatenate(points) for path, points in found.items()}
    return {path: np.stack((p.min(axis=0), p.max(axis=0))) for path, p in joined.items()}


@pytest.mark.parametrize("case", CASES)
def test_an_asset_of_an_artist_is_drawn_where_it_is(case, tmp_path, monkeypatch):
    """Read the first time, from the cache, and without; regions are read again for each frame."""
    monkeypatch.setattr(scene_module, "_KEPT", 0)
    monkeypatch.setenv(FOLDER, str(tmp_path / "cache"))
    path, copies = edited(tmp_path, case)
    for cache in (True, True, False):
        stage = StageScene(path, cache=cache)
        for _ in range(2):
            boxes = boxes_of(stage.near(np.zeros((1, 3)), 1e6))
            assert boxes.keys() == {*TOWN, *copies}
            for number, copy in enumerate(copies):
                x, y, z = AT[0] + STEP * number, *AT[1:]
                wanted = [(x - 0.5, y - 0.5, z), (x + 0.5, y + 0.5, z + 2.0)]
                assert boxes[copy] == pytest.approx(np.array(wanted), abs=1e-6)
        numbers = [region.number for region in stage._regions]
        assert len(numbers) == len(set(numbers))
        assert not [
            loaded for loaded in stage.stage.GetLoadSet() if not loaded.IsAbsoluteRootPath()
        ]


def test_a_prototype_that_is_not_there_is_an_issue(tmp_path):
    path, _ = edited(tmp_path, "as_a_prototype")
    path.write_text(path.read_text().replace("</World/Many/mine>", "</World/Many/none>"))
    stage = StageScene(path, cache=False)
    (issue,) = [each for each in stage.scene.issues if each.kind == "stage.instancer"]
    assert issue.where == "/World/Many"
    assert "/World/Many/none" in issue.message
