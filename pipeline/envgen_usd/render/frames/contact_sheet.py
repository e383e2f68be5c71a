"""Draws what stands on a stage as a sheet of small pictures with names."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TypeAlias

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from envgen_usd.models.array_types import ByteArray, FloatArray
from envgen_usd.render.cameras.camera_pose import Pose, look_at
from envgen_usd.render.cameras.camera_rig import Camera
from envgen_usd.render.drawing.drawn_frame import FrameRequest
from envgen_usd.render.frames.image_files import write_png
from envgen_usd.render.opengl.gl_context import open_context
from envgen_usd.render.opengl.scene_tiles import pack
from envgen_usd.render.stage.stage_reader import open_stage, read_scene

Shown: TypeAlias = tuple[str, FloatArray, tuple[float, float, float]]
"""Name, bounding box (2 x 3, metres) and direction of the front (3)."""
CELL = 208
"""Side of a picture, pixels; a larger value shows more and draws longer."""
_FINER = 3
"""Drawn pixels along each side of a shown one; fewer break up bars of half a pixel."""
_TEXT = 30
"""Height of the names below a picture, pixels."""
_FONT = 12
_COLUMNS = 9
_FOCAL = 2.2
"""Focal length as a multiple of the picture's side; a larger value has less perspective."""
_FILL = 1.08
"""Distance of the camera as a multiple of what holds the sphere around a box; larger is smaller."""
_ASIDE, _ABOVE = np.radians(32.0), np.radians(14.0)
"""Angles from the front to the camera."""


def draw_contact_sheet(
    stage: Path,
    shown: Sequence[Shown],
    out: Path,
    progress: Callable[[str, int, int], None] = lambda _step, _done, _total: None,
) -> None:
    """Draws each exhibit of a stage by itself, in the light of the stage.

    Args:
        stage: USD file.
        shown: What the cells show, in their order.
        out: PNG file.
        progress: Called with the step's name, the parts done and the total.

    Raises:
        EnvgenError: The stage cannot be read, OpenGL is missing, or the file cannot be written.
    """
    scene = read_scene(open_stage(stage))
    side = CELL * _FINER
    middle = (side - 1) / 2
    camera = Camera(side, side, _FOCAL * side, _FOCAL * side, middle, middle, near=0.05)
    cells = []
    with open_context():
        # Binds the platform of OpenGL, which the context chooses.
        from envgen_usd.render.drawing.render_passes import FrameRenderer  # noqa: PLC0415

        renderer = FrameRenderer(scene, pack(scene), camera)
        for number, (name, box, front) in enumerate(shown):
            frame = renderer.draw(FrameRequest(_view(box, np.array(front)), scene.light))
            picture = Image.fromarray(frame.rgb).resize((CELL, CELL), Image.Resampling.BOX)
            cells.append((name, np.asarray(picture)))
            progress("draw variants", number + 1, len(shown))
    write_png(out, _sheet(cells))


def _view(box: FloatArray, front: FloatArray) -> Pose:
    """A view from the front, a bit from its left and from above, that just holds a box."""
    middle = box.mean(axis=0)
    side = np.cross((0.0, 0.0, 1.0), front)
    level = np.cos(_ASIDE) * front + np.sin(_ASIDE) * side
    towards = np.cos(_ABOVE) * level + np.sin(_ABOVE) * np.array([0.0, 0.0, 1.0])
    radius = float(np.linalg.norm(box[1] - box[0])) / 2
    return Pose(look_at(middle + towards * radius * 2.0 * _FOCAL * _FILL, middle))


def _sheet(cells: Sequence[tuple[str, ByteArray]]) -> ByteArray:
    """All cells with their names, H x W x 3."""
    columns = min(_COLUMNS, len(cells))
    rows = -(-len(cells) // columns)
    sheet = Image.new("RGB", (columns * CELL, rows * (CELL + _TEXT)), "white")
    draw, font = ImageDraw.Draw(sheet), ImageFont.load_default(_FONT)
    for number, (name, picture) in enumerate(cells):
        x, y = number % columns * CELL, number // columns * (CELL + _TEXT)
        sheet.paste(Image.fromarray(picture), (x, y))
        # The asset, and below it the variant.
        for line, text in enumerate(name.split(" ", 1)):
            draw.text((x + 3, y + CELL + 1 + line * (_FONT + 1)), text, "black", font)
    return np.asarray(sheet)
