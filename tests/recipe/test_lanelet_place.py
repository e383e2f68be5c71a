"""`build --lanelet2`: a map of lanelets becomes a road file, and the environment stands on it."""

import pytest
from tests.places.lanelet_files import two_lanes
from typer.testing import CliRunner

from envgen_usd.commands.command_line import app
from envgen_usd.recipe.build_options import BuildOptions
from envgen_usd.recipe.build_summary import option_values
from envgen_usd.recipe.environment_build import build_shard
from envgen_usd.recipe.map_land import read_road


def test_a_map_becomes_an_environment(tmp_path):
    out = tmp_path / "out"
    chosen = BuildOptions(
        road=out / "road.xodr", country="1", area="residential", out=out, workers=1, actors=False,
        metadata_only=True, lanelet2=two_lanes().write(tmp_path / "map.osm"),
    )  # fmt: skip
    # A ninth of the chunks is enough to see that a stage is built on the road of the map.
    assert build_shard(chosen, (1, 9)).built > 0
    road, _ = read_road(out / "road.xodr", 0.02)
    assert not road.network.issues
    assert [lane.id for lane in road.network.roads["1"].sections[0].right] == [-1, -2]
    assert option_values(chosen)["lanelet2"] == "map.osm"


@pytest.mark.parametrize(
    ("more", "reason"),
    [
        (("road.xodr", "--lanelet2", "map.osm"), "exclude each other"),
        (("--osm", "map.osm", "--lanelet2", "map.osm"), "exclude each other"),
        (("--lanelet2", "none.osm"), "none.osm"),
        (("--lanelet2", "empty.osm"), "no usable lanelet"),
        (("--lanelet2", "map.osm", "--max-area", "0.0001"), "--max-area"),
        (("--lanelet2", "map.osm", "--bbox", "8,49,9,50"), "leave it out"),
        (("--lanelet2", "map.osm", "--fill", "none"), "leave it out"),
        (("--lanelet2", "map.osm", "--driving-side", "left"), "leave it out"),
    ],
)
def test_unusable_maps_stop_before_anything_is_written(more, reason, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    two_lanes().write(tmp_path / "map.osm")
    (tmp_path / "empty.osm").write_text("<osm/>")
    chosen = ("build", *more, "--country", "1", "--area", "residential", "--out", "out")
    result = CliRunner().invoke(app, chosen)
    assert result.exit_code == 2 or reason in str(result.exception)
    assert reason in result.output + str(result.exception)
    assert not (tmp_path / "out").exists()
