"""Objects and signals beside the roads, placed in the road frame."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.frozen_model import Model
from envgen_usd.models.polygon_arrays import Polygons
from envgen_usd.models.road_objects import Origin, RoadObject
from envgen_usd.models.signals import Signal


@dataclass(frozen=True, repr=False, eq=False)
class Pose(Model):
    """Position and orientation of an object or a signal.

    Attributes:
        position: 3, metres, road frame.
        heading: Radians about z, counter-clockwise from +x.
        pitch: Radians about the rotated y; positive values lower +x.
        roll: Radians about the rotated x.
    """

    position: FloatArray
    heading: float
    pitch: float = 0.0
    roll: float = 0.0

    def matrix(self) -> FloatArray:
        """Returns the rotation (3 x 3, for column vectors) by heading, pitch and roll.

        The rotation axes are z, y' and x''.
        """
        (ch, cp, cr) = np.cos([self.heading, self.pitch, self.roll])
        (sh, sp, sr) = np.sin([self.heading, self.pitch, self.roll])
        about_z = np.array([[ch, -sh, 0], [sh, ch, 0], [0, 0, 1]])
        about_y = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
        about_x = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
        turned: FloatArray = about_z @ about_y @ about_x
        return turned

    def places(self, local: FloatArray) -> FloatArray:
        """Returns points (N x 3: u, v, z) of the object's frame in the road frame."""
        points: FloatArray = self.position + local @ self.matrix().T
        return points


@dataclass(frozen=True)
class SignalFace:
    """Face of a sign or a light, metres, to the millimetre.

    Attributes:
        shape: ``round``, ``triangle``, ``inverted_triangle``, ``octagon``, ``diamond``,
            ``square``, ``rectangle`` or ``cross``; empty for a light.
        width: Width of the face.
        height: Height of the face.
        lower_edge: Height of the face's lower edge above the foot of the post.
    """

    shape: str
    width: float
    height: float
    lower_edge: float


@dataclass(frozen=True)
class SignalRelations:
    """Lanes that a signal applies to, and its dependencies (14.2 to 14.4).

    Attributes:
        lanes: Ids of the lanes that the signal applies to, as in `LaneLine`.
        depends_on: Candidate ids of other signals: feature and patch of each. The map contains at
            most one of both.
    """

    lanes: tuple[str, ...] = ()
    depends_on: tuple[str, ...] = ()


@dataclass(frozen=True, repr=False, eq=False, kw_only=True)
class RoadFeature(Model):
    """An object or a signal beside a road.

    A feature has either a pose for an asset of its template, or parts with an explicit geometry.
    Coordinates lie on the grid `chunks.GRID`.

    Attributes:
        id: Unique and stable, an NCName, e.g. ``object_7_3_0``.
        road: OpenDRIVE id of the road to which s and t of the source refer.
        source: Object or signal of the file; an instance of a repeat with its interpolated values.
        kind: Kind of object or signal, e.g. ``tree``, ``guard_rail``, ``sign_post``, ``building``.
        template: Kind of asset, e.g. ``pole``; the cross-section of a barrier, e.g. ``jersey``.
        pose: Pose of the centre of the foot, +x is the front; `None` for a feature with parts.
        size: Metres along the feature's x, y and z; zero where unknown.
        parts: Faces by part: ``wall``, ``roof`` and ``ground`` of a building, ``body`` of others.
        origin: Place of the source in the file; `None` for a feature without a file.
    """

    id: str
    road: str
    source: RoadObject | Signal
    kind: str
    template: str
    pose: Pose | None
    size: tuple[float, float, float] = (0.0, 0.0, 0.0)
    parts: Mapping[str, Polygons] = field(default_factory=dict)
    origin: Origin | None = None

    def plan(self) -> FloatArray:
        """Returns the position, or all points of the parts, in plan, N x 2, metres."""
        if self.pose is not None:
            return self.pose.position[None, :2]
        return np.concatenate([part.points for part in self.parts.values()])[:, :2]


@dataclass(frozen=True, repr=False, eq=False, kw_only=True)
class SignalFeature(RoadFeature):
    """A sign or a light with its post.

    Attributes:
        source: Signal of the file.
        pose: Pose of the post's foot; +x is the viewing direction of the face.
        face: Face of the signal.
        relations: Lanes and other signals of the signal.
    """

    source: Signal
    pose: Pose
    face: SignalFace
    relations: SignalRelations = SignalRelations()
