"""From the words of a command line to an exit code."""

import json
import signal
import sys
import threading
import traceback
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from io import TextIOWrapper

from clockdrive.cli.commands import COMMANDS, Command
from clockdrive.cli.exit_codes import DONE, FAILED, INTERRUPTED, USAGE
from clockdrive.cli.parser import parser, shielded
from clockdrive.errors import ClockdriveError, ConfigurationError, InputError
from clockdrive.refusal import refusal
from mounts.errors import DriveError
from pointing.errors import PointingError
from transports.errors import TransportError

OUR_ERRORS = (ClockdriveError, PointingError, DriveError, TransportError)


def run(argv: Sequence[str] | None = None) -> int:
    """Run one command; return its exit code."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="replace")  # a console that lacks ° or − shows ?, and goes on
    words = shielded(sys.argv[1:] if argv is None else argv)
    args = parser().parse_args(words)
    command: Command = COMMANDS[args.command]
    try:
        with _interruptible():
            command(args)
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:  # the reader of our output went away, as `head` does
        sys.stderr.close()
        return FAILED
    except OSError as error:  # all others are translated where they arise
        print(f"clockdrive: the output cannot be written: {error.strerror}", file=sys.stderr)
        return FAILED
    except OUR_ERRORS as error:
        return _refused(error, as_json=args.json)
    except Exception:  # noqa: BLE001 - whatever else it is, a person is told what to do with it
        traceback.print_exc()
        print("clockdrive: this is a fault of the program; send the lines above and the file that", file=sys.stderr)
        print("clockdrive: `clockdrive report` writes; the telescope was left safe", file=sys.stderr)
        return FAILED
    return DONE


def _refused(error: Exception, *, as_json: bool) -> int:
    reachable = getattr(error, "reachable_utc", None) or getattr(error, "reachable", None)
    text = "".join(each if each.isprintable() or each == "\n" else "\N{REPLACEMENT CHARACTER}" for each in str(error))
    answer = refusal(text, reachable)
    if as_json:
        print(json.dumps(answer))
    else:
        print(f"clockdrive: {text}", file=sys.stderr)
        if reachable is not None:
            print(f"clockdrive: it can be reached from {answer['reachable_utc']}", file=sys.stderr)
    return USAGE if isinstance(error, InputError | ConfigurationError) else FAILED


@contextmanager
def _interruptible() -> Iterator[None]:
    """Let SIGTERM, and a closed terminal, stop the telescope as Ctrl-C does; once, as stopping takes a moment."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    interrupted = False

    def interrupt(_number: int, _frame: object) -> None:
        nonlocal interrupted
        if not interrupted:
            interrupted = True
            raise KeyboardInterrupt

    before = {
        number: signal.signal(number, interrupt)
        for number in (getattr(signal, name, None) for name in ("SIGINT", "SIGTERM", "SIGHUP"))
        if number is not None
    }
    try:
        yield
    except ImportError:
        if interrupted:  # what a compiled module makes of it that was just being loaded
            raise KeyboardInterrupt from None
        raise
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
