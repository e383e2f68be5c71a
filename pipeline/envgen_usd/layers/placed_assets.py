"""Assets that stand at a place of the stage, as references: props and actors."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from pxr import Sdf

from envgen_usd.assets.asset_catalogue import Catalogue
from envgen_usd.assets.prim_authoring import (
    SEASON,
    SEASON_CLASS,
    add_prim,
    apply_schemas,
    set_class,
    set_custom,
    set_extents_hint,
    set_pose,
)
from envgen_usd.assets.variant_choice import Choice
from envgen_usd.chunks import Chunk
from envgen_usd.layers.payload_files import local
from envgen_usd.layers.prop_poses import Pose
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.environment_profile import Profile


@dataclass(frozen=True)
class Prop:
    """An asset to be placed.

    Attributes:
        id: Id of the feature, surface or actor.
        choice: Asset and variants.
        pose: Pose in the road frame.
        category: Kind of object.
        building: Prim name of the building that it belongs to; empty for others.
    """

    id: str
    choice: Choice
    pose: Pose
    category: str
    building: str = ""


@dataclass(frozen=True)
class AssetWriter:
    """Authors the assets of a chunk.

    Each is authored anew: `Sdf.CopySpec` takes two thirds of the time, but sorts fields by their
    addresses in memory, so the bytes of a binary layer would differ from run to run.

    Attributes:
        chunk: Tile.
        profile: Environment, recorded on each prim.
        catalogue: Asset library.
        metadata_only: True for poses, choices, labels and sizes without references.
    """

    chunk: Chunk
    profile: Profile
    catalogue: Catalogue
    metadata_only: bool = False

    def add(  # noqa: PLR0913 - what a prim consists of
        self,
        root: Sdf.PrimSpec,
        name: str,
        prop: Prop,
        schema: str,
        facts: Mapping[str, str],
        *,
        pivot: FloatArray | None = None,
    ) -> FloatArray:
        """Adds an instanceable reference with the pose, the variants and what is known of it.

        Args:
            root: Parent.
            name: Name of the prim.
            prop: What to place.
            schema: Applied schema of the prim.
            facts: What the schema declares beside what all assets have.
            pivot: 3, origin of the building that it belongs to in the chunk's frame, metres.

        Returns:
            Its box, 2 x 3, in the road frame.
        """
        choice, pose = prop.choice, prop.pose
        prim = add_prim(root, name, "Xform", kind="component" if pivot is None else "subcomponent")
        _select(prim, choice)
        place = local(pose.translate, self.chunk) - (np.zeros(3) if pivot is None else pivot)
        set_pose(prim, place, pose.rotate, pose.scale)
        facts = {
            **facts,
            "area_type": self.profile.area,
            "asset": choice.asset.name,
            "category": prop.category,
            "country": self.profile.country,
            "segmentation_class": choice.asset.label,
        }
        if self.metadata_only:
            facts["asset_path"] = choice.asset.path
            _describe(prim, choice)
        else:
            prim.instanceable = True
            reference = Sdf.Reference(self.catalogue.reference(choice.asset.path))
            prim.referenceList.prependedItems = [reference]
        apply_schemas(prim, schema)
        set_custom(prim, facts)
        return pose.box(choice.asset.extent(choice.selections))


def _select(prim: Sdf.PrimSpec, choice: Choice) -> None:
    """Selects the variants; of a plant without a choice, the season of the stage."""
    for set_name, variant in sorted(choice.selections.items()):
        prim.variantSelections[set_name] = variant
    if SEASON in choice.asset.variants and SEASON not in choice.selections:
        prim.inheritPathList.prependedItems = [SEASON_CLASS]


def _describe(prim: Sdf.PrimSpec, choice: Choice) -> None:
    """Authors what a reference to the asset would bring, without its geometry."""
    asset = choice.asset
    set_class(prim, asset.label)
    set_extents_hint(prim, asset.extent(choice.selections))
    prim.assetInfo["identifier"] = Sdf.AssetPath(asset.path)
    prim.assetInfo["name"] = asset.name
