"""Writes the props layer of a chunk: furniture, vegetation, windows and doors as references."""

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pxr import Sdf

from envgen_usd.assets.asset_catalogue import Catalogue
from envgen_usd.assets.prim_authoring import (
    SEASON,
    SEASON_CLASS,
    add_prim,
    apply_schemas,
    prim_names,
    set_class,
    set_custom,
    set_extents_hint,
    set_pose,
    union_extent,
)
from envgen_usd.assets.stage_schemas import PROP
from envgen_usd.assets.usd_files import new_layer, write_layer
from envgen_usd.assets.variant_choice import Choice
from envgen_usd.chunks import Chunk
from envgen_usd.layers.body_prims import add_body, body_material, find_bodies
from envgen_usd.layers.building_parts import building_pivot, buildings_by_name
from envgen_usd.layers.payload_files import find_materials, local
from envgen_usd.layers.prop_choices import Prop, choose_props
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

    Raises:
        EnvgenError: The profile names an asset or a variant that the library lacks.
    """
    buildings = buildings_by_name(city)
    props = choose_props(city, buildings, profile, catalogue, seed)
    placed = {prop.id for prop in props}
    bodies = {key: body for key, body in find_bodies(city).items() if key not in placed}
    wires = {key: wire for key, wire in find_wires(city).items() if key not in {*placed, *bodies}}
    layer = new_layer("Props")
    root = add_prim(layer, "Props", "Xform", kind="group")
    used = {body_material(body) for body in bodies.values()}
    find_materials(used, catalogue, f"props of chunk {chunk.name}")
    writer = _Writer(chunk, profile, catalogue, metadata_only)
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
    profile: Profile
    catalogue: Catalogue
    metadata_only: bool

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
                boxes.append(self._add(root, name, by_id[key], np.zeros(3), "component"))
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
                self._add(group, name, by_id[key], pivot, "subcomponent")
                for key, name in prim_names(by_id).items()
            ]
        return boxes

    def _add(
        self, root: Sdf.PrimSpec, name: str, prop: Prop, pivot: FloatArray, kind: str
    ) -> FloatArray:
        """Adds a prop; `pivot` is the origin of `root` in the chunk's frame. Returns its box."""
        asset, selections = prop.choice.asset, prop.choice.selections
        prim = add_prim(root, name, "Xform", kind=kind)
        for set_name, variant in sorted(selections.items()):
            prim.variantSelections[set_name] = variant
        if SEASON in asset.variants and SEASON not in selections:
            prim.inheritPathList.prependedItems = [SEASON_CLASS]
        pose = prop.pose
        set_pose(prim, local(pose.translate, self.chunk) - pivot, pose.rotate, pose.scale)
        facts = {
            "area_type": self.profile.area,
            "asset": asset.name,
            "category": prop.category,
            "country": self.profile.country,
            "gml_id": prop.id,
            "segmentation_class": asset.label,
        }
        if self.metadata_only:
            facts["asset_path"] = asset.path
            _describe(prim, prop.choice)
        else:
            prim.instanceable = True
            reference = Sdf.Reference(self.catalogue.reference(asset.path))
            prim.referenceList.prependedItems = [reference]
        apply_schemas(prim, PROP)
        set_custom(prim, facts)
        return pose.box(asset.extent(selections))


def _describe(prim: Sdf.PrimSpec, choice: Choice) -> None:
    """Authors what a reference to the asset would bring, without its geometry."""
    asset = choice.asset
    set_class(prim, asset.label)
    set_extents_hint(prim, asset.extent(choice.selections))
    prim.assetInfo["identifier"] = Sdf.AssetPath(asset.path)
    prim.assetInfo["name"] = asset.name
