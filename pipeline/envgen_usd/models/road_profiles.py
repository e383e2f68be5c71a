"""Lateral profiles of a road (ASAM OpenDRIVE, 10.5)."""

from dataclasses import dataclass

from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.cubics import Cubics
from envgen_usd.models.frozen_model import Model


@dataclass(frozen=True, repr=False, eq=False)
class Shapes(Model):
    """Lateral profile (10.5.2): cubics in t at cross-sections along s.

    Attributes:
        s: K, metres, cross-sections in ascending order.
        profiles: K, height by t at each cross-section.
    """

    s: FloatArray
    profiles: tuple[Cubics, ...]


@dataclass(frozen=True, repr=False, eq=False)
class SurfaceStrip(Model):
    """A strip of a crossSectionSurface (10.5.3) with its height polynomial in t.

    Attributes:
        id: Positive left of the reference line, negative right.
        mode: ``relative`` or ``independent``.
        width: Width by s.
        constant: Constant term by s.
        linear: Linear term by s.
        quadratic: Quadratic term by s.
        cubic: Cubic term by s.
    """

    id: int
    mode: str
    width: Cubics
    constant: Cubics
    linear: Cubics
    quadratic: Cubics
    cubic: Cubics


@dataclass(frozen=True, repr=False, eq=False)
class CrossSectionSurface(Model):
    """Cross-section from strips (10.5.3); replaces superelevation and shape.

    Attributes:
        t_offset: t of the innermost border by s.
        strips: Strips from the reference line outwards, left and right.
    """

    t_offset: Cubics
    strips: tuple[SurfaceStrip, ...]
