"""Ways of OpenStreetMap extracts that a cut has broken, and the issues about what is incomplete."""

from collections.abc import Mapping, Sequence
from itertools import groupby
from pathlib import Path

import shapely
from osmium.osm import Way

from envgen_usd.errors import Issue, Severity


def known_lines(way: Way) -> tuple[list[shapely.LineString], bool]:
    """The runs of a way's nodes that the extract holds, in degrees; True if all nodes are there."""
    nodes = [(node.location.valid(), node) for node in way.nodes]
    runs = [list(run) for known, run in groupby(nodes, lambda each: each[0]) if known]
    places = [[(node.location.lon, node.location.lat) for _, node in run] for run in runs]
    lines = [shapely.LineString(run) for run in places if len(set(run)) > 1]
    return lines, all(known for known, _ in nodes)


def incomplete_issues(
    path: Path, found: Mapping[str, Sequence[int]], actions: Mapping[str, str]
) -> tuple[Issue, ...]:
    """An issue for each kind of incomplete object.

    Args:
        path: The extract.
        found: Ids of the incomplete objects of each kind.
        actions: What was done about each kind.
    """
    return tuple(
        Issue(
            f"osm.incomplete_{kind}",
            Severity.WARNING,
            f"{path.name}: {kind} {ids[0]}",
            f"{len(ids)} of these objects refer to nodes or ways that the extract lacks",
            actions[kind],
        )
        for kind, ids in found.items()
        if ids
    )
