"""Signs of a road file that no sheet of the library has a face for."""

from collections.abc import Iterable

from envgen_usd.assets.asset_catalogue import Catalogue
from envgen_usd.assets.signs.sign_choice import SignalFacts, sign_face
from envgen_usd.city.roads.file_objects import file_object
from envgen_usd.errors import Issue, Severity
from envgen_usd.models.road_feature import RoadFeature

_SIGN = "traffic_sign"


def unknown_signs(features: Iterable[RoadFeature], catalogue: Catalogue) -> tuple[Issue, ...]:
    """Returns an issue for each kind of sign that gets a plain plate of its shape.

    Signs of a kind have the same country, type and subtype, and without a type the same name. The
    issue's place is that of the first one.
    """
    kinds: dict[tuple[str, ...], list[RoadFeature]] = {}
    for feature in features:
        if feature.template != _SIGN:
            continue
        facts = SignalFacts.of(file_object(feature).attributes)
        if sign_face(facts, catalogue.signs) is None:
            typed = facts.type not in {"", "-1"}
            code = (facts.country, facts.type, facts.subtype) if typed else ("", "", "")
            kinds.setdefault((*code, "" if typed else facts.name), []).append(feature)
    return tuple(_issue(kind, alike) for kind, alike in kinds.items())


def _issue(kind: tuple[str, ...], features: list[RoadFeature]) -> Issue:
    names = ("country", "type", "subtype", "name")
    said = ", ".join(f"{name} {value!r}" for name, value in zip(names, kind, strict=True) if value)
    origin = features[0].origin
    return Issue(
        "signal.no_face",
        Severity.INFO,
        origin.path if origin is not None else features[0].id,
        f"no sheet of the library has a face for {len(features)} signs with {said or 'no type'}",
        "plain plates; a [[face]] with the code in signs/<sheet>.toml gives them a face",
    )
