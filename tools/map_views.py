"""Sets frames of a real place beside its map, for renders/gallery.

    python tools/map_views.py BUILD EXTRACT FRAMES NAME NUMBER [NUMBER ...] --out renders/gallery

BUILD is the folder of `build --osm EXTRACT`, FRAMES that of `render`. Each picture is a JPEG file,
`NAME_NUMBER.jpg`: the frame, and 150 m of the map around the camera, north up, which looks along
the arrow. The map is drawn from the extract alone.
"""

import argparse
import json
from pathlib import Path

import numpy as np
import osmium
import shapely
from osmium.osm import Area, Node, Way
from PIL import Image, ImageDraw
from pyproj import Transformer

from envgen_usd.recipe.map_land import read_road

REACH = 75.0
"""Metres of the map on each side of the camera."""
HEIGHT, QUALITY = 300, 80
"""Height of the picture in pixels, and its quality."""
SCALE = 3
"""Pixels of the map's drawing for each stored one."""
AREAS = {"landuse": "#e6ead6", "natural": "#cfe3bf", "leisure": "#cfe8c4", "building": "#c9b9a8"}
WAYS = {
    "primary": ("#f4c78a", 14.0),
    "secondary": ("#f6e29a", 11.0),
    "tertiary": ("#ffffff", 9.0),
    "residential": ("#ffffff", 7.0),
    "service": ("#ffffff", 3.5),
    "footway": ("#f0a8a0", 1.0),
    "cycleway": ("#9fb6f2", 1.0),
}
LINES = {"barrier": "#8a6d4f", "railway": "#777777"}


class MapDrawing:
    """The map around a place."""

    def __init__(self, extract: Path, crs: str) -> None:
        """Reads shapes of the extract into a reference system."""
        move = Transformer.from_crs(4326, crs, always_xy=True).transform
        factory = osmium.geom.WKBFactory()
        self.areas: list[tuple[str, shapely.Geometry]] = []
        self.lines: list[tuple[str, float, shapely.Geometry]] = []
        self.trees: list[tuple[float, float]] = []

        def metric(shape: shapely.Geometry) -> shapely.Geometry:
            return shapely.transform(shape, lambda p: np.column_stack(move(*p.T)))

        for item in osmium.FileProcessor(str(extract)).with_areas():
            tags = {tag.k: tag.v for tag in item.tags}
            if isinstance(item, Area):
                key = next((key for key in AREAS if key in tags), "")
                if key:
                    shape = metric(shapely.from_wkb(factory.create_multipolygon(item)))
                    self.areas.append((AREAS[key], shape))
            elif isinstance(item, Node) and tags.get("natural") == "tree":
                self.trees.append(move(item.location.lon, item.location.lat))
            elif isinstance(item, Way):
                colour, width = WAYS.get(tags.get("highway", ""), ("", 0.0))
                colour = colour or next((LINES[key] for key in LINES if key in tags), "")
                nodes = [n.location for n in item.nodes if n.location.valid()]
                if colour and len(nodes) > 1:
                    line = shapely.LineString([(n.lon, n.lat) for n in nodes])
                    self.lines.append((colour, width or 0.8, metric(line)))
        order = list(AREAS.values())
        self.areas.sort(key=lambda each: order.index(each[0]))
        self.lines.sort(key=lambda each: each[1])

    def picture(self, middle: np.ndarray, ahead: np.ndarray) -> Image.Image:
        """The map with the camera in its middle."""
        size = HEIGHT * SCALE
        scale = size / (2.0 * REACH)
        image = Image.new("RGB", (size, size), "#f2efe9")
        draw = ImageDraw.Draw(image)
        box = shapely.box(*(middle - REACH), *(middle + REACH))

        def pixels(points: np.ndarray) -> list[tuple[float, float]]:
            at = (points - middle) * scale * [1.0, -1.0] + size / 2.0
            return [(x, y) for x, y in at.tolist()]

        for colour, shape in self.areas:
            for part in shapely.get_parts(shapely.intersection(shapely.make_valid(shape), box)):
                if part.geom_type == "Polygon" and not part.is_empty:
                    line = "#a08f80" if colour == AREAS["building"] else None
                    draw.polygon(pixels(shapely.get_coordinates(part.exterior)), colour, line)
        for colour, width, line in self.lines:
            for part in shapely.get_parts(shapely.intersection(line, box)):
                if part.geom_type == "LineString" and not part.is_empty:
                    at = pixels(shapely.get_coordinates(part))
                    draw.line(at, colour, max(int(width * scale), 2), joint="curve")
        for x, y in pixels(np.array(self.trees).reshape(-1, 2)):
            draw.ellipse((x - 6, y - 6, x + 6, y + 6), "#6aa84f")
        tip = middle + 18.0 * ahead
        left = np.array([-ahead[1], ahead[0]])
        wing = [middle + 6.0 * left, middle - 6.0 * left]
        draw.polygon(pixels(np.array([tip, *wing])), "#d01c1c")
        return image.resize((HEIGHT, HEIGHT), Image.Resampling.LANCZOS)


def main() -> None:
    """Writes the pictures."""
    parser = argparse.ArgumentParser(description=__doc__)
    for name in ("build", "extract", "frames"):
        parser.add_argument(name, type=Path)
    parser.add_argument("name")
    parser.add_argument("numbers", type=int, nargs="+")
    parser.add_argument("--out", type=Path, required=True)
    chosen = parser.parse_args()
    _, surface = read_road(chosen.build / "road.xodr", 0.02)
    drawing = MapDrawing(chosen.extract, surface.crs)
    frames = json.loads((chosen.frames / "cameras.json").read_text("utf-8"))["frames"]
    for frame in frames:
        if frame["frame"] not in chosen.numbers:
            continue
        pose = np.array(frame["camera_to_world"])
        ahead = pose[:2, 2] / np.hypot(*pose[:2, 2])
        beside = drawing.picture(pose[:2, 3], ahead)
        view = Image.open(chosen.frames / "rgb" / f"{frame['frame']:06d}.png").convert("RGB")
        view = view.resize((round(view.width * HEIGHT / view.height), HEIGHT))
        both = Image.new("RGB", (view.width + HEIGHT + 4, HEIGHT), "white")
        both.paste(view, (0, 0))
        both.paste(beside, (view.width + 4, 0))
        path = chosen.out / f"{chosen.name}_{frame['frame']}.jpg"
        both.save(path, quality=QUALITY, optimize=True)


if __name__ == "__main__":
    main()
