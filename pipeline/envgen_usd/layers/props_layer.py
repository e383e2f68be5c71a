"""Writes the props layer of a chunk: furniture, vegetation, windows and doors as references."""

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence, Set
from dataclasses import dataclass
from pathlib import Path

from pxr import Sdf

from envgen_usd.assets.asset_catalogue import Catalogue
from envgen_usd.assets.prim_authoring import (
    add_prim,
    prim_names,
    set_extents_hint,
    union_extent,
)
from envgen_usd.assets.stage_schemas import PROP
from envgen_usd.assets.usd_files import new_layer, write_layer
from envgen_usd.chunks import Chunk
from envgen_usd.layers.body_prims import add_body, body_material, find_bodies
from envgen_usd.layers.building_parts import building_pivot, buildings_by_name
from envgen_usd.layers.payload_files import find_materials, local
from envgen_usd.layers.placed_assets import AssetWriter, Prop
from envgen_usd.layers.prop_choices import choose_props
from envgen_usd.layers.wire_prims import add_wires, find_wires
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.city_model import City, CityObject
from envgen_usd.models.environment_profile import Profile


def write_props(  # noqa: PLR0913, PLR0917 - what a layer follows from
    city: City,
    chunk: Chunk,
    profile: Profile,
    catalogue: Catalogue,
    seed: int,
    path: Path,
    *,
    metadata_only: bool = False,
    beside_parked: Set[str] = frozenset(),
) -> None:
    """Writes ``/Props``, and ``/Buildings/<building>/Props`` for what belongs to a building.

    Placements and openings are instanceable references, bodies and wires are meshes.
    ``/Buildings`` holds opinions over the prims of the buildings layer, so that windows move and
    vanish with their wall.

    Args:
        city: City of the chunk.
        chunk: Tile.
        profile: Environment; gives the weights of assets and variants.
        catalogue: Asset library.
        seed: Random seed of the build.
        path: .usdc file, written atomically.
        metadata_only: Write poses, choices, labels and sizes without references, for readers with
            their own assets, e.g. a simulator.
        beside_parked: As of `choose_props`.

    Raises:
        EnvgenError: The profile names an asset or a variant that the library lacks.
    """
    buildings = buildings_by_name(city)
    props = choose_props(city, buildings, profile, catalogue, seed, beside_parked)
    placed = {prop.id for prop in props}
    bodies = {key: body for key, body in find_bodies(city).items() if key not in placed}
    wires = {key: wire for key, wire in find_wires(city).items() if key not in {*placed, *bodies}}
    layer = new_layer("Props")
    root = add_prim(layer, "Props", "Xform", kind="group")
    used = {body_material(body) for body in bodies.values()}
    find_materials(used, catalogue, f"props of chunk {chunk.name}")
    assets = AssetWriter(chunk, profile, catalogue, metadata_only)
    writer = _Writer(chunk, catalogue, assets)
    with Sdf.ChangeBlock():
        loose = [prop for prop in props if not prop.building]
        boxes = writer.add_loose(root, loose, bodies, wires)
        _set_extent(root, boxes, chunk)
        if len(loose) < len(props):
            overs = add_prim(layer, "Buildings", specifier=Sdf.SpecifierOver)
            _set_extent(overs, writer.add_attached(overs, props, buildings), chunk)
    write_layer(layer, path)


def _set_extent(root: Sdf.PrimSpec, boxes: Sequence[FloatArray], chunk: Chunk) -> None:
    box = union_extent(boxes)
    set_extents_hint(root, local(box, chunk) if boxes else box)


@dataclass(frozen=True)
class _Writer:
    """Authors the props of a chunk; boxes are 2 x 3 in the road frame."""

    chunk: Chunk
    catalogue: Catalogue
    assets: AssetWriter

    def add_loose(
        self,
        root: Sdf.PrimSpec,
        props: Iterable[Prop],
        bodies: Mapping[str, CityObject],
        wires: Mapping[str, CityObject],
    ) -> list[FloatArray]:
        """Adds props, bodies and wires that belong to no building; returns their boxes."""
        by_id = {prop.id: prop for prop in props}
        boxes = []
        for key, name in prim_names({*by_id, *bodies, *wires}).items():
            if key in by_id:
                boxes.append(self._add(root, name, by_id[key]))
            elif key in wires:
                boxes.append(add_wires(root, name, wires[key], self.chunk, self.catalogue))
            else:
                boxes.append(add_body(root, name, bodies[key], self.chunk, self.catalogue))
        return boxes

    def add_attached(
        self, overs: Sdf.PrimSpec, props: Iterable[Prop], buildings: Mapping[str, CityObject]
    ) -> list[FloatArray]:
        """Adds ``<building>/Props`` with the props of each building; returns their boxes."""
        by_building: dict[str, dict[str, Prop]] = defaultdict(dict)
        for prop in props:
            if prop.building:
                by_building[prop.building][prop.id] = prop
        boxes = []
        for building, by_id in sorted(by_building.items()):
            over = add_prim(overs, building, specifier=Sdf.SpecifierOver)
            group = add_prim(over, "Props", "Xform")
            pivot = building_pivot(buildings[building], self.chunk)
            boxes += [
                self._add(group, name, by_id[key], pivot) for key, name in prim_names(by_id).items()
            ]
        return boxes

    def _add(
        self, root: Sdf.PrimSpec, name: str, prop: Prop, pivot: FloatArray | None = None
    ) -> FloatArray:
        """Adds a prop; `pivot` is the origin of its building in the chunk's frame."""
        return self.assets.add(root, name, prop, PROP, {"gml_id": prop.id}, pivot=pivot)
