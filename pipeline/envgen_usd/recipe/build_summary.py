"""What the manifest and the report say of a whole build: options, counts, issues of its chunks."""

from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import fields

from envgen_usd.errors import Issue
from envgen_usd.recipe.build_options import BuildOptions
from envgen_usd.recipe.unchanged_chunks import ChunkRecord

MOST_CHUNKS = 20
"""Chunks whose issues of a kind are listed; the others are counted."""


def option_values(options: BuildOptions) -> Mapping[str, object]:
    """The options in the manifest: those that affect the products."""
    left_out = {"out", "workers", "executor", "address"}
    values = {field.name: getattr(options, field.name) for field in fields(options)}
    values |= {"road": options.road.name, "city_offset": list(options.city_offset)}
    values |= {"osm": options.osm.name if options.osm else "", "bbox": list(options.bbox)}
    values |= {"lanelet2": options.lanelet2.name if options.lanelet2 else ""}
    return {
        name: value if isinstance(value, int | float | str | list) else str(value or "")
        for name, value in values.items()
        if name not in left_out
    }


def total_counts(records: Iterable[ChunkRecord]) -> Mapping[str, int]:
    """Number of features of each kind, by name, so that no order of chunks shows."""
    counts = Counter[str]()
    for record in records:
        counts.update(record.counts)
    return dict(sorted(counts.items()))


def bounded(issues: Iterable[Issue]) -> Iterator[Issue]:
    """Yields issues of chunks by kind and place; of each kind `MOST_CHUNKS`, and how many more."""
    by_kind: defaultdict[str, list[Issue]] = defaultdict(list)
    for issue in sorted(issues, key=lambda issue: (issue.kind, issue.where, issue.message)):
        by_kind[issue.kind].append(issue)
    for kind, of_kind in by_kind.items():
        yield from of_kind[:MOST_CHUNKS]
        if len(of_kind) > MOST_CHUNKS:
            text = f"{len(of_kind) - MOST_CHUNKS} more chunks with issues of this kind"
            yield Issue(kind, of_kind[0].severity, "chunks", text, of_kind[0].action)
