"""Real files: each is read, and only those that hold no road are refused."""

import time
from functools import cache
from pathlib import Path
from typing import NamedTuple

import pytest

from envgen_usd.errors import EnvgenError
from envgen_usd.opendrive.features.road_features import road_features
from envgen_usd.opendrive.reader import read_network

NO_ROAD = {"TownEmpty.xodr"}


class Facts(NamedTuple):
    """What a file holds."""

    roads: int
    left_out: int
    length: float
    features: tuple[str, ...]


@cache
def facts_of(path: Path) -> Facts:
    """Reads a file once for all tests."""
    network = read_network(path)
    left_out = sum(issue.action.startswith("road left out") for issue in network.issues)
    total = sum(road.length for road in network.roads.values())
    features = tuple(feature.id for feature in road_features(network))
    return Facts(len(network.roads), left_out, total, features)


def test_every_file_is_read(corpus):
    refused = set()
    for path in sorted(corpus.glob("*/*.xodr")):
        start = time.perf_counter()
        try:
            facts = facts_of(path)
        except EnvgenError:
            refused.add(path.name)
        else:
            assert facts.roads, path
            assert len(set(facts.features)) == len(facts.features), path
        assert time.perf_counter() - start < 10, path
    assert refused <= NO_ROAD


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("malidrive/SingleRoadNanValues", "number.not_finite"),
        ("malidrive/SingleRoadHighCoefficients", "number.malformed"),
        ("malidrive/SingleRoadNegativeWidth", "lane.negative_width"),
        ("malidrive/SingleRoadTinyGeometry", "plan_view.too_short"),
        ("malidrive/SmallTownRoads", "number.negative_start"),
        ("crdesigner/BEL_Wervik-2_1_T-1", "plan_view.gap"),
        ("scenic/cubetown", "plan_view.kink"),
        ("scenic/Issue295a", "plan_view.p_range"),
        ("ivsg/WBeaverAve", "road.length"),
        (
            "asamqc/rule_104_road_lanes_lane_offset_no_offset_if_border_defined_invalid",
            "lanes.offset_and_border",
        ),
        ("asamqc/root_tag_is_opendrive__negative", "root.name"),
        ("asamqc/road_geometry_elem_asc_order__invalid", "order.descending"),
    ],
)
def test_known_faults_are_found(corpus, name, kind):
    path = corpus / f"{name}.xodr"
    if not path.exists():
        pytest.skip(f"{name} is not in this corpus")
    assert kind in {issue.kind for issue in read_network(path).issues}


def test_lengths_and_counts_agree_with_the_manifest(corpus):
    """The manifest was counted by others: roads, geometries and kilometres of each file."""
    header, *rows = (corpus / "manifest.tsv").read_text().splitlines()
    names = header.split("\t")
    for row in rows:
        told = dict(zip(names, row.split("\t"), strict=True))
        path = corpus / told["file"]
        if told["set"] not in {"basic", "town"} or not path.exists():
            continue
        facts = facts_of(path)
        assert facts.roads + facts.left_out == int(told["roads"]), path
        assert facts.length == pytest.approx(float(told["road_len_m"]), rel=2e-3, abs=0.5), path
