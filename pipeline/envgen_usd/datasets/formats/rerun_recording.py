"""A data set as a recording for the Rerun viewer (rerun.io)."""

from collections.abc import Callable, Iterator, Sequence
from importlib import import_module, util
from itertools import groupby
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from envgen_usd.datasets.formats.town_roads import SURFACES, read_town_roads
from envgen_usd.datasets.frame_files import FrameFiles
from envgen_usd.datasets.frame_scans import LidarFiles, lidars_of
from envgen_usd.errors import EnvgenError
from envgen_usd.label_taxonomy import label, labels
from envgen_usd.models.array_types import FloatArray
from envgen_usd.output_folder import STAGE_FILE
from envgen_usd.whole_files import whole_file

TIMELINE = "frame"
"""Timeline of a recording: the number of the frame in the data set."""
_APPLICATION = "envgen-usd"

Rerun: TypeAlias = Any
"""The module `rerun`, which is no dependency of the package."""


def open_rerun() -> Rerun:
    """Returns the module `rerun`.

    Raises:
        EnvgenError: It is not installed.
    """
    if util.find_spec("rerun") is None:
        remedy = "install it with `pip install 'envgen-usd[rerun]'`"
        raise EnvgenError(f"--rerun needs rerun-sdk; {remedy}")
    return import_module("rerun")


def check_recording(out: Path) -> None:
    """Checks that a recording can be written, before the work of a run.

    Raises:
        EnvgenError: rerun-sdk is missing, or the path cannot be that of a recording.
    """
    open_rerun()
    if out.suffix != ".rrd" or not out.absolute().parent.is_dir():
        raise EnvgenError(f"--rerun {out}: expected an .rrd file in a folder that exists")


def write_rerun(
    frames: Sequence[FrameFiles], out: Path, progress: Callable[[int, int], None]
) -> None:
    """Writes the frames of a data set one after another, each town with its roads.

    Entities are ``<town>/roads/<class>`` and ``<town>/<rig>/<camera>``, with ``rgb``, ``labels``,
    ``visible`` and ``full`` (boxes in the image) below a camera, and ``<town>/<rig>/objects``
    (boxes in the world), ``<town>/<rig>/<lidar>`` (points). A camera with a lens model has no
    projection in the viewer.

    Args:
        frames: Frames of the data set.
        out: The recording, an .rrd file.
        progress: Called with the frames done and their number.

    Raises:
        EnvgenError: rerun-sdk or a town is missing, or the file cannot be written.
    """
    rerun = open_rerun()
    frames = _in_moments(frames)
    recording = rerun.RecordingStream(_APPLICATION, recording_id=frames[0].root.resolve().name)
    # Frames have times of their own: those of writing would be in their way.
    recording.set_log_time_enabled(False)
    recording.set_log_tick_enabled(False)
    with whole_file(out, RuntimeError) as part:
        recording.save(str(part))
        recording.send_blueprint(_blueprint(frames))
        recording.log("/", _classes(rerun), static=True)
        for town in dict.fromkeys(each.frame.town for each in frames):
            _log_roads(rerun, recording, [f for f in frames if f.frame.town == town])
        done = 0
        for number, (_, shown) in enumerate(groupby(frames, _moment)):
            recording.set_time(TIMELINE, sequence=number)
            done += _log_moment(rerun, recording, list(shown))
            recording.flush()
            progress(done, len(frames))
        recording.disconnect()


def _in_moments(frames: Sequence[FrameFiles]) -> list[FrameFiles]:
    """Frames take by take, with all cameras of a moment beside each other."""
    takes = {_take(each): number for number, each in reversed(list(enumerate(frames)))}
    return sorted(frames, key=lambda each: (takes[_take(each)], each.frame.frame))


def _take(each: FrameFiles) -> str:
    return "/".join(each.frame.folder.split("/")[:3])


def _moment(each: FrameFiles) -> tuple[str, int]:
    return _take(each), each.frame.frame


def _rig_path(each: FrameFiles) -> list[str]:
    return [each.frame.town, each.frame.rig]


def _camera_path(each: FrameFiles) -> list[str]:
    return [*_rig_path(each), each.frame.camera]


def _classes(rerun: Rerun) -> Any:  # noqa: ANN401 - of rerun
    return rerun.AnnotationContext([(entry.id, entry.name, entry.colour) for entry in labels()])


def _blueprint(frames: Sequence[FrameFiles]) -> Any:  # noqa: ANN401 - of rerun
    """A tab for each town: the world, and the images of its cameras."""
    view = import_module("rerun.blueprint")
    tabs = []
    for town in dict.fromkeys(each.frame.town for each in frames):
        paths = dict.fromkeys("/".join(_camera_path(f)) for f in frames if f.frame.town == town)
        world = view.Spatial3DView(origin=town, name=town)
        images = [view.Spatial2DView(origin=path, name=path) for path in paths]
        tabs.append(view.Horizontal(world, view.Grid(*images), name=town))
    return view.Blueprint(view.Tabs(*tabs))


def _log_roads(rerun: Rerun, recording: Any, frames: Sequence[FrameFiles]) -> None:  # noqa: ANN401
    """Logs the roads of a town around its frames."""
    town = frames[0].frame.town
    places = np.array([each.frame.place for each in frames])
    roads = read_town_roads(frames[0].root / "towns" / town / STAGE_FILE, places)
    recording.log([town], rerun.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    for name in SURFACES:
        entry = label(name)
        corners = roads.corners[roads.classes == entry.id].reshape(-1, 3)
        if len(corners):
            points, indices = np.unique(corners, axis=0, return_inverse=True)
            mesh = rerun.Mesh3D(
                vertex_positions=points.astype(np.float32),
                triangle_indices=indices.reshape(-1, 3).astype(np.uint32),
                albedo_factor=entry.colour,
            )
            recording.log([town, "roads", name], mesh, static=True)


def _log_moment(rerun: Rerun, recording: Any, shown: Sequence[FrameFiles]) -> int:  # noqa: ANN401
    """Logs the images of all cameras; returns their number."""
    objects: dict[int, dict[str, Any]] = {}
    for each in shown:
        path = _camera_path(each)
        for name, content in _camera_content(rerun, each):
            recording.log([*path, name] if name else path, content)
        for row in _boxes(each):
            objects[row["instance"]] = row
    frame = shown[0].frame
    text = f"{frame.split}, {frame.weather or 'light of the stage'}, frame {frame.frame}"
    recording.log([*_rig_path(shown[0]), "take"], rerun.TextDocument(text))
    for lidar in lidars_of(shown[0]):
        _log_scan(rerun, recording, [*_rig_path(shown[0]), lidar.name], lidar, frame.frame)
    rows = [objects[value] for value in sorted(objects)]
    if rows:
        recording.log([*_rig_path(shown[0]), "objects"], _world_boxes(rerun, rows))
    return len(shown)


def _log_scan(
    rerun: Rerun,
    recording: Any,  # noqa: ANN401 - of rerun
    path: list[str],
    lidar: LidarFiles,
    number: int,
) -> None:
    """Logs the points of a lidar in the colours of their classes."""
    pose, scan = lidar.pose(number), lidar.read(number)
    recording.log(path, rerun.Transform3D(translation=pose[:3, 3], mat3x3=pose[:3, :3]))
    recording.log(path, rerun.Points3D(scan.points[:, :3], class_ids=scan.classes))


def _camera_content(rerun: Rerun, each: FrameFiles) -> Iterator[tuple[str, Any]]:
    """What a camera shows, with names below its entity."""
    camera = each.cameras["camera"]
    pose = np.array(each.pose_row["camera_to_world"], np.float64)
    yield "", rerun.Transform3D(translation=pose[:3, 3], mat3x3=pose[:3, :3])
    if not each.has_lens:
        yield (
            "",
            rerun.Pinhole(
                image_from_camera=_intrinsics(camera),
                resolution=(camera["width"], camera["height"]),
                camera_xyz=rerun.ViewCoordinates.RDF,
            ),
        )
    if each.rgb.is_file():
        content = each.rgb.read_bytes()
        yield "rgb", rerun.EncodedImage(contents=content, media_type="image/png")
    if (each.root / each.frame.file("semantic")).is_file():
        yield "labels", rerun.SegmentationImage(each.semantic, opacity=0.4)
    rows = _boxes(each)
    for kind in ("visible", "full") if rows else ():
        yield (
            kind,
            rerun.Boxes2D(
                array=[row[kind] for row in rows],
                array_format=rerun.Box2DFormat.XYXY,
                class_ids=[label(row["class"]).id for row in rows],
            ),
        )


def _intrinsics(camera: dict[str, Any]) -> FloatArray:
    """3 x 3; the viewer counts pixels from the corner of the first, not from its centre."""
    fx, fy, cx, cy = (float(camera[key]) for key in ("fx", "fy", "cx", "cy"))
    return np.array([(fx, 0.0, cx + 0.5), (0.0, fy, cy + 0.5), (0.0, 0.0, 1.0)])


def _boxes(each: FrameFiles) -> list[dict[str, Any]]:
    return each.boxes if (each.root / each.frame.file("boxes")).is_file() else []


def _world_boxes(rerun: Rerun, rows: Sequence[dict[str, Any]]) -> Any:  # noqa: ANN401 - of rerun
    boxes = [row["box_3d"] for row in rows]
    half = [box["yaw"] / 2.0 for box in boxes]
    turns = [rerun.Quaternion(xyzw=(0.0, 0.0, np.sin(a), np.cos(a))) for a in half]
    return rerun.Boxes3D(
        centers=[box["centre"] for box in boxes],
        half_sizes=[[side / 2.0 for side in box["size"]] for box in boxes],
        quaternions=turns,
        class_ids=[label(row["class"]).id for row in rows],
        labels=[str(row["instance"]) for row in rows],
        show_labels=False,
    )
