"""`clockdrive commission`: guided small moves that find out what a mount really is.

Nothing moves, and nothing is written into the configuration, without a yes: typed, or `--yes` for all.
"""

import argparse
import os
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import Any

from clockdrive.cli import display
from clockdrive.cli.backend import Backend, backend
from clockdrive.cli.standard_input import WITNESSES, StandardInput, refuse_typed_elsewhere
from clockdrive.errors import InputError

_FORMAT = "drive.position_format"
_FORMAT_VARIABLE = "CLOCKDRIVE_DRIVE__POSITION_FORMAT"
_WITNESSES = f"encoders | {WITNESSES}"
_MARKS = {"confirmed": "ok       ", "refuted": "NOT      ", "measured": "measured ", "untested": "untested "}


def words(command: argparse.ArgumentParser) -> None:
    """Add the grammar of `commission`."""
    command.add_argument("--only", nargs="+", metavar="STEP", default=[], help="these steps, and those they need")
    command.add_argument("--witness", default="encoders", metavar="WHO", help=f"who sees the sky: {_WITNESSES}")
    command.add_argument("--yes", action="store_true", help="move, and write into the file of -c, without asking")


def commission(args: argparse.Namespace) -> None:
    """Show the steps with their bounds, take them, tell what was found, and write it on consent."""
    from clockdrive.commission import steps_of  # noqa: PLC0415 - the mathematics takes 0.2 s to load
    from clockdrive.configuration import load  # noqa: PLC0415 - likewise

    written = load(args.config)
    steps = steps_of(written.drive.kind, args.only)
    if any(step.moves for step in steps):
        for step in steps:
            bound = f"each axis moves at most {step.bound_deg:g}°" if step.moves else "nothing moves"
            print(f"  {step.name:16} {bound:32} {step.finds}", file=sys.stderr)
        _require_consent(args, "Take these steps?")
    has_format = _FORMAT in written.values
    with _any_format() if has_format else nullcontext(), backend(args.config, "commission") as telescope:
        refuse_typed_elsewhere(args.witness, telescope)
        answer = telescope.call(
            "commission",
            _events(telescope, quiet=args.json),
            only=args.only,
            witness=args.witness,
            written={_FORMAT: written.values[_FORMAT]} if has_format else {},
        )
    file = _written(args, answer["changes"])
    if args.json:
        display.as_json({**answer, "file": file})
    elif not answer["changes"]:
        print("the configuration agrees with everything that was found")


@contextmanager
def _any_format() -> Iterator[None]:
    """Open the unit whatever its position format: one that is configured wrongly would keep it from being asked."""
    before = os.environ.get(_FORMAT_VARIABLE)
    os.environ[_FORMAT_VARIABLE] = "auto"
    try:
        yield
    finally:
        del os.environ[_FORMAT_VARIABLE]
        if before is not None:
            os.environ[_FORMAT_VARIABLE] = before


def _events(telescope: Backend, *, quiet: bool) -> Callable[[Mapping[str, Any]], object]:
    """Tell what happens, and let the person answer what is asked, beside the steps."""
    typed = StandardInput()

    def show(event: Mapping[str, Any]) -> None:
        if typed.asked(telescope, event) or quiet:
            return
        if "findings" not in event:
            print(f"{event['number']}/{event['of']} {event['step']}: {event['finds']}", file=sys.stderr, flush=True)
        else:
            for found in event["findings"]:
                print(f"  {_MARKS[found['verdict']]}{found['subject']}: {found['detail']}", flush=True)

    return show


def _written(args: argparse.Namespace, changes: Mapping[str, object]) -> str | None:
    """Write what differs on consent, or show its lines; return the file that was changed."""
    from clockdrive import configuration_edit  # noqa: PLC0415 - only where something was found

    if not changes:
        return None
    if not args.json:
        print(f"the configuration should say:\n{configuration_edit.lines(changes)}")
    if args.config is None or not (args.yes or (not args.json and _agreed(f"Write this into {args.config}?"))):
        return None
    configuration_edit.change(Path(args.config), changes)
    print(f"clockdrive: {args.config} was changed; `sync` before the next `goto`", file=sys.stderr)
    return str(args.config)


def _require_consent(args: argparse.Namespace, question: str) -> None:
    if args.yes:
        return
    if args.json or not sys.stdin.isatty():
        raise InputError("the telescope would move; say --yes, or name steps with --only that do not")
    if not _agreed(question):
        raise InputError("nothing was moved")


def _agreed(question: str) -> bool:
    if not sys.stdin.isatty():
        return False
    print(f"{question} [y/N] ", end="", file=sys.stderr, flush=True)
    return sys.stdin.readline().strip().lower() in {"y", "yes"}
