"""Writes geometry as CityJSON objects with shared vertices."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from envgen_usd.chunks import GRID
from envgen_usd.cityjson.cityjson_types import SURFACE_TYPES
from envgen_usd.cityjson.json_attributes import attributes_json
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.city_model import Placement, ThematicSurface
from envgen_usd.models.polygon_arrays import Polygons, Solids

Json = dict[str, Any]
THEME = "material"
_BOX = [[x, y, z] for z in (0, 1) for y in (-0.5, 0.5) for x in (-0.5, 0.5)]
_BOX_FACES = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [1, 3, 7, 5], [3, 2, 6, 7], [2, 0, 4, 6]]


@dataclass
class GeometryWriter:
    """Builds geometry objects, and collects the vertices, materials and templates they use.

    Attributes:
        vertices: Index of each vertex, in multiples of `chunks.GRID`, road frame.
        materials: Index of each material, by name.
        templates: Index of each template, by name.
    """

    vertices: dict[tuple[int, int, int], int] = field(default_factory=dict)
    materials: dict[str, int] = field(default_factory=dict)
    templates: dict[str, int] = field(default_factory=dict)

    def _indices(self, points: FloatArray) -> list[int]:
        known = self.vertices
        places = np.rint(points / GRID).astype(np.int64).tolist()
        return [known.setdefault((x, y, z), len(known)) for x, y, z in places]

    def _boundaries(self, polygons: Polygons) -> list[list[list[int]]]:
        indices = self._indices(polygons.points)
        rings = [indices[a:b] for a, b in pairwise(polygons.ring_offsets.tolist())]
        return [rings[a:b] for a, b in pairwise(polygons.polygon_offsets.tolist())]

    def plain(self, kind: str, lod: int, polygons: Polygons) -> Json:
        """Polygons without semantics, as a ``MultiSurface`` or ``CompositeSurface``."""
        return {"type": kind, "lod": str(lod), "boundaries": self._boundaries(polygons)}

    def solids(
        self,
        kind: str,
        lod: int,
        polygons: Polygons,
        surfaces: Iterable[tuple[ThematicSurface, str]] = (),
    ) -> Json:
        """One or several solids with the semantics of surfaces that have the same polygons.

        Args:
            kind: ``Solid``, ``MultiSolid`` or ``CompositeSolid``.
            lod: Level of detail.
            polygons: Shells of the solids.
            surfaces: Surfaces whose polygons are all among those of the solids, each with the id of
                the space that it bounds, if any.
        """
        rows = _Rows()
        for surface, space in surfaces:
            self._add(surface, space, rows)
        known = {
            _ring_key(boundary): place
            for boundary, *place in zip(rows.boundaries, rows.values, rows.materials, strict=True)
        }
        boundaries = self._boundaries(polygons)
        places = [known.get(_ring_key(boundary), [None, None]) for boundary in boundaries]
        geometry: Json = {
            "type": kind,
            "lod": str(lod),
            "boundaries": _nest(boundaries, polygons, kind),
        }
        if rows.semantics:
            values = _nest([value for value, _ in places], polygons, kind)
            geometry["semantics"] = {"surfaces": rows.semantics, "values": values}
        if any(material is not None for _, material in places):
            materials = _nest([material for _, material in places], polygons, kind)
            geometry["material"] = {THEME: {"values": materials}}
        return geometry

    def lines(self, lod: int, curves: Sequence[FloatArray], semantics: Json | None) -> Json:
        """Polylines, all with the same semantics or without."""
        geometry: Json = {
            "type": "MultiLineString",
            "lod": str(lod),
            "boundaries": [self._indices(curve) for curve in curves],
        }
        if semantics is not None:
            geometry["semantics"] = {"surfaces": [semantics], "values": [0] * len(curves)}
        return geometry

    def thematic(
        self, kind: str, lod: int, surfaces: Iterable[tuple[ThematicSurface, str]]
    ) -> Json:
        """Surfaces with semantics, each with the id of the space that it bounds, if any."""
        rows = _Rows()
        for surface, space in surfaces:
            self._add(surface, space, rows)
        nest = [rows.boundaries] if kind == "Solid" else rows.boundaries
        values = [rows.values] if kind == "Solid" else rows.values
        geometry: Json = {
            "type": kind,
            "lod": str(lod),
            "boundaries": nest,
            "semantics": {"surfaces": rows.semantics, "values": values},
        }
        if any(index is not None for index in rows.materials):
            materials = [rows.materials] if kind == "Solid" else rows.materials
            geometry["material"] = {THEME: {"values": materials}}
        return geometry

    def _add(self, surface: ThematicSurface, space: str, rows: "_Rows") -> int | None:
        """Adds a surface with its openings; returns the index of its semantics.

        Classes that CityJSON lacks have none.
        """
        boundaries = self._boundaries(surface.polygons)
        index = None
        if surface.kind in SURFACE_TYPES:
            index = len(rows.semantics)
            semantics: Json = {"type": SURFACE_TYPES[surface.kind], "id": surface.id}
            if space:
                semantics["space"] = space
            rows.semantics.append(semantics | attributes_json(surface.attributes))
        material = surface.material
        known = self.materials.setdefault(material, len(self.materials)) if material else None
        rows.boundaries += boundaries
        rows.values += [index] * len(boundaries)
        rows.materials += [known] * len(boundaries)
        added = [self._add(opening, space, rows) for opening in surface.openings]
        children = [child for child in added if child is not None]
        if index is not None and children:
            rows.semantics[index]["children"] = children
            for child in children:
                rows.semantics[child]["parent"] = index
        return index

    def instance(self, placement: Placement) -> Json:
        """An instance of a template, scaled from a box of 1 m to its size."""
        index = self.templates.setdefault(placement.template, len(self.templates))
        angles = [placement.heading, -placement.pitch, placement.roll]
        size = np.where(placement.size > 0, placement.size, 1.0)
        matrix = np.eye(4)
        matrix[:3, :3] = Rotation.from_euler("ZYX", angles).as_matrix() * size
        return {
            "type": "GeometryInstance",
            "template": index,
            "boundaries": self._indices(placement.position.reshape(1, 3)),
            "transformationMatrix": matrix.ravel().tolist(),
        }

    def templates_json(self) -> Json:
        """The templates as boxes of 1 m; their full shape is known by name only."""
        box = {"type": "MultiSurface", "lod": "1", "boundaries": [[face] for face in _BOX_FACES]}
        return {"templates": [box] * len(self.templates), "vertices-templates": _BOX}


def _ring_key(rings: list[list[int]]) -> tuple[tuple[int, ...], ...]:
    """Equal for polygons with the same vertices in the same direction."""
    exterior, *holes = (
        tuple(ring[ring.index(min(ring)) :] + ring[: ring.index(min(ring))]) for ring in rings
    )
    return exterior, *sorted(holes)


def _nest(items: list[Any], polygons: Polygons, kind: str) -> list[Any]:
    """Items of polygons, nested by shells, and by solids unless the type is a single solid."""
    if not isinstance(polygons, Solids):
        return [items] if kind == "Solid" else [[items]]
    solids: dict[int, dict[int, list[Any]]] = {}
    for item, shell in zip(items, polygons.shell.tolist(), strict=True):
        solid = int(polygons.solid[shell])
        solids.setdefault(solid, {}).setdefault(shell, []).append(item)
    nested = [list(shells.values()) for shells in solids.values()]
    return nested[0] if kind == "Solid" else nested


@dataclass
class _Rows:
    """Polygons of a geometry with the index of their semantics and material."""

    boundaries: list[list[list[int]]] = field(default_factory=list)
    semantics: list[Json] = field(default_factory=list)
    values: list[int | None] = field(default_factory=list)
    materials: list[int | None] = field(default_factory=list)
