"""What is fixed to a car's body: mirrors, handles, wheels and number plates."""

from dataclasses import replace

import numpy as np
from scipy.interpolate import LinearNDInterpolator

from envgen_usd.assets.asset_design import Part
from envgen_usd.assets.polygon_mesh import Mesh, merge
from envgen_usd.assets.shapes.printed_faces import PrintedFaces
from envgen_usd.assets.shapes.simple_solids import box, flat, moved, turned
from envgen_usd.assets.vehicles.body_shell import grid_skin, skin_mesh, smoothed
from envgen_usd.assets.vehicles.car_design import Car, Livery
from envgen_usd.assets.vehicles.car_form import curve
from envgen_usd.assets.vehicles.car_skin import CarSkin
from envgen_usd.assets.vehicles.wheel_shapes import Rim, rim_mesh, tyre
from envgen_usd.models.array_types import FloatArray

_BACK = np.diag([-1.0, -1.0, 1.0])


def surface_y(skin: CarSkin, along: float, z: float) -> float:
    """Y of the flank at a place, metres."""
    params, places = skin.lower.params.reshape(-1, 2), skin.lower.places.reshape(-1, 3)
    return float(LinearNDInterpolator(params, places[:, 1])(np.array([[skin.side + along, z]]))[0])


def both_sides(mesh: Mesh) -> Mesh:
    """A mesh and its mirror image across y = 0."""
    starts = np.concatenate([[0], np.cumsum(mesh.face_sizes)[:-1]])
    order = np.concatenate(
        [np.arange(a, a + n)[::-1] for a, n in zip(starts, mesh.face_sizes, strict=True)]
    )
    flip = np.array([1.0, -1.0, 1.0])
    other = Mesh(
        mesh.points * flip,
        mesh.face_sizes,
        mesh.face_vertices[order],
        mesh.normals[order] * flip,
        mesh.uv[order],
    )
    return merge([mesh, other])


def rounded_block(size: tuple[float, float, float], square: float, rows: int = 5, columns: int = 8
                  ) -> Mesh:  # fmt: skip
    """A superellipsoid of a size about the origin (Barr 1981); larger exponents are squarer."""
    lat = np.linspace(-np.pi / 2, np.pi / 2, rows + 1)[:, None]
    lon = np.linspace(0.0, 2 * np.pi, columns + 1)[None]
    lon[0, -1] = 0.0

    def power(value: FloatArray) -> FloatArray:
        raised: FloatArray = np.sign(value) * np.abs(value) ** (2 / square)
        return raised

    places = np.stack(
        [
            power(np.cos(lat)) * power(np.cos(lon)) * size[0] / 2,
            power(np.cos(lat)) * power(np.sin(lon)) * size[1] / 2,
            power(np.sin(lat)) * np.ones_like(lon) * size[2] / 2,
        ],
        axis=-1,
    )
    params = np.stack(np.broadcast_arrays(lon, lat), axis=-1)
    (skin,) = smoothed([grid_skin(places, params)], 70.0, half=False)
    return skin_mesh(skin)


def mirrors(car: Car, skin: CarSkin) -> list[Part]:
    """Mirrors at the foot of the windscreen's pillars."""
    form = car.form
    if car.mirror == 0.0:
        return []
    corner = float(np.interp(skin.corners[0], skin.walls[:, 0], skin.walls[:, 1]))
    along = corner + 0.28
    z = float(curve(form.shoulder, along)) + 0.07 * car.mirror
    y = form.width / 2 + 0.06
    size = (0.12, 0.22 * car.mirror, 0.14 * car.mirror)
    place = (float(form.x(along)), y, z)
    cap = moved(rounded_block(size, 3.0), place)
    glass = box((-0.003, -size[1] * 0.40, -size[2] * 0.36), (0.003, size[1] * 0.40, size[2] * 0.36))
    glass = moved(glass, (place[0] - size[0] / 2, y, z))
    arm = box((-0.03, -0.12, -0.03), (0.03, 0.02, -0.005))
    arm = moved(arm, (place[0], y - 0.02, z - 0.03))
    return [
        Part("MirrorCaps", both_sides(cap), "car_white", "mirror"),
        Part("Mirrors", both_sides(glass), "car_glass", "mirror"),
        Part("MirrorArms", both_sides(arm), "car_plastic", "mirror"),
    ]


def handles(car: Car, skin: CarSkin) -> list[Part]:
    """Handles of the doors."""
    meshes = []
    for along in car.doors.handles:
        z = float(curve(car.form.shoulder, along)) - car.doors.below
        y = surface_y(skin, along, z)
        grip = rounded_block((0.20, 0.055, 0.034), 3.0, 3, 8)
        meshes.append(moved(grip, (float(car.form.x(along)), y + 0.008, z)))
    if not meshes:
        return []
    return [Part("Handles", both_sides(merge(meshes)), "car_white", "bodywork")]


def wheel_centres(car: Car) -> FloatArray:
    """W x 3, centres of the wheels: left and right of each axle, front to rear."""
    form = car.form
    half = form.width / 2 - (0.025 if form.arch >= 0.0 else 0.35) - form.tyre / 2
    return np.array(
        [(float(form.x(axle)), side * half, form.wheel) for axle in form.axles for side in (1, -1)]
    )


def wheel_figures(centres: FloatArray, radius: float) -> dict[str, float | FloatArray]:
    """What `customData` says about the wheels."""
    return {"wheel_centres": centres, "wheel_radius": radius}


def wheels(car: Car) -> list[Part]:
    """Tyres and rims, each a part of its own; behind skirts plain wheels of steel."""
    form = car.form
    parts = wheel_parts(wheel_centres(car), form.wheel, form.tyre, car.rim)
    if form.arch >= 0.0:
        return parts
    plain = tyre(form.wheel, form.tyre, car.rim, sides=12)
    return [
        replace(part, mesh=moved(plain, tuple(centre.tolist())), material="metal_dark")
        for part, centre in zip(parts[::2], wheel_centres(car), strict=True)
    ]


def wheel_parts(centres: FloatArray, radius: float, width: float, rim: Rim) -> list[Part]:
    """Tyres and rims of axles.

    Args:
        centres: W x 3, left and right of each axle, front to rear.
        radius: Radius of the tyres, metres.
        width: Width of the tyres, metres.
        rim: Design of the rims.
    """
    ends = ("Front", "Rear") if len(centres) == 4 else range(1, len(centres) // 2 + 1)
    names = [f"{end}{side}" for end in ends for side in ("Left", "Right")]
    rubber, metal = tyre(radius, width, rim), rim_mesh(radius, width, rim)
    parts = []
    for name, centre in zip(names, centres, strict=True):
        turn = _BACK if centre[1] < 0 else np.eye(3)
        place = (float(centre[0]), float(centre[1]), float(centre[2]))
        parts += [
            Part(f"Wheel{name}", moved(turned(rubber, turn), place), "car_tyre", "wheel"),
            Part(f"Rim{name}", moved(turned(metal, turn), place), "car_rim", "wheel"),
        ]
    return parts


def plates(car: Car, skin: CarSkin, prints: PrintedFaces) -> list[Part]:
    """Number plates at front and rear, on dark holders."""
    if not any(car.face.plates):
        return []
    name = f"plate_{car.plate}"
    faces, holders = [], []
    for side, height in zip((1, -1), car.face.plates, strict=True):
        if not height:
            continue
        out = abs(surface_x(skin, side, height))
        face = prints.face(name, out + 0.022, height - 0.055)
        holder = box((out - 0.03, -0.265, height - 0.06), (out + 0.020, 0.265, height + 0.06))
        faces.append(face if side > 0 else turned(face, _BACK))
        holders.append(holder if side > 0 else turned(holder, _BACK))
    shown = prints.part("Plates", *faces)
    return [
        replace(shown, label="number_plate"),
        Part("PlateHolders", merge(holders), "car_plastic", "number_plate"),
    ]


def display(car: Car, skin: CarSkin, displays: PrintedFaces) -> list[Part]:
    """The display of the destination above the windscreen, in a flat case before the pane."""
    if not car.display:
        return []
    places = skin.cabin.places.reshape(-1, 3)
    line = places[(np.abs(places[:, 1]) < 1e-6) & (places[:, 0] > 0.0)]
    line = line[line[:, 2].argsort()]
    shown = displays.face(car.display, 0.0, 0.0)
    (_, side, high), foot = shown.points.max(axis=0).tolist(), car.display_foot
    out = float(np.interp(foot, line[:, 2], line[:, 0]))
    case = box(
        (out - 0.12, -side - 0.03, foot - 0.02), (out + 0.016, side + 0.03, foot + high + 0.02)
    )
    return [
        replace(
            displays.part("Display", moved(shown, (out + 0.018, 0.0, foot))), label="sign_face"
        ),
        Part("DisplayCase", case, "car_trim", "sign_back"),
    ]


def surface_x(skin: CarSkin, side: int, z: float) -> float:
    """X of the middle line of the front (side 1) or the rear (-1) at a height, metres."""
    places = skin.lower.places.reshape(-1, 3)
    line = places[(np.abs(places[:, 1]) < 1e-6) & (places[:, 0] * side > 0.0)]
    line = line[line[:, 2].argsort()]
    return float(np.interp(z, line[:, 2], line[:, 0]))


def far_wheels(car: Car) -> tuple[Mesh, Mesh]:
    """Tyres and rims for the distance: octagons that stand out of the flank."""
    form = car.form
    angle = (np.arange(8) + 0.5) * np.pi / 4
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1) * form.wheel / np.cos(np.pi / 8)
    ring[:, 1] = np.maximum(ring[:, 1], -form.wheel)
    outside, inside = form.width / 2 + form.flare + 0.004, form.width / 2 - form.tyre
    points = np.concatenate(
        [np.column_stack([ring[:, 0], np.full(8, y), ring[:, 1]]) for y in (outside, inside)]
    )
    k = np.arange(8)
    tread = np.stack([k, (k + 1) % 8, (k + 1) % 8 + 8, k + 8], axis=1)
    wheel = flat(points, np.array([8, *([4] * 8)]), np.concatenate([k[::-1], tread.reshape(-1)]))
    disc = points[:8] * [car.rim.share, 1.0, car.rim.share] + [0.0, 0.006, 0.0]
    rim = flat(disc, np.array([8]), k[::-1])
    places = [(float(form.x(axle)), 0.0, form.wheel) for axle in form.axles]
    tyres, rims = (
        both_sides(merge([moved(mesh, place) for place in places])) for mesh in (wheel, rim)
    )
    return tyres, rims


def roof_fittings(car: Car, skin: CarSkin, livery: Livery, prints: PrintedFaces) -> list[Part]:
    """The sign or the light bar of a livery."""
    roof = skin.roof.places.reshape(-1, 3)
    top = float(roof[:, 2].max())
    x = float(car.form.x(car.form.cabin.top.front + 0.45))
    parts = []
    if livery.sign:
        foot = box((x - 0.06, -0.20, top - 0.04), (x + 0.06, 0.20, top + 0.005))
        case = rounded_block((0.14, 0.46, 0.15), 6.0, 4, 12)
        face = prints.face(livery.sign, x + 0.072, top + 0.01)
        behind = moved(turned(moved(face, (-x, 0.0, 0.0)), _BACK), (x, 0.0, 0.0))
        parts += [
            Part("SignFoot", foot, "car_plastic", "bodywork"),
            Part("Sign", moved(case, (x, 0.0, top + 0.075)), "car_yellow", "sign_back"),
            replace(prints.part("SignFaces", face, behind), label="sign_face"),
        ]
    if livery.beacon:
        foot = box((x - 0.10, -0.45, top - 0.05), (x + 0.10, 0.45, top + 0.01))
        bar = rounded_block((0.26, 1.10, 0.10), 5.0, 4, 12)
        parts += [
            Part("BeaconFoot", foot, "car_plastic", "bodywork"),
            Part("Beacons", moved(bar, (x, 0.0, top + 0.055)), livery.beacon, "lamp"),
        ]
    return parts


def roof_cases(car: Car, skin: CarSkin) -> list[Part]:
    """Cases of air conditioning and converters on the roof."""
    if not car.roof_boxes:
        return []
    top = float(skin.roof.places[..., 2].max())
    cases = []
    for start, end, half, height in car.roof_boxes:
        case = rounded_block((end - start, 2 * half, 2 * height), 9.0, 4, 12)
        cases.append(moved(case, (float(car.form.x((start + end) / 2)), 0.0, top - 0.05)))
    return [Part("RoofCases", merge(cases), "paint_grey", "bodywork")]
