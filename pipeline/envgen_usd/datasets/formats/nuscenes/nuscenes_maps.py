"""Maps of nuScenes: where roads and sidewalks are, as pictures."""

from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image
from rasterio.features import rasterize
from rasterio.transform import Affine
from shapely import polygons

from envgen_usd.datasets.formats.nuscenes.nuscenes_scenes import Scene, take_of
from envgen_usd.datasets.formats.nuscenes.nuscenes_tables import token, write_table
from envgen_usd.datasets.formats.town_roads import TownRoads, read_town_roads
from envgen_usd.models.array_types import ByteArray, FloatArray
from envgen_usd.output_folder import STAGE_FILE
from envgen_usd.whole_files import make_folder, whole_file

_PIXEL = 0.1
"""Side of a pixel of a map, metres; nuScenes' readers know no other."""


def write_maps(scenes: Sequence[Scene], out: Path, tables: Path) -> dict[str, FloatArray]:
    """Writes the map of each town; returns x and y of the origins on the stages."""
    root = scenes[0].first.root
    by_town: defaultdict[str, list[Scene]] = defaultdict(list)
    for scene in scenes:
        by_town[scene.first.frame.town].append(scene)
    make_folder(out / "maps")
    origins, rows = {}, []
    for town, those in by_town.items():
        places = np.array([each.lead.frame.place for scene in those for each in scene.samples])
        surface = read_town_roads(root / "towns" / town / STAGE_FILE, places)
        origins[town] = np.floor(surface.low)
        mark = token("map", town)
        with whole_file(out / "maps" / f"{mark}.png") as part:
            Image.fromarray(road_mask(surface, origins[town])).save(part, "PNG")
        logs = sorted({token("log", take_of(scene.first)) for scene in those})
        rows.append(
            {
                "token": mark,
                "log_tokens": logs,
                "category": "semantic_prior",
                "filename": f"maps/{mark}.png",
                "stage_origin": origins[town].tolist(),
            }
        )
    write_table(tables, "map", rows)
    return origins


def road_mask(surface: TownRoads, origin: FloatArray) -> ByteArray:
    """Pixels of roads and sidewalks: 255, others 0; the last row begins at the origin.

    Args:
        surface: Triangles of the roads.
        origin: x and y of the lower left corner, metres.
    """
    plan = surface.corners[..., :2] - origin
    if not len(plan):
        return np.zeros((1, 1), np.uint8)
    columns, rows = np.ceil(plan.max(axis=(0, 1)) / _PIXEL).astype(int).tolist()
    place = Affine(_PIXEL, 0.0, 0.0, 0.0, -_PIXEL, rows * _PIXEL)
    shapes = polygons(plan[np.linalg.det(plan[:, 1:] - plan[:, :1]) != 0.0])
    mask: ByteArray = rasterize(
        ((shape, 255) for shape in shapes),
        out_shape=(max(rows, 1), max(columns, 1)),
        transform=place,
        dtype="uint8",
    )
    return mask
