"""Reads the elevation and lateral profile of a road (chapter 10)."""

from collections.abc import Iterator

import numpy as np

from envgen_usd.models.cubics import NO_CUBICS, Cubics
from envgen_usd.models.road_profiles import CrossSectionSurface, Shapes, SurfaceStrip
from envgen_usd.opendrive.document.findings import Element, Findings
from envgen_usd.opendrive.document.number_attributes import needed
from envgen_usd.opendrive.elements.cubic_elements import read_cubics, sort_siblings


def read_profile(profile: Element | None, tag: str, findings: Findings) -> Cubics:
    """Reads cubics by s: ``elevation`` of an elevationProfile, ``superelevation`` of a lateral."""
    if profile is None:
        return NO_CUBICS
    return read_cubics(list(profile.iterchildren(tag)), "s", findings)


def read_shapes(profile: Element | None, findings: Findings) -> Shapes | None:
    """Reads the shapes of a lateralProfile by s (10.5.2); `None` without shapes."""
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
    """Reads the crossSectionSurface of a lateralProfile (10.5.3); `None` without that element."""
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
