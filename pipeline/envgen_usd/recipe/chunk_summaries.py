"""What the stage and the index of the city say of a chunk; kept in the chunk's folder.

To open the layers of a chunk and to parse its city model takes 0.15 CPU seconds in a town. The
process that builds the chunk does so, once; the one that composes the stage reads the result.
"""

import json
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from envgen_usd.chunks import CITY_FILE
from envgen_usd.citygml.city_index import IndexEntry, read_entry
from envgen_usd.layers.payload_roots import PayloadFile, PayloadRoot, read_payload
from envgen_usd.models.city_model import City
from envgen_usd.whole_files import write_whole

SUMMARY = "summary.json"
"""File of a chunk with what is said of its layers and its city model."""


def write_summary(folder: Path, city: City) -> None:
    """Writes the summary of a chunk.

    Args:
        folder: Folder of the chunk with its layers and its city model.
        city: What its city model holds.

    Raises:
        EnvgenError: A file is missing or cannot be read.
    """
    layers = {path.name: read_payload(path) for path in sorted(folder.glob("*.usdc"))}
    entry = read_entry(folder / CITY_FILE, [feature.id for feature in city.objects])
    summary = {
        "layers": {name: _payload_values(payload) for name, payload in layers.items()},
        "city": vars(entry),
    }
    write_whole(folder / SUMMARY, json.dumps(summary) + "\n")


def kept_payload(path: Path) -> PayloadFile:
    """What a summary says of a layer of its chunk; see `read_payload`."""
    values = _summary(path.parent)["layers"][path.name]
    roots = (
        PayloadRoot(name, default, type_name, kind, tuple(np.array(box) for box in boxes))
        for name, default, type_name, kind, boxes in values["roots"]
    )
    materials, references = frozenset(values["materials"]), frozenset(values["references"])
    return PayloadFile(tuple(roots), materials, references)


def kept_entry(path: Path) -> IndexEntry:
    """What a summary says of the city model of its chunk; see `read_entry`."""
    return IndexEntry(**_summary(path.parent)["city"])


@lru_cache(maxsize=1)
def _summary(folder: Path) -> Mapping[str, Any]:
    """The summary of a chunk; its layers are asked for one after another."""
    values: Mapping[str, Any] = json.loads((folder / SUMMARY).read_text("utf-8"))
    return values


def _payload_values(payload: PayloadFile) -> dict[str, object]:
    roots = [
        [root.name, root.default, root.type_name, root.kind, [box.tolist() for box in root.extents]]
        for root in payload.roots
    ]
    materials, references = sorted(payload.materials), sorted(payload.references)
    return {"roots": roots, "materials": materials, "references": references}
