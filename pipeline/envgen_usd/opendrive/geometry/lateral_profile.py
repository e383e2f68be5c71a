"""Height of a road across its width without superelevation (ASAM OpenDRIVE 1.8.1, 10.5)."""

import numpy as np

from envgen_usd.models.array_types import FloatArray
from envgen_usd.models.road import Road
from envgen_usd.models.road_profiles import CrossSectionSurface, Shapes, SurfaceStrip


def lateral_height(road: Road, s: FloatArray, t: FloatArray) -> FloatArray:
    """Returns the height by shape or crossSectionSurface above the tilted plane or reference line.

    Args:
        road: The road.
        s: N, metres.
        t: N, metres to the left.

    Returns:
        N, metres.
    """
    if road.cross_section is not None:
        return _strip_height(road.cross_section, s, t)
    if road.shapes is not None and len(road.shapes.s):
        return _shape_height(road.shapes, s, t)
    return np.zeros(np.broadcast(s, t).shape)


def _shape_height(shapes: Shapes, s: FloatArray, t: FloatArray) -> FloatArray:
    """Interpolates linearly between the lateral profiles before and after s."""
    profiles = np.array([profile(t) for profile in shapes.profiles])
    after = np.clip(np.searchsorted(shapes.s, s, side="right"), 1, max(len(shapes.s) - 1, 1))
    before = after - 1
    after = np.minimum(after, len(shapes.s) - 1)
    span = np.maximum(shapes.s[after] - shapes.s[before], 1e-9)
    part = np.clip((s - shapes.s[before]) / span, 0.0, 1.0)
    place = np.arange(len(t))
    height: FloatArray = profiles[before, place] * (1 - part) + profiles[after, place] * part
    return height


def _strip_height(surface: CrossSectionSurface, s: FloatArray, t: FloatArray) -> FloatArray:
    """Returns the height by strips, from the reference line outwards on either side."""
    lateral = t - surface.t_offset(s)
    height = np.zeros(np.broadcast(s, t).shape)
    for side in (1, -1):
        strips = sorted((p for p in surface.strips if p.id * side > 0), key=lambda p: abs(p.id))
        inner, base = np.zeros_like(height), np.zeros_like(height)
        for strip in strips:
            outwards = side * lateral - inner
            width = strip.width(s) if len(strip.width.start) else np.full_like(height, np.inf)
            start = base if strip.mode == "relative" else 0.0
            within = start + _strip_polynomial(strip, s, np.clip(outwards, 0.0, width))
            height = np.where(side * lateral >= inner, within, height)
            width = np.where(np.isfinite(width), width, 0.0)
            base = start + _strip_polynomial(strip, s, width)
            inner = inner + width
    return height


def _strip_polynomial(strip: SurfaceStrip, s: FloatArray, t: FloatArray) -> FloatArray:
    value: FloatArray = strip.constant(s) + t * (
        strip.linear(s) + t * (strip.quadratic(s) + t * strip.cubic(s))
    )
    return value
