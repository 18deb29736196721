"""Where a command begins: all that takes long to load is loaded where an interruption already counts."""

from collections.abc import Sequence

from clockdrive.cli.exit_codes import INTERRUPTED


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command; return its exit code."""
    try:
        from clockdrive.cli.command_line import run  # noqa: PLC0415 - see above

        return run(argv)
    except KeyboardInterrupt:  # before it had begun, so that there is nothing to say
        return INTERRUPTED
