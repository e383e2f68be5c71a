"""Embree 4: trees of triangles that are built once and placed many times.

The wheel of embreex brings Embree's library; embreex itself copies triangles one by one and has no
instances. So the library's C interface is called here, with NumPy's memory shared.

Source: Embree 4 API, chapters RTCScene, RTC_GEOMETRY_TYPE_INSTANCE and rtcIntersect16.
"""

import ctypes
import threading
import weakref
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from envgen_usd.errors import EnvgenError
from envgen_usd.models.array_types import FloatArray, IntArray
from envgen_usd.render.render_scene import Floats

_TRIANGLES, _INSTANCE = 0, 121
"""Kinds of geometry."""
_INDICES, _VERTICES = 0, 1
"""Kinds of buffer."""
_UINT3, _FLOAT3, _COLUMNS_OF_3X4 = 0x5003, 0x9003, 0x9234
"""Formats of buffers and of transforms."""
_ROBUST = 4
"""Flag of a scene: no ray passes between two triangles that share an edge."""
_COHERENT = 1 << 16
"""Flag of a query: the rays of a packet go similar ways."""
_ALL_FEATURES = 0xFFFFFFFF
_LANES = 16
"""Rays of a packet."""
_WORDS = 21
"""Words of a ray and its hit: origin, near, direction, time, far, mask, id, flags; normal, u, v,
triangle, geometry, instance, primitive of the instance."""
_FAR, _MASK, _FLAGS, _NORMAL, _SPOT, _TRIANGLE, _PLACED = 8, 9, 11, 12, 15, 17, 19
_ALIGNMENT = 64
_POINTER = ctypes.c_void_p


class _Arguments(ctypes.Structure):
    """RTCIntersectArguments."""

    _fields_ = (
        ("flags", ctypes.c_uint32),
        ("feature_mask", ctypes.c_uint32),
        ("context", _POINTER),
        ("filter", _POINTER),
        ("intersect", _POINTER),
    )


_SIGNATURES: dict[str, tuple[Any, tuple[Any, ...]]] = {
    "rtcNewDevice": (_POINTER, (ctypes.c_char_p,)),
    "rtcGetDeviceError": (ctypes.c_int, (_POINTER,)),
    "rtcNewScene": (_POINTER, (_POINTER,)),
    "rtcSetSceneFlags": (None, (_POINTER, ctypes.c_int)),
    "rtcCommitScene": (None, (_POINTER,)),
    "rtcReleaseScene": (None, (_POINTER,)),
    "rtcNewGeometry": (_POINTER, (_POINTER, ctypes.c_int)),
    "rtcSetSharedGeometryBuffer": (
        None,
        (
            *(_POINTER, ctypes.c_int, ctypes.c_uint, ctypes.c_int),
            *(_POINTER, ctypes.c_size_t, ctypes.c_size_t, ctypes.c_size_t),
        ),
    ),
    "rtcSetGeometryInstancedScene": (None, (_POINTER, _POINTER)),
    "rtcSetGeometryTransform": (None, (_POINTER, ctypes.c_uint, ctypes.c_int, _POINTER)),
    "rtcCommitGeometry": (None, (_POINTER,)),
    "rtcAttachGeometry": (ctypes.c_uint, (_POINTER, _POINTER)),
    "rtcReleaseGeometry": (None, (_POINTER,)),
    "rtcIntersect16": (None, (_POINTER, _POINTER, _POINTER, _POINTER)),
}


@dataclass(frozen=True)
class FirstHits:
    """First hits of rays.

    Attributes:
        triangles: N, number of the triangle in its mesh; -1 without a hit.
        placements: N, number of the placement; of any value without a hit.
        ranges: N, distance from the origin, metres.
        normals: N x 3, normal in the space of the mesh, of any length.
        spots: N x 2, barycentric coordinates of the second and the third corner.
    """

    triangles: IntArray
    placements: IntArray
    ranges: Floats
    normals: Floats
    spots: Floats


class TriangleTree:
    """The tree of a mesh, in the space of the mesh."""

    def __init__(self, points: FloatArray, triangles: NDArray[Any]) -> None:
        """Builds the tree.

        Args:
            points: V x 3.
            triangles: T x 3, numbers of points.

        Raises:
            EnvgenError: The library is missing, or has no memory left.
        """
        library, device = _embree()
        # Embree reads 16 bytes of a point of 12.
        vertices = np.zeros((len(points) + 1, 3), np.float32)
        vertices[:-1] = points
        corners = np.ascontiguousarray(triangles, np.uint32)
        self._memory = vertices, corners
        self.scene = _new_scene(self)
        geometry = library.rtcNewGeometry(device, _TRIANGLES)
        for kind, form, values, count in (
            (_VERTICES, _FLOAT3, vertices, len(points)),
            (_INDICES, _UINT3, corners, len(corners)),
        ):
            library.rtcSetSharedGeometryBuffer(
                geometry, kind, 0, form, values.ctypes.data, 0, values.strides[0], count
            )
        _attach(self.scene, geometry)
        library.rtcCommitScene(self.scene)
        _check()

    @property
    def triangles(self) -> int:
        """Number of triangles."""
        return len(self._memory[1])


class PlacedTrees:
    """Trees that are placed in a space."""

    def __init__(self, trees: Sequence[TriangleTree], matrices: FloatArray) -> None:
        """Places the trees.

        Args:
            trees: N; a tree may stand there many times.
            matrices: N x 4 x 4, from the space of each tree, for column vectors.

        Raises:
            EnvgenError: The library is missing, or has no memory left.
        """
        library, device = _embree()
        self._trees = tuple(trees)
        self._scene = _new_scene(self)
        columns = np.ascontiguousarray(matrices.transpose(0, 2, 1)[:, :, :3], np.float32)
        first, step = columns.ctypes.data, columns.strides[0]
        for number, tree in enumerate(self._trees):
            geometry = library.rtcNewGeometry(device, _INSTANCE)
            library.rtcSetGeometryInstancedScene(geometry, tree.scene)
            place = first + number * step
            library.rtcSetGeometryTransform(geometry, 0, _COLUMNS_OF_3X4, place)
            _attach(self._scene, geometry)
        library.rtcCommitScene(self._scene)
        _check()

    def first_hits(
        self, starts: Floats, ways: Floats, reach: np.float32 | Floats, *, coherent: bool = False
    ) -> FirstHits:
        """First hits of rays.

        Args:
            starts: N x 3, or a single one for all rays (3), metres.
            ways: N x 3, unit vectors.
            reach: Length of the rays, or of each of them (N), metres.
            coherent: True if 16 rays that follow each other go similar ways; then it is faster.
        """
        library, _ = _embree()
        count = len(ways)
        packets = _filled(starts, ways, reach)
        arguments = _Arguments(_COHERENT if coherent else 0, _ALL_FEATURES, None, None, None)
        scene, valid, told = self._scene, _packets.valid.ctypes.data, ctypes.byref(arguments)
        trace, step = library.rtcIntersect16, packets.strides[0]
        begin = packets.ctypes.data
        for place in range(begin, begin + len(packets) * step, step):
            trace(valid, scene, place, told)
        words = packets.view(np.int32)

        def rays(values: NDArray[Any], first: int, last: int) -> NDArray[Any]:
            return values[:, first:last].transpose(0, 2, 1).reshape(-1, last - first)[:count]

        return FirstHits(
            triangles=rays(words, _TRIANGLE, _TRIANGLE + 1)[:, 0].astype(np.int64),
            placements=rays(words, _PLACED, _PLACED + 1)[:, 0].astype(np.int64),
            ranges=rays(packets, _FAR, _FAR + 1)[:, 0].copy(),
            normals=rays(packets, _NORMAL, _NORMAL + 3),
            spots=rays(packets, _SPOT, _SPOT + 2),
        )


class _Packets(threading.local):
    """Memory of a thread's packets; what is new costs a fault for each page."""

    def __init__(self) -> None:
        self.valid = _aligned((_LANES,), np.int32)
        self.valid[:] = -1
        self._rays = _aligned((0, _WORDS, _LANES), np.float32)

    def of(self, count: int) -> Floats:
        """Packets x 21 x 16 for a number of rays."""
        needed = -(-count // _LANES)
        if len(self._rays) < needed:
            self._rays = _aligned((needed, _WORDS, _LANES), np.float32)
        return self._rays[:needed]


def _aligned(shape: tuple[int, ...], kind: type) -> NDArray[Any]:
    size = int(np.prod(shape)) * np.dtype(kind).itemsize
    memory = np.zeros(size + _ALIGNMENT, np.uint8)
    begin = -memory.ctypes.data % _ALIGNMENT
    return memory[begin : begin + size].view(kind).reshape(shape)


_packets = _Packets()


def _filled(starts: Floats, ways: Floats, reach: np.float32 | Floats) -> Floats:
    """Packets of rays without hits; those that fill up the last packet have no length."""
    packets = _packets.of(len(ways))
    left = len(packets) * _LANES - len(ways)
    for first, last, values in ((0, 3, starts), (4, 7, ways), (_FAR, _FAR + 1, reach)):
        rows: NDArray[Any] = np.asarray(values, np.float32).reshape(-1, last - first)
        if len(rows) > 1 and rows.strides[0]:
            if left:
                rows = np.concatenate((rows, np.full((left, last - first), -1.0, np.float32)))
            rows = rows.reshape(-1, _LANES, last - first).transpose(0, 2, 1)
        else:
            rows = rows[:1, :, None]
        packets[:, first:last] = rows
    if left:
        packets[-1, _FAR, -left:] = -1.0
    packets[:, 3] = packets[:, 7] = 0.0
    words = packets.view(np.uint32)
    words[:, _MASK] = words[:, _TRIANGLE:] = 0xFFFFFFFF
    words[:, _FLAGS] = 0
    return packets


def _new_scene(owner: TriangleTree | PlacedTrees) -> int:
    """A scene that lives as long as its owner."""
    library, device = _embree()
    scene: int = library.rtcNewScene(device)
    library.rtcSetSceneFlags(scene, _ROBUST)
    weakref.finalize(owner, library.rtcReleaseScene, scene).atexit = False
    return scene


def _attach(scene: int, geometry: int) -> None:
    library, _ = _embree()
    library.rtcCommitGeometry(geometry)
    library.rtcAttachGeometry(scene, geometry)
    library.rtcReleaseGeometry(geometry)


def _check() -> None:
    library, device = _embree()
    error = library.rtcGetDeviceError(device)
    if error:
        raise EnvgenError(f"render: lidar: Embree reports error {error}; free some memory")


@cache
def _embree() -> tuple[ctypes.CDLL, int]:
    """The library and a device of one thread, so that a tree is the same whenever it is built."""
    try:
        from embreex import rtcore_scene  # noqa: PLC0415

        library = ctypes.CDLL(rtcore_scene.__file__)
        for name, (result, arguments) in _SIGNATURES.items():
            function = getattr(library, name)
            function.restype, function.argtypes = result, arguments
    except (ImportError, OSError, AttributeError) as error:
        message = "render: lidar needs the library embreex 4.4, which exists for x86-64 only"
        raise EnvgenError(f"{message}: pip install 'embreex>=4.4'") from error
    return library, library.rtcNewDevice(b"threads=1")
