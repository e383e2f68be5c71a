"""The command `envgen-usd`: any failure prints a single line and sets the exit code."""

import sys

from envgen_usd.interrupts import Interrupted, end_on_interrupt


def main() -> None:
    """Runs the command.

    Exit codes besides those of the commands: 2 for unusable input and for files that cannot be read
    or written, 130 for an interrupt.
    """
    try:
        end_on_interrupt()
        _run()
    except Interrupted:
        from envgen_usd.errors import INTERRUPTED  # noqa: PLC0415

        _stop("interrupted; run the same command again to resume", "yellow", INTERRUPTED)


def _run() -> None:
    # Imported late: an interrupt before `end_on_interrupt` would print a traceback.
    from envgen_usd.commands.command_line import app  # noqa: PLC0415
    from envgen_usd.errors import BAD_INPUT, EnvgenError  # noqa: PLC0415

    try:
        app()
    except EnvgenError as error:
        _stop(str(error), "red", BAD_INPUT)
    except OSError as error:
        _stop(f"{error.filename or 'a file'}: {error.strerror or error}", "red", BAD_INPUT)


def _stop(text: str, style: str, code: int) -> None:
    from envgen_usd.commands.terminal_output import console  # noqa: PLC0415

    console.print(f"envgen-usd: {text}", style=style, highlight=False, soft_wrap=True, markup=False)
    sys.exit(code)


if __name__ == "__main__":
    main()
