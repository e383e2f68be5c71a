"""Draws twigs and leaves on a canvas: what a card of a crown shows."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from PIL import Image, ImageDraw

from envgen_usd.models.array_types import FloatArray

OVERSAMPLING = 3
"""Pixels drawn for each pixel of the texture, in both directions; more give smoother edges."""
_OVAL = 0.43
"""Radius of the oval that leaves keep to, as a share of the picture's side."""
_STEPS = 7
"""Straight pieces of a twig; more give smoother bends."""
_TURNED = np.linspace(0.0, 1.0, _STEPS)
"""Share of its droop that each piece of a twig has."""
_TAPER = np.linspace(1.0, 0.55, _STEPS + 1)
"""Thickness at the ends of the pieces, as shares of that at the foot."""


@dataclass(frozen=True)
class Habit:
    """How twigs branch. Lengths are shares of the picture's side, angles are radians.

    Attributes:
        stems: Angles between the upward direction and the stems that leave the foot.
        length: Length of a stem.
        sides: Side twigs of a stem; each carries half as many twigs itself.
        angle: Angle between a twig and what it grows from.
        reach: Length of a side twig as a share of the stem's.
        droop: Turn towards the picture's foot along a twig.
        wander: Standard deviation of the turns along a twig.
        width: Thickness of a stem's foot.
    """

    stems: tuple[float, ...]
    length: float
    sides: int
    angle: float
    reach: float
    droop: float
    wander: float
    width: float


@dataclass(frozen=True)
class Blade:
    """Form of a leaf.

    Attributes:
        length: Range of lengths, shares of the picture's side.
        breadth: Breadth as a share of the length.
        lobes: Waves along each edge; 0 for a smooth edge.
        count: Number of leaves on a fan of twigs.
    """

    length: tuple[float, float]
    breadth: float
    lobes: int
    count: int


@dataclass(frozen=True)
class Twig:
    """A twig as a line: N x 2 points (x to the right, y up, 0 to 1) and N widths."""

    points: FloatArray
    widths: FloatArray


class Canvas:
    """A square picture with colour and opacity, drawn in a larger size and then averaged."""

    def __init__(self, side: int) -> None:
        """Starts transparent; `side` is the number of pixels of the finished picture."""
        self._side = side * OVERSAMPLING
        self._image = Image.new("RGBA", (self._side, self._side), (0, 0, 0, 0))
        self._draw = ImageDraw.Draw(self._image)

    def copy(self) -> "Canvas":
        """A canvas with the same drawing, on which more can be drawn."""
        other = Canvas(self._side // OVERSAMPLING)
        other._image.paste(self._image)
        return other

    def polygon(self, points: FloatArray, shade: float) -> None:
        """Fills a polygon, N x 2; the shade (0 to 2) is kept in place of a colour."""
        self._draw.polygon(self._places(points), fill=_ink(shade, leaf=True))

    def line(self, twig: Twig, shade: float) -> None:
        """Draws a twig."""
        places = self._places(twig.points)
        widths = np.maximum(np.round(twig.widths * self._side), 1.0).astype(int).tolist()
        for start, end, width in zip(places, places[1:], widths, strict=False):
            self._draw.line([start, end], fill=_ink(shade, leaf=False), width=width)

    def layers(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Mean shade, share of leaf among what is drawn, and opacity: S x S each, row 0 below."""
        drawn = np.asarray(self._image, np.float64)[::-1] / 255.0
        half = OVERSAMPLING
        samples = [drawn[row::half, column::half] for row in range(half) for column in range(half)]
        covered = np.sum([sample[..., 3] for sample in samples], axis=0)
        weight = np.maximum(covered, 1e-9)
        shade = 2.0 * np.sum([s[..., 0] * s[..., 3] for s in samples], axis=0) / weight
        leaf = np.sum([s[..., 1] * s[..., 3] for s in samples], axis=0) / weight
        return shade, leaf, covered / half**2

    def _places(self, points: FloatArray) -> list[tuple[float, float]]:
        x, y = points[:, 0] * self._side, (1.0 - points[:, 1]) * self._side
        return list(zip(x.tolist(), y.tolist(), strict=True))


def _ink(shade: float, *, leaf: bool) -> tuple[int, int, int, int]:
    return round(min(max(127.5 * shade, 0.0), 255.0)), 255 if leaf else 0, 0, 255


def fan(habit: Habit, foot: FloatArray, turn: float, rng: np.random.Generator) -> list[Twig]:
    """Twigs that leave a foot.

    Args:
        habit: How they branch.
        foot: 2, place of the foot in the picture.
        turn: Direction of the fan, counter-clockwise from upwards, radians.
        rng: Random generator.
    """
    twigs = []
    for angle in habit.stems:
        length = habit.length * rng.uniform(0.85, 1.05)
        heading = turn + angle + rng.normal(0, 0.06)
        twigs += _branched(habit, foot, heading, length, habit.width, 2, rng)
    return twigs


def _branched(  # noqa: PLR0913, PLR0917 - pose and size of a twig
    habit: Habit,
    foot: FloatArray,
    heading: float,
    length: float,
    width: float,
    orders: int,
    rng: np.random.Generator,
) -> list[Twig]:
    """A twig with all that grows from it; `orders` of side twigs follow."""
    line = _line(habit, foot, heading, length, width, rng)
    if not orders:
        return [line]
    twigs = [line]
    count = habit.sides if orders == 2 else max(habit.sides // 2, 2)
    places = np.linspace(0.14, 0.96, count) + rng.normal(0, 0.03, count)
    steps = np.linspace(0.0, 1.0, len(line.points))
    for number, place in enumerate(np.clip(places, 0.05, 0.98)):
        start = np.array([np.interp(place, steps, line.points[:, axis]) for axis in (0, 1)])
        side = 1.0 if (number + orders) % 2 else -1.0
        turned = heading + side * habit.angle * rng.uniform(0.7, 1.25)
        reach = habit.reach * length * (1.1 - 0.7 * place) * rng.uniform(0.7, 1.15)
        twigs += _branched(habit, start, turned, reach, 0.62 * width, orders - 1, rng)
    return twigs


def _line(  # noqa: PLR0913, PLR0917 - pose and size of a twig
    habit: Habit,
    foot: FloatArray,
    heading: float,
    length: float,
    width: float,
    rng: np.random.Generator,
) -> Twig:
    # Twigs turn the shorter way round towards straight down.
    droop = habit.droop * np.sign(np.sin(heading)) * _TURNED
    headings = heading + droop + np.cumsum(rng.normal(0, habit.wander, _STEPS))
    moves = np.stack([-np.sin(headings), np.cos(headings)], axis=1) * (length / _STEPS)
    points = np.concatenate([foot[None], foot + np.cumsum(moves, axis=0)])
    return Twig(points, width * _TAPER)


def paint_twigs(canvas: Canvas, twigs: Sequence[Twig], rng: np.random.Generator) -> None:
    """Draws twigs, each in a shade of its own."""
    for twig in twigs:
        canvas.line(twig, float(np.exp(rng.normal(-0.05, 0.2))))


def paint_leaves(
    canvas: Canvas, twigs: Sequence[Twig], blade: Blade, scale: float, rng: np.random.Generator
) -> None:
    """Draws leaves along twigs, the inner and darker ones first.

    Args:
        canvas: Canvas.
        twigs: The thin twigs carry the leaves.
        blade: Form of the leaves.
        scale: Factor of their size.
        rng: Random generator.
    """
    widest = max(twig.widths[0] for twig in twigs)
    thin = [twig for twig in twigs if twig.widths[0] < 0.7 * widest]
    if not blade.count:
        return
    feet, poses, shades = [], [], []
    for rank in range(blade.count):
        twig = thin[rng.integers(len(thin))]
        place = int(rng.integers(1, len(twig.points)))
        along = twig.points[place] - twig.points[place - 1]
        heading = np.arctan2(-along[0], along[1]) + rng.normal(0, 0.9)
        poses.append((heading, scale * rng.uniform(*blade.length)))
        shades.append((0.46 + 0.66 * rank / blade.count) * float(np.exp(rng.normal(0.0, 0.42))))
        feet.append(twig.points[place])
    headings, lengths = np.array(poses).T
    _paint(canvas, _leaves(np.array(feet), headings, lengths, _outline(blade)), shades)


@dataclass(frozen=True)
class _Outline:
    """What all leaves of a form share: T places along the spine, for any length.

    Attributes:
        along: T x 1, shares of the length.
        oval: T, half the breadth of a smooth leaf, shares of the greatest one.
        waves: T, factors of the half breadth.
        breadth: Greatest half breadth as a share of the length.
    """

    along: FloatArray
    oval: FloatArray
    waves: FloatArray
    breadth: float


def _outline(blade: Blade) -> _Outline:
    """The outline of a form; thousands of leaves have it."""
    t = np.linspace(0.0, 1.0, 9 if not blade.lobes else 4 * blade.lobes + 1)
    oval = np.sin(np.pi * t**0.8) ** 0.85
    waves = 1.0 - 0.35 * (0.5 - 0.5 * np.cos(2 * np.pi * blade.lobes * t))
    return _Outline(t[:, None], oval, waves, 0.5 * blade.breadth)


def _leaves(
    feet: FloatArray, headings: FloatArray, lengths: FloatArray, form: _Outline
) -> dict[int, FloatArray]:
    """Two halves of each leaf, a pointed oval: 2 x 2T x 2; by the number of the leaf.

    Leaves stay within a ragged oval: the border of the picture would show as a straight edge.
    """
    ahead = np.stack([-np.sin(headings), np.cos(headings)], axis=1)
    tips = feet + lengths[:, None] * ahead - 0.5
    far = np.hypot(tips[:, 0], tips[:, 1]) > _OVAL * (1.0 + 0.12 * np.sin(9.0 * headings))
    kept = np.flatnonzero(~far)
    ahead, long = ahead[kept, None], lengths[kept, None]
    half = form.breadth * long * form.oval * form.waves
    aside = half[..., None] * np.stack([ahead[..., 1], -ahead[..., 0]], axis=2)
    spine = feet[kept, None] + long[..., None] * form.along * ahead
    halves = [
        np.concatenate([spine, (spine + side * aside)[:, ::-1]], axis=1) for side in (1.0, -1.0)
    ]
    return dict(zip(kept.tolist(), np.stack(halves, axis=1), strict=True))


def _paint(canvas: Canvas, leaves: Mapping[int, FloatArray], shades: Sequence[float]) -> None:
    """Draws leaves in their order; one half of each is lighter."""
    for number, (lighter, darker) in leaves.items():
        canvas.polygon(lighter, shades[number] * 1.08)
        canvas.polygon(darker, shades[number] * 0.9)
