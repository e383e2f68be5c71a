"""What sources call their actors, and the sizes of those that come without."""

from dataclasses import dataclass

from envgen_usd.errors import Issue, Severity

Size = tuple[float, float, float]
"""Length, width and height, metres."""

SIZES: dict[str, Size] = {
    "car": (4.4, 1.8, 1.5),
    "van": (5.5, 2.0, 2.4),
    "truck": (9.0, 2.5, 3.6),
    "bus": (12.0, 2.55, 3.2),
    "train": (30.0, 2.4, 3.5),
    "motorcycle": (2.2, 0.9, 1.7),
    "bicycle": (1.8, 0.65, 1.75),
    "pedestrian": (0.5, 0.5, 1.75),
}
"""Sizes of actors that come without, by kind."""

_WORDS = {
    "car": "car passenger taxi private emergency authority vip hov evehicle automobile auto sedan "
    "hatchback compact small medium luxury ego army police suv wagon estate custom1 custom2 "
    "default_vehtype default_taxitype subcompact executive other mpv default multivan",
    "van": "van delivery pickup minibus ambulance transporter delivery_van sprinter",
    "truck": "truck lorry trailer semitrailer heavy heavy_truck firetruck tractor wheel_loader "
    "semitractor workingmachine work_machine default_containertype",
    "bus": "bus coach default_bustype",
    "train": "train tram rail rail_urban rail_electric rail_fast subway trolley default_railtype "
    "cable_car",
    "motorcycle": "motorcycle motorbike moped mc motorcyclist default_motorcycletype scooter",
    "bicycle": "bicycle bike cyclist default_biketype kick_scooter standup_scooter",
    "pedestrian": "pedestrian person walker human adult child man woman wheelchair "
    "default_pedtype default_persontype",
}
_KIND_OF = {word: kind for kind, words in _WORDS.items() for word in words.split()}
_LONGEST = {"pedestrian": 1.0, "bicycle": 2.1, "motorcycle": 2.6, "car": 5.2, "van": 7.0}
"""Greatest length of a kind, metres, for actors of which only the size is known."""
_NARROW = 1.1
"""Width below which a short actor has no two tracks, metres."""


def kind_of(name: str) -> str:
    """Returns the kind of actor that a name means; empty for unknown names.

    The whole name counts first, then its parts: ``car_red`` is a car.
    """
    word = name.strip().lower().replace("-", "_").replace(" ", "_")
    if word in _KIND_OF:
        return _KIND_OF[word]
    parts = [part.rstrip("0123456789") for part in word.replace(".", "_").split("_")]
    known = [_KIND_OF[part] for part in parts if part in _KIND_OF]
    return known[0] if known else ""


def kind_of_size(size: Size) -> str:
    """Returns the kind of actor that has such a length and width."""
    length, width, _ = size
    narrow = width < _NARROW
    for kind, longest in _LONGEST.items():
        if length <= longest and narrow == (kind in {"pedestrian", "bicycle", "motorcycle"}):
            return kind
    return "truck"


@dataclass(frozen=True)
class ActorFacts:
    """What is known of an actor beside its path.

    Attributes:
        kind: One of `KINDS`.
        size: Metres.
        model: What the source calls its type.
    """

    kind: str
    size: Size
    model: str = ""


def facts_of(
    actor: str, names: tuple[str, ...], size: Size | None, source: str
) -> tuple[ActorFacts, tuple[Issue, ...]]:
    """Returns kind and size of an actor, and an issue where they had to be guessed.

    Args:
        actor: Id of the actor.
        names: What the source calls its kind and type, in order of precedence.
        size: Metres; `None` or numbers that are not above 0 where the source gives none.
        source: Name of the file, for the issue.
    """
    called = next((name for name in names if name), "")
    model = next((name for name in reversed(names) if name), "")
    kind = next((kind for kind in map(kind_of, names) if kind), "")
    given = size is not None and all(0.0 < value < 1e3 for value in size)
    if kind:
        return ActorFacts(kind, size if size and given else SIZES[kind], model), ()
    kind = kind_of_size(size) if size and given else "car"
    text = f"'{called}' is no known kind" if called else "has no kind"
    issue = Issue(
        "traffic.unknown_kind",
        Severity.WARNING,
        f"{source}: actor {actor}",
        text,
        f"{kind}, by its size" if given else f"{kind} of usual size",
    )
    return ActorFacts(kind, size if size and given else SIZES[kind], model), (issue,)
