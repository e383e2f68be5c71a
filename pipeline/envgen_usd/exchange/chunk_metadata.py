"""Metadata of a chunk without geometry, for simulators that place assets of their own."""

import json
from typing import Any

import numpy as np

from envgen_usd.exchange.gltf.y_up import poses_of, turned
from envgen_usd.exchange.stage_chunks import StageChunk


def metadata_text(chunk: StageChunk, facts: dict[str, Any]) -> str:
    """A chunk's objects as JSON: facts, pose and size, in the frame of the chunk's glTF file.

    Args:
        chunk: The chunk.
        facts: Further facts of the file.
    """
    objects = list(chunk.objects.values())
    poses = poses_of(np.array([each.matrix for each in objects]).reshape(-1, 4, 4))
    records = []
    columns = zip(
        objects,
        poses.translations.tolist(),
        poses.rotations.tolist(),
        poses.scales.tolist(),
        poses.are_exact.tolist(),
        strict=True,
    )
    for each, translation, rotation, scale, exact in columns:
        record = {**each.facts(), "layer": each.layer, "translation": translation}
        if exact:
            record |= {"rotation": rotation, "scale": scale}
        else:
            record["matrix"] = each.matrix.tolist()
        records.append(record)
    content = {
        **facts,
        "chunk": chunk.name,
        "origin": chunk.origin.tolist(),
        "offset": turned(chunk.origin[None])[0].tolist(),
        "axes": "y up, metres, relative to the offset; matrices and the origin have z up",
        "objects": records,
    }
    return json.dumps(content, indent=1, allow_nan=False) + "\n"
