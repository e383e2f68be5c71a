"""What stands on pavements beside seats and bins: posts, boxes, panels, bicycles."""

import numpy as np

from envgen_usd.assets.asset_design import Model, Part
from envgen_usd.assets.polygon_mesh import Mesh, merge, welded
from envgen_usd.assets.shapes.simple_solids import box, flat, lathe, moved, post, tube
from envgen_usd.models.array_types import FloatArray


def bar(points: list[tuple[float, float, float]], radius: float, sides: int = 6) -> Mesh:
    """A round bar through points, metres."""
    return tube(np.array(points, dtype=np.float64), np.full(len(points), radius), sides)


def heritage_bollard() -> Model:
    """A cast-iron bollard of 1.05 m with a white band."""
    body = lathe(
        np.array(
            [[0.11, 0.0], [0.11, 0.10], [0.085, 0.14], [0.07, 0.20], [0.058, 0.80], [0.075, 0.83],
             [0.075, 0.86], [0.05, 0.89], [0.07, 0.95], [0.05, 1.02], [0.0, 1.05]]
        ), 12,
    )  # fmt: skip
    band = lathe(np.array([[0.068, 0.66], [0.066, 0.76]]), 12)
    return Model(
        (
            Part("Post", body, "paint_black", "post"),
            Part("Band", band, "paint_white", "reflector"),
        )
    )


def concrete_bollard() -> Model:
    """A square concrete post of 0.9 m with a pointed top."""
    shaft = box((-0.10, -0.10, 0.0), (0.10, 0.10, 0.82))
    top = lathe(np.array([[0.135, 0.82], [0.10, 0.86], [0.0, 0.90]]), 8)
    return Model((Part("Post", merge([shaft, top]), "concrete", "post"),))


def slim_post() -> Model:
    """A bare post of 3.2 m, as signs and cameras leave behind, with a small box."""
    shaft = post(3.2, 0.045, 10)
    cap = lathe(np.array([[0.05, 3.2], [0.05, 3.22], [0.0, 3.25]]), 10)
    case = box((0.04, -0.09, 2.55), (0.16, 0.09, 2.85))
    return Model((Part("Post", merge([shaft, cap, case]), "metal_galvanised", "post"),))


def banner_post() -> Model:
    """A dark post of 4.5 m with a ball on top and two short arms."""
    shaft = merge([post(0.5, 0.09, 10, 0.075), moved(post(3.9, 0.055, 10), (0.0, 0.0, 0.5))])
    ball = lathe(np.array([[0.03, 4.38], [0.08, 4.44], [0.08, 4.5], [0.0, 4.56]]), 10)
    arms = [bar([(0.0, -0.35, z), (0.0, 0.35, z)], 0.02) for z in (3.2, 4.1)]
    return Model((Part("Post", merge([shaft, ball, *arms]), "paint_black", "post"),))


def utility_pole() -> Model:
    """A wooden pole of 8 m with a cross-arm, insulators and a transformer's bracket."""
    shaft = post(8.0, 0.14, 10, 0.10)
    arm = box((-0.06, -1.0, 7.35), (0.06, 1.0, 7.47))
    braces = [bar([(0.08, y / 20, 6.9), (0.08, y, 7.36)], 0.015, 4) for y in (-0.6, 0.6)]
    caps = np.array([[0.035, 0.0], [0.05, 0.04], [0.03, 0.09], [0.05, 0.13], [0.0, 0.17]])
    insulators = [moved(lathe(caps, 8), (0.0, y, 7.47)) for y in (-0.9, -0.4, 0.4, 0.9)]
    case = moved(lathe(np.array([[0.2, 0.0], [0.2, 0.7], [0.0, 0.75]]), 12), (0.34, 0.0, 5.9))
    return Model(
        (
            Part("Post", merge([shaft, arm]), "wood", "post"),
            Part("Fittings", merge([*braces, *insulators, case]), "metal_galvanised", "body"),
        )
    )


def phone_box() -> Model:
    """A glazed telephone box of 2.4 m; its door faces +x."""
    half = 0.45
    corners = [(x, y) for x in (-half, half) for y in (-half, half)]
    frame = [box((x - 0.05, y - 0.05, 0.0), (x + 0.05, y + 0.05, 2.2)) for x, y in corners]
    frame += [box((-0.5, -0.5, 2.2), (0.5, 0.5, 2.36)), box((-0.5, -0.5, 0.0), (0.5, 0.5, 0.06))]
    frame += [
        box((-half, y - 0.02, z), (half, y + 0.02, z + 0.04))
        for y in (-half, half)
        for z in (0.55, 0.95, 1.35, 1.75)
    ]
    frame += [
        box((x - 0.02, -half, z), (x + 0.02, half, z + 0.04))
        for x in (-half, half)
        for z in (0.55, 0.95, 1.35, 1.75)
    ]
    dome = box((-0.4, -0.4, 2.36), (0.4, 0.4, 2.42))
    panes = [box((-half, y - 0.006, 0.3), (half, y + 0.006, 2.2)) for y in (-half, half)]
    panes += [box((x - 0.006, -half, 0.3), (x + 0.006, half, 2.2)) for x in (-half, half)]
    sills = [box((-half, y - 0.03, 0.0), (half, y + 0.03, 0.3)) for y in (-half, half)]
    sills += [box((x - 0.03, -half, 0.0), (x + 0.03, half, 0.3)) for x in (-half, half)]
    return Model(
        (
            Part("Frame", merge([*frame, dome, *sills]), "paint_red", "frame"),
            Part("Pane", merge(panes), "glass", "pane"),
        )
    )


def bicycle_rack() -> Model:
    """Three hoops across the pavement, with two bicycles; bicycles stand along x."""
    hoops = [
        bar(
            [(-0.35, y, 0.0), (-0.35, y, 0.68), (-0.25, y, 0.78), (0.25, y, 0.78), (0.35, y, 0.68),
             (0.35, y, 0.0)], 0.025,
        )
        for y in (-0.8, 0.0, 0.8)
    ]  # fmt: skip
    frames, wheels, saddles = zip(*[_bicycle(y) for y in (-0.66, 0.14)], strict=True)
    parts = (
        Part("Hoops", merge(hoops), "metal_galvanised", "frame"),
        Part("Bicycles", merge(frames), "paint_blue", "body"),
        Part("Wheels", merge([*wheels, *saddles]), "paint_black", "body"),
        Part("HoopsProxy", merge([_far_hoop(y) for y in (-0.8, 0.0, 0.8)]), "metal_galvanised",
             "frame", double_sided=True, proxy_of="Hoops"),
        Part("WheelsProxy", merge([_far_wheel(x, y) for x in (-0.51, 0.51) for y in (-0.66, 0.14)]),
             "paint_black", "body", double_sided=True, proxy_of="Wheels"),
    )  # fmt: skip
    return Model(parts)


def _far_hoop(y: float) -> Mesh:
    """A hoop as a flat strip."""
    outer = np.array([[-0.38, 0.0], [-0.38, 0.8], [0.38, 0.8], [0.38, 0.0]])
    inner = np.array([[-0.32, 0.0], [-0.32, 0.74], [0.32, 0.74], [0.32, 0.0]])
    return _flat_strip(outer, inner, y)


def _far_wheel(x: float, y: float) -> Mesh:
    """A tyre as a flat ring."""
    angle = np.linspace(0.0, 2 * np.pi, 11)
    rim = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return welded(_flat_strip([x, 0.33] + 0.33 * rim, [x, 0.33] + 0.28 * rim, y))


def _flat_strip(outer: FloatArray, inner: FloatArray, y: float) -> Mesh:
    """Quads between two lines (N x 2: x, z) at y."""
    count = len(outer)
    points = np.concatenate(
        [np.c_[line[:, 0], np.full(count, y), line[:, 1]] for line in (outer, inner)]
    )
    k = np.arange(count - 1)
    quads = np.stack([k, k + 1, k + 1 + count, k + count], axis=1)
    return flat(points, np.full(count - 1, 4), quads.reshape(-1))


def _bicycle(y: float) -> tuple[Mesh, Mesh, Mesh]:
    """Frame, wheels, and saddle with handlebar of a bicycle at y."""
    axles = ((-0.51, 0.33), (0.51, 0.33))
    frame = [
        bar([(-0.51, y, 0.33), (-0.12, y, 0.30), (0.36, y, 0.72)], 0.018, 5),
        bar([(-0.51, y, 0.33), (-0.20, y, 0.72), (0.36, y, 0.76)], 0.016, 5),
        bar([(-0.12, y, 0.30), (-0.22, y, 0.85)], 0.018, 5),
        bar([(0.51, y, 0.33), (0.38, y, 0.70), (0.34, y, 0.95)], 0.018, 5),
    ]
    wheels = [_wheel(x, y, z) for x, z in axles]
    wheels += [bar([(x, y - 0.04, z), (x, y + 0.04, z)], 0.03, 6) for x, z in axles]
    seat = box((-0.34, y - 0.07, 0.85), (-0.10, y + 0.07, 0.90))
    handle = bar([(0.30, y - 0.27, 0.98), (0.36, y, 0.96), (0.30, y + 0.27, 0.98)], 0.014, 5)
    return merge(frame), merge(wheels), merge([seat, handle])


def _wheel(x: float, y: float, z: float) -> Mesh:
    """A tyre, with eight spokes as thin bars."""
    angle = np.linspace(0.0, 2 * np.pi, 17)
    path = np.c_[x + 0.31 * np.cos(angle), np.full(17, y), z + 0.31 * np.sin(angle)]
    tyre = tube(path, np.full(17, 0.02), 5, caps=False)
    spokes = [
        flat(_sliver(x, y, z, turn), np.array([4, 4]), np.array([0, 1, 2, 3, 3, 2, 1, 0]))
        for turn in np.linspace(0.0, np.pi, 4, endpoint=False)
    ]
    return merge([tyre, *spokes])


def _sliver(x: float, y: float, z: float, turn: float) -> FloatArray:
    """A flat strip across a wheel, 4 x 3."""
    along = 0.3 * np.array([np.cos(turn), 0.0, np.sin(turn)])
    across = 0.004 * np.array([-np.sin(turn), 0.0, np.cos(turn)])
    return np.array([x, y, z]) + np.stack(
        [-along - across, along - across, along + across, -along + across]
    )
