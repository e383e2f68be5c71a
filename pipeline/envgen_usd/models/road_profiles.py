"""Lateral profiles of a road (ASAM OpenDRIVE, 10.5)."""

from dataclasses import dataclass

from envgen_usd.models.arrays import FloatArray
from envgen_usd.models.cubics import Cubics


@dataclass(frozen=True)
class Shapes:
    """Lateral profile (10.5.2): at each s, cubics in t.

    Attributes:
        s: K, ascending cross-sections.
        profiles: K, height by t at each.
    """

    s: FloatArray
    profiles: tuple[Cubics, ...]


@dataclass(frozen=True)
class SurfaceStrip:
    """A strip of a crossSectionSurface (10.5.3): its height polynomials along s.

    Attributes:
        id: Positive left of the reference line, negative right.
        mode: ``relative`` or ``independent``.
        width: Width along s.
        constant: Height term along s, by cubics.
        linear: Slope term.
        quadratic: Quadratic term.
        cubic: Cubic term.
    """

    id: int
    mode: str
    width: Cubics
    constant: Cubics
    linear: Cubics
    quadratic: Cubics
    cubic: Cubics


@dataclass(frozen=True)
class CrossSectionSurface:
    """Cross-section by strips (10.5.3); replaces superelevation and shape.

    Attributes:
        t_offset: Along s.
        strips: From the middle outwards, left and right.
    """

    t_offset: Cubics
    strips: tuple[SurfaceStrip, ...]
