"""Street furniture; users stand at, or face, +x."""

import numpy as np

from envgen_usd.assets.asset_design import Model, Part
from envgen_usd.assets.polygon_mesh import Mesh, merge
from envgen_usd.assets.shapes.simple_solids import box, flat, lathe, moved, post, tube, turned


def bench() -> Model:
    """A bench of 1.8 m with slats on two frames; seated people face +x."""
    seat = [box((-0.05 + k * 0.11, -0.9, 0.42), (0.04 + k * 0.11, 0.9, 0.46)) for k in range(4)]
    lean = np.radians(12)
    tilt = np.array([[np.cos(lean), 0, -np.sin(lean)], [0, 1, 0], [np.sin(lean), 0, np.cos(lean)]])
    back = [
        moved(turned(box((-0.02, -0.9, z), (0.02, 0.9, z + 0.09)), tilt), (-0.06, 0.0, 0.44))
        for z in (0.12, 0.25)
    ]
    frames = []
    for y in (-0.75, 0.75):
        frames += [
            box((-0.06, y - 0.025, 0.37), (0.36, y + 0.025, 0.42)),
            box((0.28, y - 0.025, 0.0), (0.34, y + 0.025, 0.37)),
            box((-0.04, y - 0.025, 0.0), (0.02, y + 0.025, 0.37)),
            moved(turned(box((-0.025, y - 0.025, 0.0), (0.0, y + 0.025, 0.36)), tilt),
                  (-0.075, 0.0, 0.42)),
        ]  # fmt: skip
    parts = (
        Part("Slats", merge([*seat, *back]), "wood", "seat"),
        Part("Frame", merge(frames), "metal_dark", "frame"),
    )
    return Model(parts)


def bin_() -> Model:
    """A litter bin on a foot."""
    body = lathe(np.array([[0.17, 0.14], [0.20, 0.20], [0.22, 0.85], [0.23, 0.88]]), 14)
    lid = lathe(np.array([[0.235, 0.88], [0.235, 0.91], [0.10, 0.98], [0.0, 0.99]]), 14)
    foot = lathe(np.array([[0.16, 0.0], [0.16, 0.03], [0.05, 0.05], [0.05, 0.16]]), 12)
    parts = (
        Part("Body", merge([body, foot]), "paint_green", "body"),
        Part("Lid", lid, "metal_dark", "lid"),
    )
    return Model(parts)


def bollard() -> Model:
    """A steel bollard with a reflecting band."""
    body = lathe(np.array([[0.055, 0.0], [0.055, 0.90], [0.045, 0.94], [0.0, 0.96]]), 14)
    band = lathe(np.array([[0.057, 0.72], [0.057, 0.80]]), 14)
    parts = (
        Part("Post", body, "paint_grey", "post"),
        Part("Band", band, "paint_white", "reflector"),
    )
    return Model(parts)


def hydrant() -> Model:
    """A pillar hydrant with two side outlets."""
    body = lathe(
        np.array(
            [[0.16, 0.0], [0.16, 0.05], [0.11, 0.07], [0.11, 0.50], [0.14, 0.53], [0.14, 0.57],
             [0.12, 0.62], [0.07, 0.70], [0.03, 0.72], [0.03, 0.77], [0.0, 0.78]]
        ), 14,
    )  # fmt: skip
    outlet = tube(np.array([[0.0, -0.19, 0.42], [0.0, 0.19, 0.42]]), np.full(2, 0.055), 10)
    front = tube(np.array([[0.05, 0.0, 0.40], [0.18, 0.0, 0.40]]), np.full(2, 0.065), 10)
    parts = (Part("Body", merge([body, outlet, front]), "paint_red", "body"),)
    return Model(parts)


def delineator() -> Model:
    """A delineator post with a black band and a reflector towards +x."""
    body = lathe(np.array([[0.06, 0.0], [0.06, 0.98], [0.03, 1.02], [0.0, 1.03]]), 8)
    band = lathe(np.array([[0.062, 0.72], [0.062, 0.92]]), 8)
    reflector = box((0.055, -0.025, 0.74), (0.066, 0.025, 0.90))
    parts = (
        Part("Post", body, "paint_white", "post"),
        Part("Band", band, "paint_black", "reflector"),
        Part("Reflector", reflector, "paint_orange", "reflector"),
    )
    return Model(parts)


_WAVE = (
    (0.145, 0.44), (0.145, 0.455), (0.215, 0.50), (0.215, 0.54), (0.155, 0.575), (0.155, 0.605),
    (0.215, 0.64), (0.215, 0.68), (0.145, 0.725), (0.145, 0.74),
)  # fmt: skip
"""Cross-section of a W-beam (AASHTO M 180: about 310 mm high, 80 mm deep), as x and z, metres."""


def guard_rail_post(*, double: bool) -> Model:
    """Posts of a guard rail with 4 m of its W-beam along y; the road lies towards +x.

    Args:
        double: A second beam lies below the first.
    """
    uprights = []
    for y in (-1.0, 1.0):
        uprights += [
            box((-0.06, y - 0.05, 0.0), (-0.05, y + 0.05, 0.75)),
            box((0.05, y - 0.05, 0.0), (0.06, y + 0.05, 0.75)),
            box((-0.05, y - 0.006, 0.0), (0.05, y + 0.006, 0.75)),
            box((0.06, y - 0.06, 0.50), (0.15, y + 0.06, 0.68)),
        ]
    beams = [_beam(0.0), *([_beam(-0.34)] if double else [])]
    slab = [box((0.15, -2.0, low), (0.21, 2.0, low + 0.3)) for low in (0.44, 0.10)]
    post_proxy = merge([box((-0.06, y - 0.05, 0.0), (0.06, y + 0.05, 0.75)) for y in (-1.0, 1.0)])
    parts = (
        Part("Post", merge(uprights), "metal_galvanised", "post"),
        Part("Beam", merge(beams), "metal_galvanised", "beam", double_sided=True),
        Part("PostProxy", post_proxy, "metal_galvanised", "post", proxy_of="Post"),
        Part("BeamProxy", merge(slab[: 1 + double]), "metal_galvanised", "beam", proxy_of="Beam"),
    )
    return Model(parts)


def _beam(lift: float) -> Mesh:
    """A sheet of 4 m with the cross-section of a W-beam."""
    wave = np.array(_WAVE) + np.array([0.0, lift])
    count = len(wave)
    near, far = (np.c_[wave[:, 0], np.full(count, y), wave[:, 1]] for y in (-2.0, 2.0))
    k = np.arange(count - 1)
    quads = np.stack([k, k + count, k + 1 + count, k + 1], axis=1)
    return flat(np.concatenate([near, far]), np.full(count - 1, 4), quads.reshape(-1))


def plain_pole() -> Model:
    """A bare pole of 6 m, for objects of type pole."""
    parts = (Part("Post", post(6.0, 0.075, 12, 0.05), "metal_galvanised", "post"),)
    return Model(parts)


def traffic_cone() -> Model:
    """A cone with a white band."""
    base = box((-0.18, -0.18, 0.0), (0.18, 0.18, 0.03))
    body = lathe(np.array([[0.13, 0.03], [0.025, 0.50], [0.0, 0.50]]), 16)
    band = lathe(np.array([[0.096, 0.20], [0.067, 0.33]]), 16)
    parts = (
        Part("Body", merge([base, body]), "paint_orange", "body"),
        Part("Band", band, "paint_white", "reflector"),
    )
    return Model(parts)


def control_box() -> Model:
    """A cabinet for signals or telephones; its doors face +x."""
    body = box((-0.20, -0.40, 0.12), (0.20, 0.40, 1.15))
    plinth = box((-0.18, -0.38, 0.0), (0.18, 0.38, 0.12))
    lid = box((-0.23, -0.43, 1.15), (0.23, 0.43, 1.20))
    doors = [box((0.20, y - 0.19, 0.18), (0.212, y + 0.19, 1.10)) for y in (-0.2, 0.2)]
    louvres = [
        box((0.212, y - 0.12, z), (0.219, y + 0.12, z + 0.018))
        for y in (-0.2, 0.2)
        for z in (0.24, 0.28, 0.32, 0.36)
    ]
    locks = [box((0.212, y - 0.015, 0.60), (0.235, y + 0.015, 0.72)) for y in (-0.05, 0.34)]
    parts = (
        Part("Body", merge([body, lid, *doors, *louvres]), "paint_grey", "body"),
        Part("Locks", merge(locks), "metal_dark", "body"),
        Part("Plinth", plinth, "concrete", "foot"),
    )
    return Model(parts)


def barrel() -> Model:
    """A barrel with two bands."""
    body = lathe(np.array([[0.27, 0.0], [0.29, 0.10], [0.29, 0.80], [0.25, 0.95], [0.0, 0.96]]), 16)
    bands = [lathe(np.array([[0.294, z], [0.294, z + 0.14]]), 16) for z in (0.22, 0.52)]
    parts = (
        Part("Body", body, "paint_orange", "body"),
        Part("Band", merge(bands), "paint_white", "reflector"),
    )
    return Model(parts)


def shelter() -> Model:
    """A bus stop: a glazed shelter of 4 m, open towards +x, with a bench."""
    corners = [(x, y) for x in (-0.65, 0.65) for y in (-1.95, 1.95)]
    posts = [box((x - 0.04, y - 0.04, 0.0), (x + 0.04, y + 0.04, 2.40)) for x, y in corners]
    roof = box((-0.85, -2.10, 2.40), (0.95, 2.10, 2.50))
    # Clear glass shows by its edges and by the printed bands alone.
    panes = [box((-0.66, -1.90, z), (-0.64, 1.90, z + 0.06)) for z in (1.05, 1.45)]
    panes += [
        box((-0.60, y - 0.01, z), (0.30, y + 0.01, z + 0.06))
        for y in (-1.95, 1.95)
        for z in (1.05, 1.45)
    ]
    bars = [box((-0.67, -1.95, z), (-0.63, 1.95, z + 0.04)) for z in (0.22, 2.25)]
    bars += [box((-0.67, y - 0.02, 0.22), (-0.63, y + 0.02, 2.29)) for y in (-0.65, 0.65)]
    bars += [
        box((-0.65, y - 0.02, z), (0.32, y + 0.02, z + 0.04))
        for y in (-1.95, 1.95)
        for z in (0.22, 2.25)
    ]
    bars += [box((0.28, y - 0.02, 0.22), (0.32, y + 0.02, 2.29)) for y in (-1.95, 1.95)]
    seat = box((-0.55, -1.20, 0.43), (-0.20, 1.20, 0.47))
    feet = [box((-0.42, y - 0.03, 0.0), (-0.34, y + 0.03, 0.43)) for y in (-0.9, 0.9)]
    parts = (
        Part("Frame", merge([*posts, roof, *feet, *bars]), "metal_dark", "frame"),
        Part("Pane", merge(panes), "paint_white", "pane"),
        Part("Seat", seat, "wood", "seat"),
    )
    return Model(parts)
