"""Cameras: intrinsics from a rig file, projection matrices, poses along a route."""

import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import MISSING, dataclass, fields
from importlib import resources
from itertools import count, islice
from pathlib import Path

import numpy as np

from envgen_usd.errors import EnvgenError
from envgen_usd.models.arrays import FloatArray
from envgen_usd.render.lanes import routes
from envgen_usd.render.scene import Lane

DEFAULT_RIG = "kitti_360"
MOST_PIXELS = 16384
"""Width and height that images may have at most; what OpenGL implementations draw to."""
_WHEELBASE = 2.7
"""Axle distance over which the car takes its heading and pitch from the road, metres."""
_END_MARGIN = 15.0
"""Distance that is kept to the end of a route, metres."""
_GRID = 4096.0
"""Cameras stand on a grid of 1 / 4096 m, on which meshes are too: differences are exact."""


@dataclass(frozen=True)
class Camera:
    """A pinhole camera as in OpenCV: x right, y down, z ahead; pixel centres are whole numbers.

    Attributes:
        width: Pixels.
        height: Pixels.
        fx: Focal length, pixels.
        fy: The same along the rows.
        cx: Column of the optical axis.
        cy: Row of the optical axis.
        mount: Height above the lane, metres.
        near: Nothing nearer is seen, metres along the optical axis; there is no far limit.
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    mount: float = 1.55
    near: float = 0.3

    def clip_matrix(self) -> FloatArray:
        """From the camera's space to clip space, depth reversed (near at 1, infinity at 0).

        The row of an image grows downwards and clip space's y upwards.
        """
        ahead_x = (2.0 * self.cx + 1.0) / self.width - 1.0
        ahead_y = 1.0 - (2.0 * self.cy + 1.0) / self.height
        return np.array(
            [
                [2.0 * self.fx / self.width, 0.0, ahead_x, 0.0],
                [0.0, -2.0 * self.fy / self.height, ahead_y, 0.0],
                [0.0, 0.0, 0.0, self.near],
                [0.0, 0.0, 1.0, 0.0],
            ]
        )

    def lens_uniforms(self) -> dict[str, tuple[float, ...]]:
        """The lens as the shaders that cover the screen take it."""
        return {
            "lens": (self.fx, self.fy, self.cx, self.cy),
            "image_size": (float(self.width), float(self.height)),
        }


@dataclass(frozen=True)
class Pose:
    """Where a camera is.

    Attributes:
        matrix: 4 x 4, from the camera's space to the world (metres, z up).
        route: Frames of one drive share a number.
        turn: How often all lanes had been driven before.
    """

    matrix: FloatArray
    route: int = 0
    turn: int = 0


def read_rig(name: str = DEFAULT_RIG) -> Camera:
    """Reads a rig: one of the package's, by name, or a TOML file.

    Raises:
        EnvgenError: If there is no such rig, or if its file lacks a value or holds another.
    """
    folder = resources.files("envgen_usd.renders") / "rigs"
    path = Path(name) if name.endswith(".toml") else folder / f"{name}.toml"
    if not path.is_file():
        known = ", ".join(sorted(f.name.removesuffix(".toml") for f in folder.iterdir()))
        raise EnvgenError(f"render: there is no rig {name}; known: {known}, or a .toml file")
    try:
        data = tomllib.loads(path.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise EnvgenError(f"render: rig {name} cannot be read as TOML: {error}") from error
    return _camera(data.get("camera"), name)


def _camera(table: object, name: str) -> Camera:
    """Makes a camera from the table of a rig file, or says what does not fit."""
    if not isinstance(table, dict):
        raise EnvgenError(f"render: rig {name}: missing the table [camera]")
    known = {field.name: field for field in fields(Camera)}
    missing = [key for key, field in known.items() if field.default is MISSING and key not in table]
    unknown = [key for key in table if key not in known]
    wrong = [
        f"{key} = {value!r}"
        for key, value in table.items()
        if key in known and not _fits(key, value)
    ]
    faults = [f"missing {', '.join(missing)}"] if missing else []
    faults += [f"unknown {', '.join(unknown)}; known: {', '.join(known)}"] if unknown else []
    faults += [f"not usable: {', '.join(wrong)}"] if wrong else []
    if faults:
        raise EnvgenError(f"render: rig {name}: [camera]: {'; '.join(faults)}")
    return Camera(**table)


def _fits(key: str, value: object) -> bool:
    """Whether a value of a rig file makes sense: pixels count, and lengths are above zero."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not np.isfinite(value):
        return False
    if key in {"width", "height"}:
        return isinstance(value, int) and 1 <= value <= MOST_PIXELS
    return key in {"cx", "cy", "mount"} or value > 0


def drive(
    lanes: Sequence[Lane], camera: Camera, frames: int, spacing: float, rng: np.random.Generator
) -> tuple[Pose, ...]:
    """Poses of a camera that drives along the lanes.

    Where all lanes have been driven and frames are missing, they are driven once more, on other
    ways, with stops that halve the gaps between the earlier ones; so no picture comes twice.

    Args:
        lanes: Centre lines in the direction of travel.
        camera: Gives the height above the lane.
        frames: Number of poses; none where there are no lanes.
        spacing: Metres between poses.
        rng: Draws where to start and which way to turn.
    """
    return tuple(islice(_drives(lanes, camera, spacing, rng), frames))


def _drives(
    lanes: Sequence[Lane], camera: Camera, spacing: float, rng: np.random.Generator
) -> Iterator[Pose]:
    numbers = count()
    for turn in count() if lanes else ():
        for way in routes(lanes, rng):
            number = next(numbers)
            for matrix in _along(way, camera, spacing, _halving(turn)):
                yield Pose(matrix, number, turn)


def _halving(number: int) -> float:
    """0, 1/2, 1/4, 3/4, 1/8, ...: the sequence of van der Corput."""
    return sum(int(digit) * 0.5**place for place, digit in enumerate(f"{number:b}"[::-1], 1))


def around(bounds: FloatArray, camera: Camera, frames: int) -> tuple[Pose, ...]:
    """Poses on a circle that looks at the middle of a stage without lanes, from outside."""
    middle, size = bounds.mean(axis=0), bounds[1] - bounds[0]
    reach = 0.75 * float(np.hypot(size[0], size[1])) + 2.0 * camera.near
    angles = 2.0 * np.pi * np.arange(frames) / max(frames, 1)
    ring = np.stack((np.cos(angles), np.sin(angles), np.full(frames, 0.5)), axis=1)
    eyes = middle + ring * (reach, reach, reach)
    return tuple(Pose(look_at(eye, middle)) for eye in eyes)


def look_at(eye: FloatArray, target: FloatArray) -> FloatArray:
    """Matrix (4 x 4) of a camera at `eye` that looks to `target` with a level horizon."""
    ahead = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(ahead, (0.0, 0.0, 1.0))
    right = right / np.linalg.norm(right) if np.linalg.norm(right) > 1e-9 else np.array([1, 0, 0])
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack((right, np.cross(ahead, right), ahead), axis=1)
    matrix[:3, 3] = np.round(eye * _GRID) / _GRID
    return matrix


def _along(way: FloatArray, camera: Camera, spacing: float, start: float) -> Iterator[FloatArray]:
    """Poses along a way, the first a share of the spacing behind its beginning."""
    steps = np.linalg.norm(np.diff(way, axis=0), axis=1)
    s = np.concatenate(([0.0], np.cumsum(steps)))
    first, last = _WHEELBASE / 2, max(s[-1] - _END_MARGIN, s[-1] / 2)
    first += start * min(spacing, max(last - first, 0.0))
    for at in np.arange(first, max(last, first + 1e-6), spacing):
        here, back, front = (_at(way, s, at + d) for d in (0.0, -_WHEELBASE / 2, _WHEELBASE / 2))
        eye = here + np.array([0.0, 0.0, camera.mount])
        yield look_at(eye, eye + (front - back))


def _at(way: FloatArray, s: FloatArray, at: float) -> FloatArray:
    return np.array([np.interp(at, s, way[:, axis]) for axis in range(3)])
