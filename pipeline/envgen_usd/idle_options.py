"""Options that a command would ignore are refused: their user expects an effect."""

from collections.abc import Mapping

from envgen_usd.errors import EnvgenError


def refuse_idle(given: Mapping[str, object], reason: str) -> None:
    """Refuses options without an effect.

    Args:
        given: Name of each option; its value is true if the user gave it.
        reason: Why they have none, e.g. ``without --osm FILE``.

    Raises:
        EnvgenError: One of them is given.
    """
    idle = [option for option, is_given in given.items() if is_given]
    if idle:
        verb = "has" if len(idle) == 1 else "have"
        left = "it" if len(idle) == 1 else "them"
        raise EnvgenError(f"{', '.join(idle)}: {verb} no effect {reason}; leave {left} out")
