"""Chooses assets, variants and poses of the props of a city."""

from collections.abc import Iterator, Mapping, Set
from dataclasses import replace

import numpy as np

from envgen_usd.assets.asset_catalogue import Catalogue
from envgen_usd.assets.variant_choice import Choice, Distribution, choose, drawn_variant, redrawn
from envgen_usd.layers.building_parts import with_openings
from envgen_usd.layers.placed_assets import Prop
from envgen_usd.layers.prop_distributions import (
    distributions,
    fitting,
    sign_asset,
    sign_selections,
    without_bans,
)
from envgen_usd.layers.prop_poses import opening_poses, placement_pose
from envgen_usd.layers.signal_phases import place_key, with_phase
from envgen_usd.models.city_model import AVENUE, ENCLOSURE, City, CityObject, Placement
from envgen_usd.models.environment_profile import Profile
from envgen_usd.seeds import Draws, generator

EACH = {"interior"}
"""Variant sets that are drawn for each opening; all openings of a building share the others."""
OPENINGS = {"WindowSurface": "window", "DoorSurface": "door"}
"""Kind of asset for each class of opening."""
_PAINT = "paint"
"""Variant set of the paint of a shop front."""
_PAINTED = ("door", "window", "shop_fascia")
"""Kinds of a shop front; the first with weights of the paint decides for all of a house."""
ROOF_WINDOW = "roof_window"
"""Kind of asset for openings in slopes."""


def choose_props(  # noqa: PLR0913, PLR0917 - what props follow from
    city: City,
    buildings: Mapping[str, CityObject],
    profile: Profile,
    catalogue: Catalogue,
    seed: int,
    beside_parked: Set[str] = frozenset(),
) -> tuple[Prop, ...]:
    """Returns a prop for each placement, window and door; each id once.

    Args:
        city: City of a chunk.
        buildings: Its drawn buildings by prim name.
        profile: Environment; gives the weights of assets and variants.
        catalogue: Asset library.
        seed: Random seed of the build.
        beside_parked: Ids of the small signs at kerbs where vehicles park: none of them forbids
            it.

    Raises:
        EnvgenError: The profile names an asset or a variant that the library lacks.
    """
    known = distributions(profile, catalogue)
    lenient = {**known, **without_bans(known, catalogue)} if beside_parked else known
    owners = {part.id: name for name, top in buildings.items() for part in top.walk()}
    props: dict[str, Prop] = {}
    paints = _Paints(known, seed)
    for feature in city.walk():
        if feature.placement is not None and feature.placement.template in known:
            owner = owners.get(feature.id, "")
            weights = lenient if feature.id in beside_parked else known
            choice = _choice(feature, feature.placement, weights, catalogue, seed)
            choice = paints.applied(choice, owner)
            props[feature.id] = _standing(feature, feature.placement, choice, owner)
    for name, building in buildings.items():
        found = _openings(name, building, known, catalogue, seed)
        props.update(
            (prop.id, replace(prop, choice=paints.applied(prop.choice, name))) for prop in found
        )
    return tuple(props.values())


def _choice(
    feature: CityObject,
    placement: Placement,
    known: Mapping[str, Distribution],
    catalogue: Catalogue,
    seed: int,
) -> Choice:
    """The asset of a placement; the lights of a junction share their design."""
    kind, key = placement.template, str(feature.attributes.get(AVENUE, feature.id))
    if kind == "traffic_light":
        choice = choose(catalogue, known[kind], generator(seed, "props", place_key(placement)))
        return with_phase(choice, feature, placement, seed)
    if kind == "gate":
        return _gate(feature, placement, known, catalogue, seed)
    choice = choose(catalogue, known[kind], generator(seed, "props", key))
    return sign_asset(feature, catalogue) or choice


def _gate(
    feature: CityObject,
    placement: Placement,
    known: Mapping[str, Distribution],
    catalogue: Catalogue,
    seed: int,
) -> Choice:
    """A gate that fits its gap; in a fence it has the fence's variants, where it has them."""
    key = str(feature.attributes.get(AVENUE, feature.id))
    wide = float(placement.size[1])
    of_width = fitting(known["gate"], "gate", catalogue, wide)
    choice = choose(catalogue, of_width, generator(seed, "props", "gate", key))
    if feature.attributes.get(ENCLOSURE) != "fence" or "fence" not in known:
        return choice
    fence = choose(catalogue, known["fence"], generator(seed, "props", key)).selections
    variants = choice.asset.variants
    shared = {name: to for name, to in fence.items() if to in variants.get(name, ())}
    return Choice(choice.asset, {**choice.selections, **shared})


class _Paints:
    """Paints of shop fronts: doors, windows and boards of a house agree."""

    def __init__(self, known: Mapping[str, Distribution], seed: int) -> None:
        weighted = [known[kind].variants for kind in _PAINTED if kind in known]
        self._weights = next((sets[_PAINT] for sets in weighted if _PAINT in sets), {})
        self._seed = seed
        self._drawn: dict[tuple[str, str], str] = {}

    def applied(self, choice: Choice, building: str) -> Choice:
        """The choice in the paint of its building, where its asset has any."""
        paints = choice.asset.variants.get(_PAINT, ())
        there = {name: weight for name, weight in self._weights.items() if name in paints}
        if not building or not there:
            return choice
        key = building, choice.asset.name
        if key not in self._drawn:
            value = float(generator(self._seed, "props", building, _PAINT).random())
            self._drawn[key] = drawn_variant(there, value)
        return Choice(choice.asset, {**choice.selections, _PAINT: self._drawn[key]})


def _standing(feature: CityObject, placement: Placement, choice: Choice, building: str) -> Prop:
    choice = Choice(choice.asset, {**choice.selections, **sign_selections(feature, choice.asset)})
    if placement.template == "traffic_light":
        # Its width is that of the head; lenses stay round.
        placement = replace(placement, size=np.array([0.0, 0.0, placement.size[2]]))
    pose = placement_pose(placement, choice.asset.size(choice.selections))
    return Prop(feature.id, choice, pose, placement.template, building)


def _openings(
    name: str,
    building: CityObject,
    known: Mapping[str, Distribution],
    catalogue: Catalogue,
    seed: int,
) -> Iterator[Prop]:
    """Windows and doors of a building; all windows share a look besides `EACH`, as do all doors."""
    choices: dict[str, Choice] = {}
    fits: dict[tuple[str, float], tuple[str, Distribution]] = {}
    surfaces = (s for part in building.walk() for s in with_openings(part.surfaces))
    openings = [surface for surface in surfaces if surface.kind in OPENINGS]
    poses = opening_poses([opening.polygons for opening in openings])
    for opening, pose in zip(openings, poses, strict=True):
        if pose is None:
            continue
        category = ROOF_WINDOW if pose.rotate[0] > 0.0 else OPENINGS[opening.kind]
        if category not in known:
            continue
        kind = category, round(float(pose.scale[0]), 3)
        if kind not in fits:
            distribution = fitting(known[category], category, catalogue, kind[1])
            fits[kind] = f"{category} {sorted(distribution.assets)}", distribution
        key, distribution = fits[kind]
        if key not in choices:
            choices[key] = choose(
                catalogue, distribution, generator(seed, "props", building.id, key)
            )
        draws = Draws(seed, "props", opening.id)
        yield Prop(
            opening.id, redrawn(choices[key], distribution, EACH, draws), pose, category, name
        )
