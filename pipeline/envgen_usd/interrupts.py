"""Handling of Ctrl-C: the first interrupt ends the command; later interrupts do nothing."""

import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType, TracebackType

_AGAIN = 0.05
"""Delay before a dropped interrupt is raised again, seconds."""
_IMPORT = "<frozen importlib._bootstrap>"


class Interrupted(BaseException):
    """The user interrupts the command. Not a `KeyboardInterrupt`, which libraries catch."""


_heard = False


def end_on_interrupt() -> None:
    """Lets the first SIGINT or SIGTERM raise `Interrupted` in the main thread.

    Later signals do nothing, so that cleaning up stays undisturbed (a terminal and `timeout` send
    several). Finalisers and imports can drop an exception (OpenUSD's modules swallow it). Such an
    interrupt is raised again a moment later.
    """
    signal.signal(signal.SIGINT, _raise_once)
    signal.signal(signal.SIGTERM, _raise_once)
    report, show = sys.unraisablehook, sys.excepthook

    def dropped(args: "sys.UnraisableHookArgs") -> None:
        if not _come_again(args.exc_type):
            report(args)

    def printed(
        kind: type[BaseException], error: BaseException, trace: TracebackType | None
    ) -> None:
        if not _come_again(kind):
            show(kind, error, trace)

    sys.unraisablehook, sys.excepthook = dropped, printed


@contextmanager
def interrupts_held_back() -> Iterator[None]:
    """Holds interrupts back until the end of the block; processes started inside receive no SIGINT.

    A terminal sends SIGINT to child processes too, and each would print a traceback. The parent
    process ends them instead. Child processes inherit the signal mask.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    held: list[int] = []
    ends = (signal.SIGINT, signal.SIGTERM)
    before = [signal.signal(end, lambda number, _: held.append(number)) for end in ends]
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        for end, handler in zip(ends, before, strict=True):
            signal.signal(end, handler)
        if held:
            signal.raise_signal(held[0])


def _raise_once(_number: int, frame: FrameType | None) -> None:
    global _heard  # noqa: PLW0603 - signals belong to the process
    if _heard:
        return
    if _is_importing(frame):
        _try_again()
        return
    _heard = True
    raise Interrupted


def _is_importing(frame: FrameType | None) -> bool:
    while frame is not None:
        if frame.f_code.co_filename == _IMPORT:
            return True
        frame = frame.f_back
    return False


def _come_again(kind: type[BaseException]) -> bool:
    """Raises a dropped interrupt again; false if no interrupt was dropped."""
    global _heard  # noqa: PLW0603 - signals belong to the process
    if not issubclass(kind, Interrupted):
        return False
    _heard = False
    _try_again()
    return True


def _try_again() -> None:
    main = threading.main_thread().ident
    again = threading.Timer(_AGAIN, signal.pthread_kill, (main, signal.SIGINT))
    again.daemon = True
    again.start()
