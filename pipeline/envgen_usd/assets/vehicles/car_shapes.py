"""Cars: skin, windows, lamps, wheels, mirrors and plates as parts of an asset."""

from dataclasses import replace

import numpy as np
import shapely

from envgen_usd.assets.asset_design import Model, Part, Subset
from envgen_usd.assets.polygon_mesh import Mesh, merge, welded
from envgen_usd.assets.shapes.printed_faces import PrintedFaces
from envgen_usd.assets.vehicles.body_shell import (
    Skin,
    cut_skin,
    joined,
    mirrored,
    open_edges,
    skin_of,
    stitched,
)
from envgen_usd.assets.vehicles.car_design import Car, Livery
from envgen_usd.assets.vehicles.car_details import lower_regions, window_regions
from envgen_usd.assets.vehicles.car_fittings import (
    display,
    far_wheels,
    handles,
    mirrors,
    plates,
    roof_cases,
    roof_fittings,
    wheel_centres,
    wheel_figures,
    wheels,
)
from envgen_usd.assets.vehicles.car_form import FAR, NEAR, CarForm
from envgen_usd.assets.vehicles.car_panes import cabin_panes
from envgen_usd.assets.vehicles.car_skin import CarSkin, car_skin
from envgen_usd.assets.vehicles.skin_shapes import filled

PAINTED = ("Body", "Bumpers", "MirrorCaps", "Handles", "Far/Paint")
"""Parts and subsets in the colour of the paint."""
_WELL = 0.30
"""Depth of the wheel arches, metres."""
_SKIN_PARTS = (
    ("Body", "car_white", "bodywork"),
    ("Bumpers", "car_white", "bumper"),
    ("Panes", "car_glass", "pane"),
    ("Trim", "car_trim", "frame"),
    ("Gaps", "car_underbody", "bodywork"),
    ("Grille", "car_plastic", "bodywork"),
    ("HeadLamps", "lens_clear", "headlamp"),
    ("LampHousings", "lens_housing", "headlamp"),
    ("TailLamps", "lens_red", "tail_lamp"),
    ("Indicators", "lens_amber", "indicator"),
    ("Underbody", "car_underbody", "bodywork"),
)
"""Parts of the skin with their materials and labels."""


def car_model(car: Car, prints: PrintedFaces, displays: PrintedFaces | None = None) -> Model:
    """All parts of a car, and its far mesh; with its display, where displays are given."""
    skin = car_skin(car.form, NEAR)
    meshes = shell_meshes(car, skin)
    parts = [
        Part(name, meshes[name], material, label)
        for name, material, label in _SKIN_PARTS
        if name in meshes
    ]
    if not car.display:
        parts = [_with_cabin(part) if part.name == "Panes" else part for part in parts]
    if car.livery is not None and car.livery.stripe:
        parts.append(Part("Stripe", meshes["Stripe"], car.livery.stripe, "bodywork"))
    parts += mirrors(car, skin)
    parts += handles(car, skin)
    parts += plates(car, skin, prints)
    parts += wheels(car)
    parts += roof_cases(car, skin)
    if displays is not None:
        parts += display(car, skin, displays)
    if car.livery is not None:
        parts = [*_liveried(parts, car.livery), *roof_fittings(car, skin, car.livery, prints)]
    far = _far_part(car, [part.name for part in parts])
    return Model((*parts, far), custom=wheel_figures(wheel_centres(car), car.form.wheel))


def _with_cabin(panes: Part) -> Part:
    return replace(panes, mesh=cabin_panes(panes.mesh), material="car_cabin")


def _liveried(parts: list[Part], livery: Livery) -> list[Part]:
    """The parts with the paint of a livery; other names keep them from the paints of variants."""
    return [
        replace(part, name=f"Livery{part.name}", material=livery.paint)
        if part.name in PAINTED
        else part
        for part in parts
    ]


def _far_part(car: Car, replaced: list[str]) -> Part:
    """The whole car for the distance: paint, glass, lamps and wheels as subsets of a mesh."""
    skin = car_skin(car.form, FAR)
    lamps = lower_regions(car.form, skin, car.face, car.doors, far=True)
    paint = ("Paint", "car_white") if car.livery is None else ("Livery", car.livery.paint)
    lower, lid = _stitched_together(cut_skin(skin.lower, lamps), {"": skin.lid})
    cabin = cut_skin(skin.cabin, window_regions(car.form, skin, car.glazing, far=True))
    found = {
        (*paint, "bodywork"): [lower[""], cabin[""], lid[""], skin.roof],
        ("Panes", "car_glass", "pane"): [cabin["Panes"]],
        ("HeadLamps", "lens_clear", "headlamp"): [lower["HeadLamps"]],
        ("TailLamps", "lens_red", "tail_lamp"): [lower["TailLamps"]],
        ("Dark", "car_plastic", "bodywork"): [lower["Grille"], lower["Gaps"]],
    }
    meshes = {key: mirrored(joined(skins)) for key, skins in found.items() if sum(map(len, skins))}
    wheel, rim = far_wheels(car)
    meshes |= {("Wheels", "car_tyre", "wheel"): wheel, ("Rims", "car_rim", "wheel"): rim}
    ends = np.cumsum([0, *(len(mesh.face_sizes) for mesh in meshes.values())])
    subsets = tuple(
        Subset(name, np.arange(start, end), material, label)
        for (name, material, label), start, end in zip(meshes, ends[:-1], ends[1:], strict=True)
    )
    first, *others = replaced
    whole = welded(merge(list(meshes.values())), 1e-5)
    return Part("Far", whole, "car_white", "bodywork", double_sided=True, proxy_of=first,
                stands_for=tuple(others), subsets=subsets)  # fmt: skip


def shell_meshes(car: Car, skin: CarSkin) -> dict[str, Mesh]:
    """The closed skin of a car, by part."""
    regions = lower_regions(car.form, skin, car.face, car.doors)
    if car.livery is not None and car.livery.stripe:
        low, high = car.livery.band
        start, end = (skin.side + axle for axle in car.form.axles)
        regions["Stripe"] = shapely.box(start - 0.1, low, end + 0.2, high)
    lower = cut_skin(skin.lower, regions)
    lower.pop("Arch", None)
    cabin = cut_skin(skin.cabin, window_regions(car.form, skin, car.glazing))
    roof = {"": skin.roof}
    if car.face.joints:  # bellows cut the edge between wall and roof
        cabin, roof = _stitched_together(_jointed(cabin, car, skin), roof)
    lid = cut_skin(skin.lid, {"Bed": _bed_area(car), "Gaps": _bonnet_gap(car)})
    bed = lid.pop("Bed")
    lower, lid = _stitched_together(lower, lid)
    found: dict[str, list[Skin]] = {}
    for pieces in (roof, lower, cabin, lid):
        for name, piece in pieces.items():
            if len(piece):
                found.setdefault(name or "Body", []).append(piece)
    outside = joined([*lower.values(), *lid.values()])
    if car.bed is not None:
        found["Grille"].append(_bed(bed, car.bed[2]))
    found["Underbody"] = [_underbody(car.form, outside), _cabin_floor(car.form, skin)]
    return {name: mirrored(joined(skins)) for name, skins in found.items()}


def _jointed(cabin: dict[str, Skin], car: Car, skin: CarSkin) -> dict[str, Skin]:
    """The pieces of a cabin with its bellows."""
    alongs, ways = skin.walls[:, 1], skin.walls[:, 0]
    first, last = (int(np.searchsorted(ways, corner - 1e-9)) for corner in skin.corners[:2])
    side = slice(first, last + 1)
    at = np.interp(car.face.joints, alongs[side], ways[side])
    bellows = shapely.union_all([shapely.box(way - 0.3, 0.0, way + 0.3, 9.0) for way in at])
    found: dict[str, list[Skin]] = {}
    for name, piece in cabin.items():
        cut = cut_skin(piece, {"Gaps": bellows})
        found.setdefault("Gaps", []).append(cut["Gaps"])
        found.setdefault(name, []).append(cut[""])
    return stitched({name: joined(pieces) for name, pieces in found.items()}, by_params=True)


def _stitched_together(
    one: dict[str, Skin], other: dict[str, Skin]
) -> tuple[dict[str, Skin], dict[str, Skin]]:
    """Pieces of two skins, e.g. flank and lid; gaps and lamps may end at the edge between both."""
    both = stitched(
        {**{f"<{name}": piece for name, piece in one.items()},
         **{f">{name}": piece for name, piece in other.items()}}
    )  # fmt: skip
    halves = [{name[1:]: piece for name, piece in both.items() if name[0] == side} for side in "<>"]
    return halves[0], halves[1]


def _bonnet_gap(car: Car) -> shapely.Geometry:
    """The gap beside and before the bonnet, in along and y, whose first is negative x."""
    form = car.form
    edge = form.x(car.form.cabin.base.front + 0.1)
    front = form.x(0.24)
    half = form.width / 2
    line = shapely.LineString(
        [(-front, -0.1), (-front, half * 0.45), (-front + 0.22, half * 0.74), (-edge, half * 0.84)]
    )
    return line.buffer(0.004, cap_style="flat")


def _bed_area(car: Car) -> shapely.Geometry:
    """The opening of an open bed, in the parameters of the lid."""
    if car.bed is None:
        return shapely.Polygon()
    start, end, _ = car.bed
    half = car.form.width / 2 - 0.13
    return shapely.box(-float(car.form.x(start)), -1.0, -float(car.form.x(end)), half)


def _bed(lid: Skin, floor: float) -> Skin:
    """Walls and floor of an open bed below what was cut out of the lid."""
    starts, ends = open_edges(lid)
    rim = (np.abs(starts[:, 1]) > 1e-6) | (np.abs(ends[:, 1]) > 1e-6)
    a, b = starts[rim], ends[rim]
    a_low, b_low = (np.column_stack([each[:, :2], np.full(len(each), floor)]) for each in (a, b))
    corners = np.concatenate([np.stack([a, b, b_low], 1), np.stack([a, b_low, a_low], 1)])
    seam = np.concatenate([a_low, b_low])
    seam = seam[np.abs(seam[:, 1]) < 1e-6]
    seam = seam[seam[:, 0].argsort()]
    level = filled(
        (np.concatenate([a_low, seam[:1]]), np.concatenate([b_low, seam[-1:]])),
        np.array([0.0, 0.0, 1.0]),
    )
    return joined([skin_of(corners, corners[..., :2]), level])


def _underbody(form: CarForm, outside: Skin) -> Skin:
    """Linings of the wheel arches and the floor: they close the skin below."""
    starts, ends = open_edges(outside)
    inside = form.width / 2 - _WELL
    pieces = []
    for axle in form.axles if form.arch >= 0.0 else ():
        # Open edges around the wheel, above the floor.
        away = np.abs((starts + ends)[:, 0] / 2 - form.x(axle))
        near = (away < form.wheel + form.arch + 0.08) & ((starts + ends)[:, 2] > 2 * form.sill)
        near &= (starts[:, 2] < form.wheel * 2 + 0.2) & (starts[:, 1] > 0.5 * form.width / 2)
        a, b = starts[near], ends[near]
        a_in, b_in = a.copy(), b.copy()
        a_in[:, 1] = b_in[:, 1] = inside
        corners = np.concatenate([np.stack([b, a, a_in], 1), np.stack([b, a_in, b_in], 1)])
        pieces.append(skin_of(corners, corners[..., [0, 2]]))
        feet = np.concatenate([a_in, b_in])
        feet = feet[np.abs(feet[:, 2] - form.sill) < 1e-6]
        last = feet[feet[:, 0].argsort()]
        wall = filled(
            (np.concatenate([a_in, last[:1]]), np.concatenate([b_in, last[-1:]])),
            np.array([0.0, 1.0, 0.0]),
        )
        pieces.append(wall)
    starts, ends = open_edges(joined([outside, *pieces]))
    low = (np.abs(starts[:, 2] - form.sill) < 1e-6) & (np.abs(ends[:, 2] - form.sill) < 1e-6)
    seam = np.concatenate([starts[low], ends[low]])
    seam = seam[np.abs(seam[:, 1]) < 1e-6]
    seam = seam[seam[:, 0].argsort()]
    floor = filled(
        (np.concatenate([starts[low], seam[:1]]), np.concatenate([ends[low], seam[-1:]])),
        np.array([0.0, 0.0, -1.0]),
    )
    return joined([*pieces, floor])


def _cabin_floor(form: CarForm, skin: CarSkin) -> Skin:
    """Closes the cabin below the belt, where nobody sees it."""
    starts, ends = open_edges(skin.cabin)
    low = (starts[:, 2] < form.cabin.foot + 1e-6) & (ends[:, 2] < form.cabin.foot + 1e-6)
    a, b = starts[low], ends[low]
    seam = np.concatenate([a, b])
    seam = seam[np.abs(seam[:, 1]) < 1e-6]
    seam = seam[seam[:, 0].argsort()]
    return filled(
        (np.concatenate([a, seam[:1]]), np.concatenate([b, seam[-1:]])), np.array([0.0, 0.0, -1.0])
    )
