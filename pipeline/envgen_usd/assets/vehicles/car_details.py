"""What a car's skin shows: windows, lamps, grilles and gaps, as areas of the skin's parameters."""

from dataclasses import dataclass

import numpy as np
import shapely
from shapely import affinity

from envgen_usd.assets.vehicles.car_form import CarForm, curve
from envgen_usd.assets.vehicles.car_skin import CarSkin
from envgen_usd.models.array_types import FloatArray

Corners = tuple[tuple[float, float], ...]
"""Corners of an area of the lower body: way from the middle of the front or rear, and height."""
_GAP = 0.0045
"""Half the width of gaps between doors and body, metres."""
_TRIM = 0.022
"""Width of the dark rim of windows, metres."""


@dataclass(frozen=True)
class Glazing:
    """Windows of a cabin.

    Attributes:
        pillars: Places of the pillars behind the front side window, shares of the way along the
            side of the cabin.
        pillar: Width of those pillars, metres.
        front: Width of the pillar beside the windscreen.
        side: First and last share of the side that windows take.
        belt: Height of the lower edge of side windows above the shoulder.
        above: Width of the roof's edge above windows.
        rear: Lower edge of the rear window above the shoulder, and the half width of the rear's
            pillars; `None` without a rear window.
        screen: Lower edge of the windscreen above the shoulder.
        brow: Width of the roof's edge above the windscreen.
    """

    pillars: tuple[float, ...] = (0.42, 0.80)
    pillar: float = 0.075
    front: float = 0.075
    side: tuple[float, float] = (0.05, 0.97)
    belt: float = 0.02
    above: float = 0.065
    rear: tuple[float, float] | None = (0.10, 0.10)
    screen: float = 0.07
    brow: float = 0.04


@dataclass(frozen=True)
class Face:
    """Lamps, grille and bumpers.

    Attributes:
        head: Head lamp.
        tail: Tail lamp; its way counts from the middle of the rear.
        indicator: Indicator at the front.
        tail_indicator: Indicator at the rear.
        grille: Opening between the head lamps.
        intake: Opening in the bumper.
        bumpers: Upper edges of the front and the rear bumper, heights.
        cladding: Height of dark cladding above the sill.
        plates: Heights of the plates' middles.
        reversing: Dark field of the rear bumper: lower and upper height.
        fenders: Width of dark cladding around the wheel arches.
        joints: Along of the bellows between sections.
    """

    head: Corners
    tail: Corners
    indicator: Corners
    tail_indicator: Corners
    grille: Corners
    intake: Corners
    bumpers: tuple[float, float] = (0.52, 0.56)
    cladding: float = 0.05
    plates: tuple[float, float] = (0.40, 0.80)
    reversing: tuple[float, float] = (0.24, 0.36)
    fenders: float = 0.0
    joints: tuple[float, ...] = ()


@dataclass(frozen=True)
class Doors:
    """Gaps of doors.

    Attributes:
        edges: Along of the doors' edges, front to rear.
        foot: Height of their lower edge above the sill.
        handles: Along of the handles.
        below: Distance of the handles from the shoulder.
    """

    edges: tuple[float, ...]
    foot: float = 0.11
    handles: tuple[float, ...] = ()
    below: float = 0.11


def rounded(area: shapely.Geometry, radius: float) -> shapely.Geometry:
    """An area with rounded corners."""
    if radius == 0.0:
        return area
    shrunk = area.buffer(-radius, join_style="mitre")
    return shrunk.buffer(radius, quad_segs=2)


def window_regions(
    form: CarForm, skin: CarSkin, glazing: Glazing, *, far: bool = False
) -> dict[str, shapely.Geometry]:
    """Panes and their dark rims on the cabin, by name; for the distance whole bands."""
    screens = [_screen(form, skin, glazing)]
    if glazing.rear is not None:
        screens.append(_rear_window(form, skin, glazing.rear))
    side = _side_windows(form, skin, glazing)
    if far:
        return {
            "Panes": shapely.union_all([side.simplify(0.03), *(s.simplify(0.03) for s in screens)])
        }
    first, last = skin.corners[0], skin.corners[1]
    posts = [
        shapely.box(at - glazing.pillar / 2, 0.0, at + glazing.pillar / 2, 9.0)
        for at in (first + share * (last - first) for share in glazing.pillars)
    ]
    light = side.buffer(-_TRIM, join_style="mitre") if not side.is_empty else side
    panes = [rounded(pane, 0.025) for pane in shapely.get_parts(light - shapely.union_all(posts))]
    glass = shapely.union_all(
        [*panes, *(rounded(each.buffer(-0.5 * _TRIM), 0.05) for each in screens)]
    )
    frames = shapely.union_all(
        [rounded(side, 0.045), *(rounded(each.buffer(0.5 * _TRIM), 0.06) for each in screens)]
    )
    return {"Panes": glass, "Trim": frames}


def _strip(low: FloatArray, high: FloatArray, way: FloatArray) -> shapely.Geometry:
    return shapely.Polygon(
        np.concatenate([np.column_stack([way, low]), np.column_stack([way, high])[::-1]])
    )


def _screen(form: CarForm, skin: CarSkin, glazing: Glazing) -> shapely.Geometry:
    way = np.linspace(0.0, skin.corners[0] - glazing.front, 8)
    along = np.interp(way, skin.walls[:, 0], skin.walls[:, 1])
    edge = np.interp(way, skin.walls[:, 0], skin.walls[:, 2])
    # The belt rises to the corner; the lower edge of the windscreen is level.
    low = np.full(8, float(curve(form.shoulder, along.min())) + glazing.screen)
    return _symmetric(_strip(low, edge - glazing.brow, way), 0.0)


def _rear_window(form: CarForm, skin: CarSkin, rear: tuple[float, float]) -> shapely.Geometry:
    end = skin.corners[2]
    way = np.linspace(skin.corners[1] + rear[1], end, 8)
    edge = np.interp(way, skin.walls[:, 0], skin.walls[:, 2])
    low = np.full(8, float(curve(form.shoulder, form.length)) + rear[0])
    return _symmetric(_strip(low, edge - 0.05, way), end)


def _symmetric(area: shapely.Geometry, middle: float) -> shapely.Geometry:
    """An area with its mirror image, so that its corners at the middle are not rounded."""
    return shapely.union(area, affinity.scale(area, -1.0, 1.0, origin=(middle, 0.0))).buffer(1e-6)


def _side_windows(form: CarForm, skin: CarSkin, glazing: Glazing) -> shapely.Geometry:
    first, last = skin.corners[0], skin.corners[1]
    start, stop = (first + share * (last - first) for share in glazing.side)
    if stop <= start:
        return shapely.Polygon()
    way = np.linspace(start, stop, 14)
    along = np.interp(way, skin.walls[:, 0], skin.walls[:, 1])
    edge = np.interp(way, skin.walls[:, 0], skin.walls[:, 2])
    return _strip(curve(form.shoulder, along) + glazing.belt, edge - glazing.above, way)


def arches(form: CarForm, skin: CarSkin) -> list[shapely.Geometry]:
    """Areas of the flank that the wheel arches take away."""
    if form.arch < 0.0:
        return []
    radius = form.wheel + form.arch
    areas = []
    for axle in form.axles:
        at = skin.side + axle
        circle = shapely.Point(at, form.wheel).buffer(radius, quad_segs=6)
        foot = shapely.box(at - radius * 0.985, -1.0, at + radius * 0.985, form.wheel * 0.85)
        areas.append(shapely.union(circle, foot))
    return areas


def front_area(corners: Corners, radius: float = 0.02) -> shapely.Geometry:
    """An area of the front; corners on the middle line join the mirrored half."""
    if len(corners) < 3 or np.ptp([height for _, height in corners]) <= 0.0:
        return shapely.Polygon()
    area = (
        shapely.convex_hull(shapely.Polygon(corners)) if radius == 0.0 else shapely.Polygon(corners)
    )
    if min(way for way, _ in corners) <= 0.0:
        area = _symmetric(area, 0.0)
    return rounded(area, radius)


def rear_area(corners: Corners, length: float, radius: float = 0.02) -> shapely.Geometry:
    """An area of the rear; its ways count from the middle of the rear."""
    area = front_area(corners, radius)
    return affinity.translate(affinity.scale(area, -1.0, 1.0, origin=(0.0, 0.0)), length, 0.0)


def lower_regions(
    form: CarForm, skin: CarSkin, face: Face, doors: Doors, *, far: bool = False
) -> dict[str, shapely.Geometry]:
    """Areas of the lower body by name, in the order in which they count; few for the distance."""
    length = skin.length
    front_end = skin.side + form.axles[0]
    rear_start = skin.side + form.axles[-1]
    if far:
        return {
            "HeadLamps": front_area(face.head, 0.0),
            "TailLamps": rear_area(face.tail, length, 0.0),
            "Grille": shapely.union(front_area(face.grille, 0.0), front_area(face.intake, 0.0)),
            "Gaps": _joints(skin.side, face.joints),
        }
    arch = shapely.union_all(arches(form, skin))
    plinth = shapely.box(-1.0, 0.0, length + 1.0, form.sill + face.cladding)
    regions = {
        "Arch": arch,
        "Indicators": shapely.union(
            front_area(face.indicator, 0.008), rear_area(face.tail_indicator, length, 0.008)
        ),
        "HeadLamps": _reflectors(front_area(face.head)),
        "LampHousings": front_area(face.head),
        "TailLamps": rear_area(face.tail, length),
        "Grille": shapely.union_all(
            [
                front_area(face.grille, 0.015),
                front_area(face.intake, 0.015),
                plinth,
                arch.buffer(face.fenders, quad_segs=4) if face.fenders else shapely.Polygon(),
                rear_area(
                    ((-0.5, face.reversing[0]), (0.5, face.reversing[0]),
                     (0.42, face.reversing[1]), (-0.42, face.reversing[1])), length,
                ),
            ]
        ),
        "Gaps": shapely.union(_gaps(form, skin, face, doors), _joints(skin.side, face.joints)),
        "Bumpers": shapely.union_all(
            [
                shapely.box(-1.0, -1.0, front_end, face.bumpers[0]),
                shapely.box(rear_start, -1.0, length + 1.0, face.bumpers[1]),
            ]
        ),
    }  # fmt: skip
    return {name: area for name, area in regions.items() if not area.is_empty}


def _joints(side: float, joints: tuple[float, ...]) -> shapely.Geometry:
    """Bellows between the sections of a long vehicle, from the ground to the roof."""
    return shapely.union_all(
        [shapely.box(side + at - 0.3, 0.0, side + at + 0.3, 9.0) for at in joints]
    )


def _reflectors(lamp: shapely.Geometry) -> shapely.Geometry:
    """Two round reflectors behind the glass of a head lamp."""
    low, _, high, _ = lamp.bounds
    discs = []
    for share in (0.30, 0.62):
        at = low + share * (high - low)
        across = shapely.intersection(lamp, shapely.LineString([(at, 0.0), (at, 9.0)]))
        radius = min(0.42 * across.length, 0.06)
        middle = shapely.centroid(across)
        discs.append(affinity.scale(middle.buffer(radius, quad_segs=3), 1.25, 1.0))
    return shapely.union_all(discs)


def _gaps(form: CarForm, skin: CarSkin, face: Face, doors: Doors) -> shapely.Geometry:
    """Gaps around doors, bumpers and the boot lid."""
    around = shapely.union_all(arches(form, skin)).buffer(0.05, quad_segs=4)
    foot = form.sill + doors.foot
    lines = []
    for start, end in zip(doors.edges[:-1], doors.edges[1:], strict=True):
        door = shapely.box(skin.side + start, foot, skin.side + end, 3.0)
        lines.append(
            (door - around).buffer(-0.05).buffer(0.05, quad_segs=2).simplify(0.004).boundary
        )
    front, rear = face.bumpers
    length = skin.length
    if min(face.bumpers) <= 0.0:
        front = rear = -1.0
    lines += [
        shapely.LineString([(-1.0, front), (skin.side + form.axles[0], front)]),
        shapely.LineString([(skin.side + form.axles[-1], rear), (length + 1.0, rear)]),
        shapely.LineString([(length - 0.56, rear), (length - 0.60, 3.0)]),
    ]
    return shapely.union_all(
        [line.buffer(_GAP, cap_style="flat", join_style="mitre") for line in lines]
    )
