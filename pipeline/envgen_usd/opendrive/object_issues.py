"""Issues of objects and signals: those without a place in the city, and assumed shapes."""

from collections import Counter
from collections.abc import Iterable, Iterator

from envgen_usd.errors import Issue, Severity
from envgen_usd.models.road import Road, RoadNetwork
from envgen_usd.models.road_feature import RoadFeature
from envgen_usd.models.road_objects import Origin, RoadObject
from envgen_usd.models.road_surface import Patch
from envgen_usd.models.signals import Signal
from envgen_usd.opendrive.document.findings import MOST_PER_KIND
from envgen_usd.opendrive.features.barriers import ALONE
from envgen_usd.opendrive.features.object_kinds import FLAT, UNKNOWN, Kind, element_length, kind_of
from envgen_usd.opendrive.features.signal_relations import signal_origin
from envgen_usd.opendrive.mesh.grade_separation import is_bridge
from envgen_usd.opendrive.mesh.tunnel_tubes import is_tunnel
from envgen_usd.opendrive.strips.signal_paint import crosswalk_object

_LEFT_OUT = "left out"


def object_issues(
    network: RoadNetwork, features: Iterable[RoadFeature], patches: Iterable[Patch]
) -> tuple[Issue, ...]:
    """Returns an issue for each object or signal that is not in the city, or has an assumed shape.

    So each object of the file is in the city or in an issue, whatever the reason.

    Args:
        network: The roads.
        features: All features of the network.
        patches: Patches with an area.
    """
    shown = {feature.origin: feature for feature in features}
    paint = {patch.origin for patch in patches}
    return tuple(_bounded(_issues(network, shown, paint)))


def _issues(
    network: RoadNetwork, shown: dict[Origin | None, RoadFeature], paint: set[Origin | None]
) -> Iterator[Issue]:
    for road in network.roads.values():
        for number, each in enumerate(road.objects):
            origin = Origin(road.id, "object", number, each.id)
            if origin in shown:
                yield from _assumptions(road, each, shown[origin])
            elif origin not in paint:
                yield from _unplaced_object(road, each)
        for number, signal in enumerate(road.signals):
            origin = signal_origin(road, number)
            if origin not in shown and origin not in paint and not signal.reference:
                yield _unplaced_signal(road, signal)


def _assumptions(road: Road, road_object: RoadObject, feature: RoadFeature) -> Iterator[Issue]:
    """Yields what is decided beyond the file for an object in the city."""
    if feature.template == UNKNOWN:
        text = f"objects of type {road_object.type!r}{_named(road_object)} are unknown"
        action = "kept as a point without a shape" if feature.pose else "kept as a plain body"
        yield _issue("object.unknown_type", Severity.INFO, road, road_object, text, action)
    single = not road_object.repeats and not road_object.outlines
    if single and kind_of(road_object).section and not element_length(road_object):
        text = "the barrier has neither a repeat nor an outline nor a length"
        action = f"{ALONE:g} m long"
        yield _issue("object.no_length", Severity.WARNING, road, road_object, text, action)


def _unplaced_object(road: Road, road_object: RoadObject) -> Iterator[Issue]:
    kind = kind_of(road_object)
    if road_object.type in {"tunnel", "bridge"}:
        if not is_tunnel(road, road_object) and not is_bridge(road, road_object):
            text = f"the {road_object.type} covers no stretch of the road"
            yield _issue("object.no_place", Severity.WARNING, road, road_object, text, _LEFT_OUT)
        return
    if road_object.reference:
        text = f"object {road_object.reference} applies to this road too"
        action = "placed once, at its own road"
        yield _issue("object.reference", Severity.INFO, road, road_object, text, action)
    elif kind.name == "part":
        text = f"{road_object.name or road_object.type} is part of another model"
        yield _issue("object.part", Severity.INFO, road, road_object, text, _LEFT_OUT)
    elif kind.template == "pole":
        text = "a sign stands at the pole, with a post of its own"
        yield _issue("object.post_of_sign", Severity.INFO, road, road_object, text, _LEFT_OUT)
    else:
        text = _reason(road_object, kind)
        yield _issue("object.no_place", Severity.WARNING, road, road_object, text, _LEFT_OUT)


def _reason(road_object: RoadObject, kind: Kind) -> str:
    """Returns why an object has no place in the city."""
    if road_object.repeats:
        return "no instance of its repeats has a place on the road"
    sized = road_object.radius > 0 or (road_object.length > 0 and road_object.width > 0)
    if not road_object.outlines and not sized:
        return "it has no outline, no radius, and no length with width"
    if kind.name == "road_mark" and not road_object.outlines:
        return f"its name {road_object.name!r} tells no shape, and it has no outline"
    if kind.name == "structure":
        return "bridges and tunnels are elements of their own"
    if kind.template == FLAT:
        return "no part of its area lies on a lane"
    return "its outline has no area, or intersects itself"


def _unplaced_signal(road: Road, signal: Signal) -> Issue:
    shown = crosswalk_object(road, signal)
    if shown:
        text, action = f"object {shown} is the crosswalk of the signal", "painted once"
        return _issue("signal.same_crosswalk", Severity.INFO, road, signal, text, action)
    text = f"type {signal.type!r}{_named(signal)} is a road mark without a known shape on a lane"
    return _issue("signal.no_shape", Severity.WARNING, road, signal, text, _LEFT_OUT)


def _named(source: RoadObject | Signal) -> str:
    return f" and name {source.name!r}" if source.name else ""


def _issue(  # noqa: PLR0913, PLR0917 - what an issue consists of
    kind: str,
    severity: Severity,
    road: Road,
    source: RoadObject | Signal,
    text: str,
    action: str,
) -> Issue:
    tag = "signal" if isinstance(source, Signal) else "object"
    element = source.type if source.type in {"tunnel", "bridge"} else tag
    element += "Reference" if source.reference else ""
    where = f"road[id={road.id}]/{tag}s/{element}[id={source.id}]"
    return Issue(kind, severity, where, text, action, source.line)


def _bounded(issues: Iterable[Issue]) -> Iterator[Issue]:
    """Yields the first issues of each kind, then the count of the others."""
    counts: Counter[str] = Counter()
    for issue in issues:
        counts[issue.kind] += 1
        if counts[issue.kind] <= MOST_PER_KIND:
            yield issue
    for kind, count in counts.items():
        if count > MOST_PER_KIND:
            text = f"{count - MOST_PER_KIND} more of this kind"
            yield Issue(kind, Severity.WARNING, "OpenDRIVE", text, "treated like the others")
