"""Writes the actors layer of a chunk: parked vehicles, people and what they leave at kerbs."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from pxr import Sdf

from envgen_usd.assets.asset_catalogue import Catalogue
from envgen_usd.assets.prim_authoring import (
    add_prim,
    prim_names,
    set_extents_hint,
    union_extent,
)
from envgen_usd.assets.stage_schemas import ACTOR
from envgen_usd.assets.usd_files import new_layer, write_layer
from envgen_usd.assets.variant_choice import Choice, Distribution, choose_variants
from envgen_usd.chunks import Chunk
from envgen_usd.layers.payload_files import local
from envgen_usd.layers.placed_assets import AssetWriter, Prop
from envgen_usd.layers.prop_distributions import distributions
from envgen_usd.layers.prop_poses import placement_pose
from envgen_usd.models.city_model import Placement
from envgen_usd.models.environment_profile import Profile
from envgen_usd.models.parked_actors import ParkedActor
from envgen_usd.seeds import generator


def write_actors(  # noqa: PLR0913, PLR0917 - what a layer follows from
    actors: Sequence[ParkedActor],
    chunk: Chunk,
    profile: Profile,
    catalogue: Catalogue,
    seed: int,
    path: Path,
    *,
    metadata_only: bool = False,
) -> None:
    """Writes ``/Actors``: an instanceable reference for each actor, as for props.

    Args:
        actors: Actors of the chunk.
        chunk: Tile.
        profile: Environment; gives the weights of variants, as the paint of cars.
        catalogue: Asset library.
        seed: Random seed of the build.
        path: .usdc file, written atomically.
        metadata_only: Write poses, choices, labels and sizes without references.

    Raises:
        EnvgenError: The profile names an asset or a variant that the library lacks.
    """
    known = distributions(profile, catalogue) if actors else {}
    layer = new_layer("Actors")
    root = add_prim(layer, "Actors", "Xform", kind="group")
    writer = AssetWriter(chunk, profile, catalogue, metadata_only)
    by_id = {actor.id: actor for actor in actors}
    boxes = []
    with Sdf.ChangeBlock():
        for key, name in prim_names(by_id).items():
            actor = by_id[key]
            choice = _choice(actor, known[actor.look.kind], catalogue, seed)
            pose = placement_pose(_placement(actor), np.ones(3))
            prop = Prop(actor.id, choice, pose, actor.look.kind)
            facts = {"gml_id": actor.id, "place": actor.place}
            boxes.append(writer.add(root, name, prop, ACTOR, facts))
        box = union_extent(boxes)
        set_extents_hint(root, local(box, chunk) if boxes else box)
    write_layer(layer, path)


def _placement(actor: ParkedActor) -> Placement:
    size = np.zeros(3)
    return Placement(actor.position, actor.heading, size, actor.look.kind, actor.pitch, actor.roll)


def _choice(actor: ParkedActor, weights: Distribution, catalogue: Catalogue, seed: int) -> Choice:
    """The actor's asset; its look decides the size, the environment the other variants."""
    asset = catalogue.assets[actor.look.asset]
    drawn = choose_variants(asset, weights, generator(seed, "actors", "look", actor.id))
    return Choice(asset, {**asset.defaults, **drawn, **actor.look.selections})
