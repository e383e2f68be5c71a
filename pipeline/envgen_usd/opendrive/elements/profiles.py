"""Elevation and lateral profile of a road (chapter 10)."""

from collections.abc import Iterator

import numpy as np

from envgen_usd.models.cubics import NO_CUBICS, Cubics
from envgen_usd.models.road_profiles import CrossSectionSurface, Shapes, SurfaceStrip
from envgen_usd.opendrive.elements.cubics import read_cubics, sort_siblings
from envgen_usd.opendrive.elements.numbers import needed
from envgen_usd.opendrive.findings import Element, Findings


def read_profile(profile: Element | None, tag: str, findings: Findings) -> Cubics:
    """Cubics by s of an elevationProfile (``elevation``) or lateralProfile (``superelevation``)."""
    if profile is None:
        return NO_CUBICS
    return read_cubics(list(profile.iterchildren(tag)), "s", findings)


def read_shapes(profile: Element | None, findings: Findings) -> Shapes | None:
    """Shape elements of a lateralProfile (10.5.2), grouped by s; nothing if there are none."""
    elements = [] if profile is None else list(profile.iterchildren("shape"))
    if not elements:
        return None
    starts = np.array([needed(element, "s", findings) for element in elements])
    if (np.diff(starts) < 0).any():
        order = sort_siblings(elements, starts, "s", findings)
        elements, starts = [elements[index] for index in order], starts[order]
    places, first = np.unique(starts, return_index=True)
    groups = [elements[a:b] for a, b in zip(first, [*first[1:], len(elements)], strict=True)]
    return Shapes(places, tuple(read_cubics(group, "t", findings) for group in groups))


def read_cross_section(profile: Element | None, findings: Findings) -> CrossSectionSurface | None:
    """The crossSectionSurface of a lateralProfile (10.5.3), if there is one."""
    surface = None if profile is None else profile.find("crossSectionSurface")
    if surface is None:
        return None
    strips = [_strip(strip, findings) for strip in _strips(surface)]
    strips.sort(key=lambda strip: (strip.id < 0, abs(strip.id)))
    return CrossSectionSurface(_coefficients(surface, "tOffset", findings), tuple(strips))


def _strips(surface: Element) -> Iterator[Element]:
    for group in surface.iterchildren("surfaceStrips"):
        yield from group.iterchildren("strip")


def _strip(element: Element, findings: Findings) -> SurfaceStrip:
    return SurfaceStrip(
        int(needed(element, "id", findings)),
        element.get("mode", "relative"),
        *(
            _coefficients(element, tag, findings)
            for tag in ("width", "constant", "linear", "quadratic", "cubic")
        ),
    )


def _coefficients(element: Element, tag: str, findings: Findings) -> Cubics:
    child = element.find(tag)
    if child is None:
        return NO_CUBICS
    elements = list(child.iterchildren("coefficients"))
    for piece in elements:
        for name in "abcd":
            if piece.get(name) is None:  # optional here, unlike elsewhere in the standard
                piece.set(name, "0")
    return read_cubics(elements, "s", findings)
