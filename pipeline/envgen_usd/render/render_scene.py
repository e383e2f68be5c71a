"""The scene to render, read from a stage once: geometry, looks, labels, light, lanes.

World coordinates are metres, z up, right-handed, double precision, whatever the units of the stage.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from envgen_usd.errors import Issue
from envgen_usd.models.array_types import BoolArray, ByteArray, FloatArray, IntArray
from envgen_usd.models.atmosphere import Atmosphere

Floats = NDArray[np.float32]
Indices = NDArray[np.uint32]


def extent(points: NDArray[Any]) -> tuple[FloatArray, FloatArray]:
    """Minimum and maximum of each column; faster than reducing long, thin arrays by rows."""
    columns = points.T
    low = np.array([column.min() for column in columns], np.float64)
    return low, np.array([column.max() for column in columns], np.float64)


@dataclass(frozen=True)
class Texture:
    """A texture image (UsdUVTexture).

    Attributes:
        path: Resolved path of the image, perhaps inside a package (``a.usdz[b.png]``).
        srgb: True if its values are sRGB-encoded colours.
        repeat: Wrap modes along s and t; False clamps.
        channel: Channel of a single-valued input, 0 to 3.
        scale: 4, factors of the values.
        bias: 4, offsets of the scaled values.
    """

    path: str
    srgb: bool
    repeat: tuple[bool, bool] = (True, True)
    channel: int = 0
    scale: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    bias: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Bombing:
    """Random patches of a texture in place of its repeats.

    Attributes:
        side: Distance of the patches, repeats of the texture; 0 for none.
        turn: Largest turn of a patch, radians.
        unit: Brick that no patch divides, share of the texture along s and t; 0 for any shift.
        bond: Shift of every second course, share of a brick.
    """

    side: float = 0.0
    turn: float = 0.0
    unit: tuple[float, float] = (0.0, 0.0)
    bond: float = 0.0


@dataclass(frozen=True)
class Wear:
    """How much use and weather show on a surface; each figure is 0 to 1.

    Attributes:
        lanes: Tyre tracks, repairs, manholes and cracks along lanes.
        stains: Spots on the ground.
        foot: Dirt above the foot of walls.
        streaks: Streaks and soot on walls.
        paint: Share of road paint that traffic takes off.
    """

    lanes: float = 0.0
    stains: float = 0.0
    foot: float = 0.0
    streaks: float = 0.0
    paint: float = 0.0


@dataclass(frozen=True)
class Material:
    """A UsdPreviewSurface.

    Attributes:
        diffuse: Linear RGB; ignored with a texture.
        emissive: Linear RGB; multiplies its texture.
        roughness: 0 (mirror) to 1.
        metallic: 0 to 1.
        opacity: 0 to 1.
        opacity_threshold: Fragments of lower opacity are discarded; 0 disables the test.
        textures: By input name: ``diffuse``, ``emissive``, ``normal``, ``roughness``, ``opacity``.
        vertex_colour: True if the colour comes from the mesh (``primvars:displayColor``).
        uv_name: Primvar with the texture coordinates.
        uv_transform: 2 x 3, from the primvar's coordinates to the texture's.
        size: Side length of the textures, metres.
        bombing: Patches of the textures.
        wear: Use and weather.
        tinted: True if the mesh's ``primvars:displayColor`` multiplies the colour.
    """

    diffuse: tuple[float, float, float] = (0.18, 0.18, 0.18)
    emissive: tuple[float, float, float] = (0.0, 0.0, 0.0)
    roughness: float = 0.5
    metallic: float = 0.0
    opacity: float = 1.0
    opacity_threshold: float = 0.0
    textures: Mapping[str, Texture] = field(default_factory=dict)
    vertex_colour: bool = False
    uv_name: str = "st"
    uv_transform: tuple[tuple[float, float, float], tuple[float, float, float]] = (
        (1.0, 0.0, 0.0),
        (0.0, 1.0, 0.0),
    )
    size: float = 1.0
    bombing: Bombing = Bombing()
    wear: Wear = Wear()
    tinted: bool = False


@dataclass(frozen=True)
class Geometry:
    """Triangles of a material in the space of their mesh.

    Attributes:
        points: V x 3.
        normals: V x 3, unit length.
        uvs: V x 2, the material's texture coordinates, t up.
        colours: V x 4, sRGB-encoded ``displayColor``, and 255, or 0 where the mesh has none.
        triangles: T x 3, counter-clockwise seen from outside.
        material: Index into `Scene.materials`.
        double_sided: True if both sides are visible.
    """

    points: FloatArray
    normals: Floats
    uvs: Floats
    colours: ByteArray
    triangles: Indices
    material: int
    double_sided: bool

    def boxes(self, matrices: FloatArray) -> FloatArray:
        """Axis-aligned bounding box of the geometry at each placement (N x 4 x 4): N x 2 x 3."""
        low, high = extent(self.points)
        middle = matrices[:, :3, :3] @ ((low + high) / 2) + matrices[:, :3, 3]
        reach = np.abs(matrices[:, :3, :3]) @ ((high - low) / 2)
        return np.stack((middle - reach, middle + reach), axis=1)


@dataclass(frozen=True, slots=True)
class Level:
    """One of two levels of detail of an object.

    Attributes:
        far: True if it replaces the other one at a distance.
        middle: Middle of the detailed one, in the space of the geometry, metres.
        size: Diagonal of the detailed one, metres.
    """

    far: bool
    middle: tuple[float, float, float]
    size: float


@dataclass(frozen=True)
class Use:
    """Placements of a geometry.

    Attributes:
        geometry: Index into `Scene.geometries`.
        matrices: N x 4 x 4, to world coordinates, for column vectors.
        scene_objects: N, indices into `Scene.scene_objects`.
        region: Part of the stage; meshes of two regions are never merged.
        level: Level of detail; `None` if it is drawn at all distances.
    """

    geometry: int
    matrices: FloatArray
    scene_objects: NDArray[np.uint32]
    region: int = 0
    level: Level | None = None


@dataclass(frozen=True)
class Merged:
    """Meshes of a region that are placed a few times, merged group by group.

    Attributes:
        vertices: V of `packed_layout.VERTEX`; positions relative to the tile of their group.
        indices: Corners of all triangles, relative to their group's first vertex.
        groups: G of `packed_layout.GROUP`.
    """

    vertices: NDArray[np.void]
    indices: Indices
    groups: NDArray[np.void]


@dataclass(frozen=True, slots=True)
class SceneObject:
    """Label of a pixel: a class, an instance of it, or a part of an instance.

    Attributes:
        label: Name of the class (`envgen_usd.label_taxonomy`).
        path: Prim path of the object; empty for classes without instances.
        number: 1, 2, ... over the objects of the class on the stage; 0 with an empty `path`.
        part: Part of the object, e.g. ``window_pane``; empty without a part label.
    """

    label: str
    path: str = ""
    number: int = 0
    part: str = ""


@dataclass(frozen=True)
class Lane:
    """Centre line of a driving lane.

    Attributes:
        id: Name of the lane on the stage.
        points: N x 3, metres, world, in the direction of travel.
        successors: Ids of the following lanes.
    """

    id: str
    points: FloatArray
    successors: tuple[str, ...] = ()


@dataclass(frozen=True)
class Lamps:
    """Lamps of the scene, as points.

    Attributes:
        places: N x 3, metres, world.
        powers: N x 3, linear RGB: illuminance at 1 m on the axis, in the stage's unit of light.
        axes: N x 3, unit vectors along the beams.
        flat: N, 1 if the light falls with the cosine to the axis, 0 if it is even.
        edges: N, cosine between the axis and the beam's edge; -1 without an edge.
    """

    places: FloatArray = field(default_factory=lambda: np.empty((0, 3)))
    powers: FloatArray = field(default_factory=lambda: np.empty((0, 3)))
    axes: FloatArray = field(default_factory=lambda: np.empty((0, 3)))
    flat: FloatArray = field(default_factory=lambda: np.empty(0))
    edges: FloatArray = field(default_factory=lambda: np.empty(0))


@dataclass(frozen=True)
class Moment:
    """Where the moving bodies of a stage are at a time.

    Attributes:
        time: Seconds since the start of the stage.
        matrices: K x 4 x 4, from the space of each body to the world.
        shown: K, True for bodies that are visible.
    """

    time: float
    matrices: FloatArray
    shown: BoolArray


@dataclass(frozen=True)
class MovingParts:
    """Meshes and lamps of bodies that move; a body is rigid.

    Attributes:
        geometries: Meshes by material, each once.
        uses: Placements of the geometries; matrices lead to the space of the body.
        bodies: By use, the body of each placement.
        layouts: By body, use and row of each of its placements (M x 2), in the order of the stage.
        owners: K, number of the object that a body belongs to: a car and its wheels share it.
        lamps: Lamps in the spaces of their bodies.
        lamp_bodies: Body of each lamp.
        start: Where the bodies are at the start of the stage.
    """

    geometries: tuple[Geometry, ...]
    uses: tuple[Use, ...]
    bodies: tuple[IntArray, ...]
    layouts: tuple[IntArray, ...]
    owners: IntArray
    lamps: Lamps
    lamp_bodies: IntArray
    start: Moment


@dataclass(frozen=True)
class Scene:
    """All content to render.

    Attributes:
        geometries: Meshes by material, each once.
        uses: Placements of the geometries.
        materials: Looks.
        scene_objects: Labels of the pixels; the first is the sky, the second is void.
        light: Sun, sky and air of the stage.
        lanes: Driving lanes for the camera.
        bounds: 2 x 3, minimum and maximum corner, world.
        issues: Warnings about the stage.
        lamps: All lamps besides sun and sky.
        merged: By region, its merged meshes where they are known.
        textures: Folder for textures as the GPU takes them; `None` keeps none.
        moving: What moves; `None` on a stage without.
    """

    geometries: tuple[Geometry, ...]
    uses: tuple[Use, ...]
    materials: tuple[Material, ...]
    scene_objects: tuple[SceneObject, ...]
    light: Atmosphere
    lanes: tuple[Lane, ...]
    bounds: FloatArray
    issues: tuple[Issue, ...] = ()
    lamps: Lamps = field(default_factory=Lamps)
    merged: Mapping[int, Merged] = field(default_factory=dict)
    textures: Path | None = None
    moving: MovingParts | None = None
