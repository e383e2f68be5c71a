"""The command `envgen-usd`: what stops it becomes one line and an exit code."""

import sys

from envgen_usd.interrupts import Interrupted, end_on_interrupt


def main() -> None:
    """Runs the command.

    Exit codes besides the commands' own: 2 for input that cannot be used and for files that cannot
    be read or written, 130 for an interrupt.
    """
    try:
        end_on_interrupt()
        _run()
    except Interrupted:
        _stop("interrupted; the same command goes on from here", "yellow", 130)


def _run() -> None:
    # Imported only now: an interrupt that comes before `end_on_interrupt` prints a traceback.
    from envgen_usd.cli import app  # noqa: PLC0415
    from envgen_usd.errors import EnvgenError  # noqa: PLC0415

    try:
        app()
    except EnvgenError as error:
        _stop(str(error), "red", 2)
    except OSError as error:
        _stop(f"{error.filename or 'a file'}: {error.strerror or error}", "red", 2)


def _stop(text: str, style: str, code: int) -> None:
    from envgen_usd.printing import console  # noqa: PLC0415

    console.print(f"envgen-usd: {text}", style=style, highlight=False, soft_wrap=True, markup=False)
    sys.exit(code)


if __name__ == "__main__":
    main()
