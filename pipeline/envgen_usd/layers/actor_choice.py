"""Chooses the assets of moving actors by kind, size and what their source calls them."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Usd, UsdGeom

from envgen_usd.assets.asset_catalogue import Asset, Catalogue
from envgen_usd.assets.usd_files import read_layer
from envgen_usd.assets.usd_values import from_vectors
from envgen_usd.errors import Issue, Severity
from envgen_usd.models.actor_looks import MovingLook
from envgen_usd.models.actors import Actor
from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.environment_profile import PropRules
from envgen_usd.seeds import Draws

POSE = "pose"
"""Variant set of people: phases of a walk, standing, sitting."""
MOST_SCALED = 0.1
"""Greatest share by which an asset is scaled to the size of its actor."""
_ALIKE = 0.08
"""Share by which sizes of bodies may differ more than that of the nearest, to be drawn at random;
a larger value shows more bodies, and scales them more."""
_KINDS = {
    "van": ("van", "car"),
    "bicycle": ("cyclist", "bicycle"),
    "motorcycle": ("motorcyclist", "motorcycle"),
}
"""Kinds of assets for a kind of actor with other names, in order of precedence."""
_SELDOM = {"police": 0.01, "ambulance": 0.01, "fire": 0.005, "taxi": 0.05}
"""Weights of bodies with a livery, for sources that do not name them; all others have 1."""
_LIT = "on"
"""Variant of the set `lights` of vehicles that move."""
_LEAST_WEIGHT = 1e-6
"""Weight of what the environment leaves out, so that a body is found for each size."""
_CYCLES = (("walk", "stride_length"), ("pedal", "pedal_distance"))
"""Begin of the names of the poses of a cycle, and the custom data with the metres it covers."""
_STRIDE = 0.82
"""Metres of two steps for each metre of height, for assets that do not say it (Grieve and Gear
1966, adults at usual speed); a larger value moves legs more slowly."""
_VARIANTS_OF = {"van": "van"}
"""Word in the names of bodies that are only for this kind of actor."""
_LABELS = {"van": "car", "pedestrian": "person"}
"""Label of a box that stands in, where it differs from the kind."""
_WHEEL_REACH = 1.3
"""Largest distance of a wheel's mesh from the axle, in radii."""


class ActorChoice:
    """Chooses looks; the same actor of the same seed gets the same look."""

    def __init__(
        self, catalogue: Catalogue, seed: int, props: Mapping[str, PropRules] | None = None
    ) -> None:
        """Takes the library, the seed, and weights of variants by kind, e.g. of paints."""
        self._catalogue = catalogue
        self._seed = seed
        self._props = props or {}
        self._bodies = {
            kind: [*_bodies(catalogue.of_kind(kind))]
            for kind in {asset.kind for asset in catalogue.assets.values()}
        }

    def look(self, actor: Actor) -> MovingLook:
        """Returns the look of an actor."""
        kinds = _KINDS.get(actor.kind, (actor.kind,))
        bodies = next(filter(None, (self._suited(actor.kind, kind) for kind in kinds)), [])
        if not bodies:
            return _stand_in(actor)
        draws = Draws(self._seed, "traffic", actor.id)
        words = {*actor.model.lower().replace("-", "_").split("_")}
        misfit = np.array([abs(np.log(_wanted(actor) / length)) for _, _, length in bodies])
        named = np.array([not words.isdisjoint(_words(selections)) for _, selections, _ in bodies])
        misfit = np.where(named, misfit - 10.0, misfit)
        alike = np.flatnonzero(misfit <= misfit.min() + _ALIKE)
        rules = self._props.get(bodies[int(alike[0])][0].kind, PropRules())
        weights = {str(row): _weight(*bodies[row][:2], rules) for row in alike.tolist()}
        asset, selections, length = bodies[int(draws.choice("body", weights))]
        free = [name for name in asset.variants if name not in selections]
        chosen = {
            **{name: _drawn(name, asset, words, rules, draws) for name in free},
            **selections,
        }
        scale = float(np.clip(_wanted(actor) / length, 1 - MOST_SCALED, 1 + MOST_SCALED))
        return _look(self._catalogue.folder, asset, chosen, scale, actor.kind)

    def bodies(self) -> Iterator[tuple[str, str, FloatArray, float]]:
        """Yields kind of actor, name, size and weight of each body of vehicles in the library.

        An actor whose model has that name gets that body.
        """
        for kind in ("car", "truck", "bus", "motorcycle", "bicycle"):
            kinds = _KINDS.get(kind, (kind,))
            known = next(filter(None, (self._bodies.get(each) for each in kinds)), [])
            for asset, selections, _ in known:
                words = _words(selections)
                own = next((key for key, word in _VARIANTS_OF.items() if word in words), kind)
                box = asset.extent(selections)
                name = "_".join((own, *(selections.values() or [asset.name])))
                rules = self._props.get(asset.kind, PropRules())
                yield own, name, box[1] - box[0], _weight(asset, selections, rules)

    def _suited(self, actor_kind: str, kind: str) -> list[tuple[Asset, dict[str, str], float]]:
        """Bodies of a kind of assets for a kind of actors."""
        bodies = self._bodies.get(kind, [])
        word = _VARIANTS_OF.get(actor_kind, "")
        own = [body for body in bodies if word and word in _words(body[1])]
        others = {word for key, word in _VARIANTS_OF.items() if key != actor_kind}
        general = [body for body in bodies if others.isdisjoint(_words(body[1]))]
        return own or general or bodies


def size_issues(actors: Sequence[Actor], looks: Sequence[MovingLook], source: str) -> list[Issue]:
    """Returns an issue for each kind without assets, and one for actors of another size."""
    issues = []
    for kind in sorted({look.kind for look in looks if not look.asset}):
        count = sum(look.kind == kind for look in looks if not look.asset)
        text = f"the library has no asset for {count} actors of kind {kind}"
        issues.append(
            Issue("traffic.no_asset", Severity.WARNING, source, text, "boxes of their size")
        )
    misfits = [
        (abs(np.log(float(look.size[_axis(actor)]) / _wanted(actor))), actor, look)
        for actor, look in zip(actors, looks, strict=True)
        if look.asset
    ]
    large = [each for each in misfits if each[0] > 0.005]
    if large:
        _, actor, look = max(large, key=lambda each: each[0])
        size = float(look.size[_axis(actor)])
        axis = ("long", "wide", "high")[_axis(actor)]
        text = (
            f"{len(large)} actors have no asset of their size; the largest misfit: {actor.id}, "
            f"{_wanted(actor):.2f} m {axis}, is {size:.2f} m as {look.asset}"
        )
        done = f"the nearest, scaled by at most {100 * MOST_SCALED:.0f} %"
        issues.append(Issue("traffic.size", Severity.INFO, source, text, done))
    return issues


def _axis(actor: Actor) -> int:
    """Axis along which the size of an actor counts: people by height, all others by length."""
    return 2 if actor.kind == "pedestrian" else 0


def _wanted(actor: Actor) -> float:
    return actor.size[_axis(actor)]


def _words(selections: Mapping[str, str]) -> set[str]:
    return {word for variant in selections.values() for word in variant.lower().split("_")}


def _bodies(assets: Iterable[Asset]) -> Iterator[tuple[Asset, dict[str, str], float]]:
    """Assets with each variant that has a size, and that size along the axis that counts."""
    for asset in assets:
        axis = 2 if asset.label == "person" else 0
        sized = sorted({key for key in asset.extents if key[0] not in {"", POSE}})
        for name, variant in sized or [("", "")]:
            selections = {name: variant} if name else {}
            if axis == 2:
                selections = {**selections, **_upright(asset)}
            size = asset.extent(selections)
            own = {key: value for key, value in selections.items() if key != POSE}
            yield asset, own, float((size[1] - size[0])[axis])


def _seldom(selections: Mapping[str, str]) -> float:
    """Returns the weight of a body among others of its size."""
    return min((_SELDOM[word] for word in _words(selections) if word in _SELDOM), default=1.0)


def _upright(asset: Asset) -> dict[str, str]:
    standing = _standing(asset)
    return {POSE: standing} if standing else {}


def _standing(asset: Asset) -> str:
    return next((name for name in asset.variants.get(POSE, ()) if name.startswith("stand")), "")


def _cycle(asset: Asset, begin: str) -> tuple[str, ...]:
    """Poses of a cycle in order: names with this begin and a number at the end."""
    poses = [name for name in asset.variants.get(POSE, ()) if name.startswith(begin)]
    digits = {name: "".join(filter(str.isdigit, name)) for name in poses}
    return tuple(sorted(filter(digits.get, poses), key=lambda name: int(digits[name])))


def _cycle_of(library: Path, asset: Asset) -> tuple[tuple[str, ...], float]:
    """Poses of the cycle of an asset while it moves, and the metres that the cycle covers."""
    for begin, key in _CYCLES:
        poses = _cycle(asset, begin)
        if poses:
            stated = _custom_data(library / asset.path, ((POSE, poses[0]),))
            size = asset.extent({POSE: poses[0]})
            usual = _STRIDE * float(size[1, 2] - size[0, 2])
            found = [float(data[key]) for data in stated if data.get(key)]
            return poses, found[-1] if found else usual
    return (), 0.0


def _weight(asset: Asset, selections: Mapping[str, str], rules: PropRules) -> float:
    """Weight of a body: that of the environment, or else by how common its livery is."""
    stated = [rules.assets[asset.name]] if asset.name in rules.assets else []
    for name, variant in selections.items():
        if name in rules.variants:
            stated.append(rules.variants[name].get(variant, 0.0))
    return max(float(np.prod(stated)), _LEAST_WEIGHT) if stated else _seldom(selections)


def _drawn(name: str, asset: Asset, words: set[str], rules: PropRules, draws: Draws) -> str:
    """A variant of a set: the one that the source names, or a random one of a look.

    Liveries say what a vehicle is for, so they are not drawn.
    """
    variants = asset.variants[name]
    called = [variant for variant in variants if variant.lower() in words]
    if called:
        return called[0]
    if name == "lights" and _LIT in variants:
        return _LIT
    if name in {"livery", POSE, "lights"}:
        return asset.defaults.get(name, variants[0])
    weights = rules.variants.get(name, {})
    known = {variant: float(weights.get(variant, 0.0)) for variant in variants}
    if not any(known.values()):
        known = dict.fromkeys(variants, 1.0)
    return draws.choice(name, known)


def _stand_in(actor: Actor) -> MovingLook:
    length, width, height = actor.size
    box = np.array([[-length / 2, -width / 2, 0.0], [length / 2, width / 2, height]])
    label = _LABELS.get(actor.kind, actor.kind)
    return MovingLook(actor.kind, "", "", label, {}, 1.0, box)


def _look(
    library: Path, asset: Asset, selections: Mapping[str, str], scale: float, kind: str
) -> MovingLook:
    centres, radius, spinning = _wheels(library / asset.path, tuple(sorted(selections.items())))
    cycle, cycle_length = _cycle_of(library, asset)
    standing = _standing(asset)
    shown = {**selections, **({POSE: standing} if standing else {})}
    return MovingLook(
        kind=kind,
        asset=asset.name,
        path=asset.path,
        label=asset.label,
        selections=shown,
        scale=scale,
        box=asset.extent(shown) * scale,
        wheels=centres,
        radius=radius,
        spinning=spinning,
        cycle=cycle,
        cycle_length=cycle_length,
        standing=standing,
    )


def _custom_data(path: Path, selections: Iterable[tuple[str, str]]) -> list[Mapping[str, Any]]:
    """Custom data of an asset and of its selected variants."""
    layer = read_layer(path)
    root = layer.GetPrimAtPath(f"/{layer.defaultPrim}")
    stated: list[Mapping[str, Any]] = [dict(root.customData)]
    for name, variant in selections:
        variants = root.variantSets.get(name)
        if variants and variant in variants.variants:
            stated.append(dict(variants.variants[variant].primSpec.customData))
    return stated


@cache
def _wheels(
    path: Path, selections: tuple[tuple[str, str], ...]
) -> tuple[FloatArray, float, Mapping[str, int]]:
    """Centres (W x 3) and radius of the wheels of an asset, and the meshes that turn with them."""
    stated = _custom_data(path, selections)
    found = [data for data in stated if "wheel_centres" in data and "wheel_radius" in data]
    if not found:
        return np.empty((0, 3)), 0.0, {}
    centres = from_vectors(found[-1]["wheel_centres"]).reshape(-1, 3)
    radius = float(found[-1]["wheel_radius"])
    return centres, radius, _spinning(path, dict(selections), centres, radius)


def _spinning(
    path: Path, selections: Mapping[str, str], centres: FloatArray, radius: float
) -> dict[str, int]:
    """Meshes of the part `wheel` around one axle, by path below the asset, to their wheel."""
    stage = Usd.Stage.Open(str(path))
    root = stage.GetDefaultPrim()
    stage.SetEditTarget(stage.GetSessionLayer())
    for name, variant in selections.items():
        root.GetVariantSet(name).SetVariantSelection(variant)
    found = {}
    for prim in Usd.PrimRange(root):
        label = prim.GetAttribute("semantics:labels:part").Get()
        extent = prim.GetAttribute("extent").Get()
        if not prim.IsA("Mesh") or not label or label[0] != "wheel" or not extent:
            continue
        box = from_vectors(extent)
        away = np.linalg.norm((box.mean(axis=0) - centres)[:, [0, 2]], axis=1)
        side = np.abs((box.mean(axis=0) - centres)[:, 1])
        wheel = int((away + side).argmin())
        around = (box[1] - box[0])[[0, 2]].max() / 2 + away[wheel] < _WHEEL_REACH * radius
        if around and UsdGeom.Xformable(prim).GetOrderedXformOps() == []:
            found[str(prim.GetPath().MakeRelativePath(root.GetPath()))] = wheel
    return found
