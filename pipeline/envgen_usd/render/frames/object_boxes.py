"""Boxes of the objects in a frame: in the image and in the world."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import find_objects
from scipy.spatial import ConvexHull, QhullError

from envgen_usd.label_taxonomy import labels
from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.render.cameras.camera_pose import Pose
from envgen_usd.render.cameras.camera_rig import Camera
from envgen_usd.render.cameras.lens_models import Pinhole
from envgen_usd.render.frames.label_images import INSTANCE_FACTOR, LabelImages, LabelPainter
from envgen_usd.render.frames.lens_outlines import Hull, hull_of, lens_box
from envgen_usd.render.frames.moving_boxes import MovingBoxes
from envgen_usd.render.render_scene import Moment, Scene

Box: TypeAlias = tuple[float, float, float, float]
"""Left, top, right and bottom, pixels."""


@dataclass(frozen=True)
class WorldBox:
    """The upright box around an object: of least area in plan, or along the axes of what moves.

    Attributes:
        centre: x, y, z, metres.
        size: Length, width and height, metres. The width is at most the length, unless the object
            moves on the stage: then the length lies along its x axis.
        yaw: Angle of the length counter-clockwise from x, radians, above -pi / 2 up to pi / 2; of
            what moves, from -pi to pi.
    """

    centre: tuple[float, float, float]
    size: tuple[float, float, float]
    yaw: float


@dataclass(frozen=True)
class ObjectBox:
    """The boxes of an object that a frame shows.

    Image boxes are left, top, right, bottom in pixels; the image is 0 to its width and height, so
    that the centre of the first pixel is at 0.5, as in COCO.

    Attributes:
        instance: Value in the instance image.
        label: Name of the class.
        path: Prim path.
        pixels: Number of visible pixels.
        visible: Image box of the visible pixels.
        full: Image box of the whole object, also of what is hidden or beyond the image; with a
            lens model, of what lies in the field of the lens.
        truncation: Share of `full` beyond the image.
        occlusion: Share of the pixels within the image that something else hides.
        box: Box in the world.
        velocity: Metres a second along x, y and z, of an object that moves on the stage; `None` for
            what never does.
    """

    instance: int
    label: str
    path: str
    pixels: int
    visible: tuple[int, int, int, int]
    full: Box
    truncation: float
    occlusion: float
    box: WorldBox
    velocity: tuple[float, float, float] | None = None

    def record(self) -> dict[str, Any]:
        """The boxes for JSON, to a millimetre and a hundredth of a pixel."""
        figures = asdict(self)
        name = figures.pop("label")
        box = figures.pop("box")
        if figures["velocity"] is None:
            del figures["velocity"]
        else:
            figures["velocity"] = [round(value, 3) for value in figures["velocity"]]
        figures["full"] = [round(value, 2) for value in self.full]
        figures["truncation"], figures["occlusion"] = (
            round(self.truncation, 4),
            round(self.occlusion, 4),
        )
        rounded = {key: [round(each, 3) for each in box[key]] for key in ("centre", "size")}
        return {"class": name, **figures, "box_3d": {**rounded, "yaw": round(self.box.yaw, 5)}}


class ObjectBoxes:
    """Finds the boxes of what frames of a place show."""

    def __init__(self, scene: Scene, painter: LabelPainter, camera: Camera) -> None:
        """Notes the placements of each object.

        Args:
            scene: The geometry around the place.
            painter: Instance values of the scene objects.
            camera: The camera, with any lens.
        """
        self._scene, self._painter, self._camera = scene, painter, camera
        self._names = {entry.id: entry.name for entry in labels()}
        self._hulls: dict[int, Hull] = {}
        detailed = [n for n, use in enumerate(scene.uses) if use.level is None or not use.level.far]
        values = [painter.values[scene.uses[n].scene_objects] for n in detailed]
        rows = [np.arange(len(each)) for each in values]
        of_use = np.repeat(detailed, [len(each) for each in values])
        every = np.concatenate(values) if values else np.empty(0, np.uint32)
        order = np.argsort(every, kind="stable")
        self._values, self._uses = every[order], of_use[order]
        self._rows = np.concatenate(rows)[order] if rows else np.empty(0, np.int64)
        self._moving = MovingBoxes(scene.moving, painter) if scene.moving else None

    def boxes(
        self,
        pose: Pose,
        images: LabelImages,
        silhouettes: Callable[[NDArray[np.uint32]], IntArray],
        moments: tuple[Moment, Moment] | None = None,
    ) -> list[ObjectBox]:
        """Boxes of all instances of a frame, by instance value.

        Args:
            pose: Pose of the camera.
            images: Labels of the frame.
            silhouettes: Counts the pixels of objects alone; see `FrameDrawing.silhouettes`.
            moments: Moment of the frame, and one beside it, which gives the velocities; `None` if
                nothing moves.
        """
        shown = np.array(sorted(images.objects), np.uint32)
        if not len(shown):
            return []
        place = np.searchsorted(shown, self._painter.values)
        known = shown[np.minimum(place, len(shown) - 1)] == self._painter.values
        whole = silhouettes(np.where(known, place + 1, 0).astype(np.uint32))
        numbers = np.searchsorted(shown, images.instance) + 1
        numbers[~np.isin(images.instance, shown)] = 0
        pixels = np.bincount(numbers.reshape(-1), minlength=len(shown) + 1)[1:]
        boxes = []
        for number, (value, slices) in enumerate(
            zip(shown.tolist(), find_objects(numbers), strict=True)
        ):
            (rows, columns), count = slices, int(pixels[number])
            visible = columns.start, rows.start, columns.stop, rows.stop
            moved = self._moving.object_at(value, *moments) if self._moving and moments else None
            parts = [*self._parts(value), *(moved.parts if moved else ())]
            points = np.concatenate([part.corners for part in parts])
            full = _with_visible(self._full_box(pose, parts, visible), visible)
            boxes.append(
                ObjectBox(
                    instance=value,
                    label=self._names[value // INSTANCE_FACTOR],
                    path=images.objects[value],
                    pixels=count,
                    visible=visible,
                    full=full,
                    truncation=_truncation(full, self._camera),
                    occlusion=max(0.0, 1.0 - count / max(int(whole[number]), count)),
                    box=box_along(points, moved.heading) if moved else world_box(points),
                    velocity=moved.velocity if moved else None,
                )
            )
        return boxes

    def _full_box(self, pose: Pose, parts: Sequence[Hull], visible: Box) -> Box:
        """Image box of a whole object."""
        if isinstance(self._camera.lens, Pinhole):
            return image_box(self._camera, pose, [part.corners for part in parts])
        box, whole = lens_box(self._camera, pose, parts)
        if box is None:
            return visible
        if whole:
            return box
        # The border of the field is part of the outline, too.
        left, top = min(box[0], visible[0]), min(box[1], visible[1])
        return left, top, max(box[2], visible[2]), max(box[3], visible[3])

    def _parts(self, value: int) -> Iterator[Hull]:
        """Convex hull of each part of an object in the world, metres."""
        first, last = np.searchsorted(self._values, (value, value + 1))
        for use, row in zip(self._uses[first:last], self._rows[first:last], strict=True):
            placed = self._scene.uses[use]
            yield self._hull(placed.geometry).placed(placed.matrices[row])

    def _hull(self, number: int) -> Hull:
        if number not in self._hulls:
            self._hulls[number] = hull_of(self._scene.geometries[number])
        return self._hulls[number]


def image_box(camera: Camera, pose: Pose, parts: Sequence[FloatArray]) -> Box:
    """Left, top, right and bottom of convex parts, each N x 3 (world), in the image.

    What lies behind the near plane is cut off.
    """
    eye, axes = pose.matrix[:3, 3], pose.matrix[:3, :3]
    seen = [each for part in parts if len(each := _before((part - eye) @ axes, camera.near))]
    points = np.concatenate(seen)
    x = camera.fx * points[:, 0] / points[:, 2] + camera.cx + 0.5
    y = camera.fy * points[:, 1] / points[:, 2] + camera.cy + 0.5
    return float(x.min()), float(y.min()), float(x.max()), float(y.max())


def _before(points: FloatArray, near: float) -> FloatArray:
    """Corners of a convex part (N x 3, camera space) that is cut at the near plane.

    The cut's corners are among the points where the lines between corners meet the plane.
    """
    ahead = points[:, 2] >= near
    front, back = points[ahead], points[~ahead]
    if not len(front) or not len(back):
        return front
    share = (front[:, None, 2] - near) / (front[:, None, 2] - back[None, :, 2])
    cut = front[:, None] + share[..., None] * (back[None] - front[:, None])
    cut[..., 2] = near
    return np.concatenate((front, cut.reshape(-1, 3)))


def box_along(points: FloatArray, heading: float) -> WorldBox:
    """The upright box around points (N x 3) whose length lies along a heading, radians."""
    axes = np.array([(np.cos(heading), np.sin(heading)), (-np.sin(heading), np.cos(heading))])
    local = np.column_stack((points[:, :2] @ axes.T, points[:, 2]))
    low, high = local.min(axis=0), local.max(axis=0)
    x, y = ((low + high)[:2] / 2.0 @ axes).tolist()
    length, width, height = (high - low).tolist()
    return WorldBox((x, y, float(low[2] + high[2]) / 2.0), (length, width, height), heading)


def _with_visible(full: Box, visible: tuple[int, int, int, int]) -> Box:
    """A box that holds the centre of every visible pixel.

    Simple meshes for the distance reach farther than the detailed ones, of which boxes are.
    """
    left, top, right, bottom = visible
    return (
        min(full[0], left + 0.5),
        min(full[1], top + 0.5),
        max(full[2], right - 0.5),
        max(full[3], bottom - 0.5),
    )


def _truncation(full: Box, camera: Camera) -> float:
    left, top, right, bottom = full
    wide = max(min(right, camera.width) - max(left, 0.0), 0.0)
    high = max(min(bottom, camera.height) - max(top, 0.0), 0.0)
    area = (right - left) * (bottom - top)
    return 1.0 - wide * high / area if area > 0.0 else 0.0


def world_box(points: FloatArray) -> WorldBox:
    """The upright box of least area in plan around points (N x 3).

    A side of the least rectangle lies on an edge of the convex hull (Freeman and Shapira 1975).
    """
    plan = points[:, :2]
    try:
        corners = plan[ConvexHull(plan).vertices]
    except QhullError:  # all points are on a line
        corners = plan[np.lexsort(plan.T)[[0, -1]]]
    edges = np.roll(corners, -1, axis=0) - corners
    angles = np.unique(np.round(np.arctan2(edges[:, 1], edges[:, 0]) % (np.pi / 2.0), 9))
    cos, sin = np.cos(angles), np.sin(angles)
    along = np.outer(cos, corners[:, 0]) + np.outer(sin, corners[:, 1])
    across = np.outer(cos, corners[:, 1]) - np.outer(sin, corners[:, 0])
    areas = np.ptp(along, axis=1) * np.ptp(across, axis=1)
    best = int(np.argmin(np.round(areas, 9)))
    middle = [(each[best].min() + each[best].max()) / 2.0 for each in (along, across)]
    length, width = float(np.ptp(along[best])), float(np.ptp(across[best]))
    yaw = float(angles[best])
    x, y = (
        cos[best] * middle[0] - sin[best] * middle[1],
        sin[best] * middle[0] + cos[best] * middle[1],
    )
    if width > length:
        length, width, yaw = width, length, yaw - np.pi / 2.0
    if yaw <= -np.pi / 2.0:
        yaw += np.pi
    low, high = float(points[:, 2].min()), float(points[:, 2].max())
    return WorldBox((float(x), float(y), (low + high) / 2.0), (length, width, high - low), yaw)
