"""Errors that OpenUSD raises on faulty stages, as one line for the user."""

import re
from collections.abc import Iterator
from contextlib import contextmanager

from pxr import Tf

from envgen_usd.errors import EnvgenError, error_text

_REASON = re.compile(r": '(.+)'\s*$", re.MULTILINE)


@contextmanager
def usd_errors_named() -> Iterator[None]:
    """Turns an error of OpenUSD in the block into an `EnvgenError`.

    Prims may break rules of OpenUSD that no reader checks one by one, e.g. have a transformation
    without a name.
    """
    try:
        yield
    except UnicodeDecodeError as error:
        raise EnvgenError(
            "the stage holds a name or path that is not UTF-8. Run usdchecker on the stage"
        ) from error
    except Tf.ErrorException as error:
        raise usd_fault(error, "the stage") from error


def usd_fault(error: Tf.ErrorException, what: str) -> EnvgenError:
    """An error of OpenUSD as one line.

    Args:
        error: What OpenUSD raised.
        what: What it was to evaluate, e.g. a prim's transformation.
    """
    text = error_text(error)
    found = _REASON.search(text)
    reason = found[1] if found else text.strip().partition("\n")[0]
    return EnvgenError(
        f"OpenUSD cannot evaluate {what}: {reason.rstrip('.')}. Run usdchecker on the stage"
    )
