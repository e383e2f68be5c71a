"""Writes the props layer of a chunk: furniture, vegetation, windows and doors as references."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from pxr import Sdf

from envgen_usd.assets.asset_catalogue import Catalogue
from envgen_usd.assets.prim_authoring import (
    add_prim,
    prim_names,
    set_custom,
    set_extents_hint,
    set_pose,
    union_extent,
)
from envgen_usd.assets.usd_files import new_layer, write_layer
from envgen_usd.assets.variant_choice import Choice, Distribution, choose
from envgen_usd.chunks import Chunk
from envgen_usd.layers.body_prims import add_body, body_material, find_bodies
from envgen_usd.layers.building_parts import buildings_by_name, with_openings
from envgen_usd.layers.payload_files import add_materials, local
from envgen_usd.layers.prop_distributions import distributions, fitting, sign_selections
from envgen_usd.layers.prop_poses import Pose, opening_pose, placement_pose
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.city_model import City, CityObject, Placement
from envgen_usd.models.environment_profile import Profile
from envgen_usd.seeds import generator

OPENINGS = {"WindowSurface": "window", "DoorSurface": "door"}
"""Kind of asset for each class of opening."""


@dataclass(frozen=True)
class Prop:
    """An asset to be placed.

    Attributes:
        id: Id of the feature or surface.
        choice: Asset and variants.
        pose: Pose in the road frame.
        category: Category of the prop.
        part_of: Path from this prim to that of its building; empty for other props.
    """

    id: str
    choice: Choice
    pose: Pose
    category: str
    part_of: str = ""


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
    """Writes ``/Props``: instanceable references for placements and openings, meshes for bodies.

    Args:
        city: City of the chunk.
        chunk: Tile.
        profile: Environment; gives the weights of assets and variants.
        catalogue: Asset library.
        seed: Random seed of the build.
        path: .usdc file, written atomically.
        metadata_only: Write poses and choices without references, for readers with their own
            assets, e.g. a simulator.

    Raises:
        EnvgenError: The profile names an asset or a variant that the library lacks.
    """
    props = {prop.id: prop for prop in _props(city, profile, catalogue, seed)}
    bodies = {key: body for key, body in find_bodies(city).items() if key not in props}
    layer = new_layer("Props")
    root = add_prim(layer, "Props", "Xform", kind="group")
    used = {body_material(body) for body in bodies.values()}
    materials = add_materials(root, used, catalogue, f"props of chunk {chunk.name}")
    boxes: list[FloatArray] = []
    with Sdf.ChangeBlock():
        for key, name in prim_names({*props, *bodies, "Materials"}).items():
            if key in props:
                prop = props[key]
                prim = _add_prop(root, name, prop, chunk, profile)
                if not metadata_only:
                    _refer(prim, prop.choice, catalogue)
                boxes.append(prop.pose.box(prop.choice.asset.extent(prop.choice.selections)))
            elif key in bodies:
                material = materials[body_material(bodies[key])]
                boxes.append(add_body(root, name, bodies[key], chunk, catalogue, material))
    box = union_extent(boxes)
    set_extents_hint(root, local(box, chunk) if boxes else box)
    write_layer(layer, path)


def _refer(prim: Sdf.PrimSpec, choice: Choice, catalogue: Catalogue) -> None:
    prim.instanceable = True
    prim.referenceList.prependedItems = [Sdf.Reference(catalogue.reference(choice.asset.path))]


def _add_prop(
    root: Sdf.PrimSpec, name: str, prop: Prop, chunk: Chunk, profile: Profile
) -> Sdf.PrimSpec:
    asset = prop.choice.asset
    prim = add_prim(root, name, "Xform")
    for set_name, variant in sorted(prop.choice.selections.items()):
        prim.variantSelections[set_name] = variant
    set_pose(prim, local(prop.pose.translate, chunk), prop.pose.rotate, prop.pose.scale)
    facts = {
        "area_type": profile.area,
        "asset": asset.name,
        "category": prop.category,
        "country": profile.country,
        "gml_id": prop.id,
        "segmentation_class": asset.label,
    }
    if prop.part_of:
        facts["part_of"] = prop.part_of
    set_custom(prim, facts)
    return prim


def _props(city: City, profile: Profile, catalogue: Catalogue, seed: int) -> Iterator[Prop]:
    known = distributions(profile, catalogue)
    for feature in city.walk():
        if feature.placement is not None:
            distribution = known.get(feature.placement.template)
            if distribution is not None:
                choice = choose(catalogue, distribution, generator(seed, "props", feature.id))
                yield _standing(feature, feature.placement, choice)
    for name, building in buildings_by_name(city).items():
        for opening in _openings(building, known, catalogue, seed):
            yield replace(opening, part_of=f"../../Buildings/{name}")


def _standing(feature: CityObject, placement: Placement, choice: Choice) -> Prop:
    choice = Choice(choice.asset, {**choice.selections, **sign_selections(feature, choice.asset)})
    pose = placement_pose(placement, choice.asset.size(choice.selections))
    return Prop(feature.id, choice, pose, placement.template)


def _openings(
    building: CityObject, known: Mapping[str, Distribution], catalogue: Catalogue, seed: int
) -> Iterator[Prop]:
    """Windows and doors of a building; all windows share a look, and so do all doors."""
    choices: dict[str, Choice] = {}
    for part in building.walk():
        for opening in with_openings(part.surfaces):
            category = OPENINGS.get(opening.kind, "")
            pose = opening_pose(opening.polygons) if category in known else None
            if pose is None:
                continue
            distribution = fitting(known[category], category, catalogue, float(pose.scale[0]))
            key = f"{category} {sorted(distribution.assets)}"
            if key not in choices:
                choices[key] = choose(
                    catalogue, distribution, generator(seed, "props", building.id, key)
                )
            yield Prop(opening.id, choices[key], pose, category)
