"""Writes geometry as GML 3.2 text; fast, as coordinates fill most of a CityGML file."""

from collections.abc import Sequence
from functools import cache
from itertools import pairwise

import numpy as np

from envgen_usd.chunks import snap
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.polygon_arrays import Polygons, Solids

_PENDING_ARRAYS = 4096


@cache
def _position_list(count: int) -> str:
    numbers = " ".join(["%.3f"] * (3 * count))
    return f'<gml:posList srsDimension="3">{numbers}</gml:posList>'


@cache
def _ring(count: int) -> str:
    return f"<gml:LinearRing>{_position_list(count + 1)}</gml:LinearRing>"


class GeometryText:
    """Formats coordinates of the road frame in the frame of the file.

    Coordinates have a precision of 1 mm, which is exact for points on `chunks.GRID`.

    Attributes:
        offset: 3, metres, on `chunks.GRID`; added to all coordinates.
    """

    def __init__(self, offset: Sequence[float], *, old: bool = False) -> None:
        """Starts with empty bounds; the offset is snapped so that no coordinate loses digits.

        Args:
            offset: 3, metres.
            old: True for GML 3.1.1, which names shells and triangles differently.
        """
        self._shell = "CompositeSurface" if old else "Shell"
        self._patches = "trianglePatches" if old else "patches"
        self.offset: FloatArray = snap(np.array(offset, dtype=np.float64))
        self._pending: list[FloatArray] = []
        self._bounds: FloatArray | None = None

    def bounds(self) -> FloatArray | None:
        """2 x 3, lower and upper corner of all coordinates, file frame; `None` before the first."""
        if self._pending:
            points = np.concatenate(self._pending)
            self._pending.clear()
            if self._bounds is not None:
                points = np.concatenate([points, self._bounds])
            self._bounds = np.stack([points.min(axis=0), points.max(axis=0)])
        return self._bounds

    def numbers(self, points: FloatArray) -> list[float]:
        """Coordinates of N x 3 points in the file frame, flattened."""
        # Adding the offset also turns -0.0 into 0.0.
        moved: FloatArray = points + self.offset
        if len(moved):
            self._pending.append(moved)
            if len(self._pending) >= _PENDING_ARRAYS:
                self.bounds()
        numbers: list[float] = moved.ravel().tolist()
        return numbers

    def position(self, point: FloatArray) -> str:
        """A point as ``gml:Point``."""
        text = " ".join(f"{number:.3f}" for number in self.numbers(point.reshape(1, 3)))
        return f'<gml:Point><gml:pos srsDimension="3">{text}</gml:pos></gml:Point>'

    def polygons(self, polygons: Polygons, name: str = "") -> list[str]:
        """Each polygon as ``gml:Polygon``; with a name their ids are ``name.0``, ``name.1``, ..."""
        rings = self._rings(polygons)
        firsts = polygons.polygon_offsets.tolist()
        texts = []
        for p in range(len(firsts) - 1):
            exterior, *interiors = rings[firsts[p] : firsts[p + 1]]
            holes = "".join(f"<gml:interior>{ring}</gml:interior>" for ring in interiors)
            tag = f'<gml:Polygon gml:id="{name}.{p}">' if name else "<gml:Polygon>"
            texts.append(f"{tag}<gml:exterior>{exterior}</gml:exterior>{holes}</gml:Polygon>")
        return texts

    def _rings(self, polygons: Polygons) -> list[str]:
        numbers = self.numbers(polygons.points)
        starts = polygons.ring_offsets.tolist()
        rings = []
        for first, last in pairwise(starts):
            ring = numbers[3 * first : 3 * last] + numbers[3 * first : 3 * first + 3]
            rings.append(_ring(last - first) % tuple(ring))
        return rings

    def multi_surface(self, polygons: Polygons, name: str = "", surface_id: str = "") -> str:
        """``gml:MultiSurface``, with a gml:id if given."""
        tag = f'<gml:MultiSurface gml:id="{surface_id}">' if surface_id else "<gml:MultiSurface>"
        return f"{tag}{_members(self.polygons(polygons, name))}</gml:MultiSurface>"

    def solid(self, polygons: Polygons) -> str:
        """``gml:Solid`` with a shell of the polygons, or the solids that they bound.

        GML has no property for several separate solids; they become a ``gml:CompositeSolid``, too.
        """
        texts = self.polygons(polygons)
        if not isinstance(polygons, Solids):
            return self._solid(_members(texts))
        shells: dict[int, list[str]] = {}
        for text, shell in zip(texts, polygons.shell.tolist(), strict=True):
            shells.setdefault(shell, []).append(text)
        solids: dict[int, list[str]] = {}
        for shell in sorted(shells):
            solids.setdefault(int(polygons.solid[shell]), []).append(_members(shells[shell]))
        parts = [self._solid(*members) for members in solids.values()]
        if len(parts) == 1:
            return parts[0]
        members = "".join(f"<gml:solidMember>{part}</gml:solidMember>" for part in parts)
        return f"<gml:CompositeSolid>{members}</gml:CompositeSolid>"

    def solid_of_references(self, ids: Sequence[str]) -> str:
        """``gml:Solid`` whose shell references polygons elsewhere in the file."""
        return self._solid("".join(f'<gml:surfaceMember xlink:href="#{name}"/>' for name in ids))

    def _solid(self, exterior: str, *cavities: str) -> str:
        name = self._shell
        inner = "".join(
            f"<gml:interior><gml:{name}>{cavity}</gml:{name}></gml:interior>" for cavity in cavities
        )
        return (
            f"<gml:Solid><gml:exterior><gml:{name}>{exterior}</gml:{name}></gml:exterior>"
            f"{inner}</gml:Solid>"
        )

    def triangulated_surface(self, polygons: Polygons) -> str:
        """``gml:TriangulatedSurface``; all polygons must be triangles."""
        triangles = "".join(
            f"<gml:Triangle><gml:exterior>{ring}</gml:exterior></gml:Triangle>"
            for ring in self._rings(polygons)
        )
        patches = self._patches
        return (
            f"<gml:TriangulatedSurface><gml:{patches}>"
            f"{triangles}</gml:{patches}></gml:TriangulatedSurface>"
        )

    def line(self, curve: FloatArray) -> str:
        """A polyline, N x 3, as ``gml:LineString``."""
        positions = _position_list(len(curve)) % tuple(self.numbers(curve))
        return f"<gml:LineString>{positions}</gml:LineString>"

    def multi_curve(self, curves: Sequence[FloatArray]) -> str:
        """``gml:MultiCurve`` of polylines, each N_i x 3."""
        members = "".join(
            f"<gml:curveMember>{self.line(curve)}</gml:curveMember>" for curve in curves
        )
        return f"<gml:MultiCurve>{members}</gml:MultiCurve>"


def _members(polygons: Sequence[str]) -> str:
    return "".join(f"<gml:surfaceMember>{text}</gml:surfaceMember>" for text in polygons)
