"""`clockdrive polar-align`: what to turn so that axis 1 points where it should, told anew after every turn."""

import argparse
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from clockdrive.cli import display
from clockdrive.cli.backend import Backend, backend, interruption_stops
from clockdrive.cli.spoken import spoken
from clockdrive.cli.standard_input import WITNESSES, StandardInput, refuse_typed_elsewhere
from clockdrive.failures import FAILURES
from pointing.model.words import POLES

_KEYS: dict[str, tuple[str, dict[str, bool]]] = {
    "": ("polar_look", {"turned": True, "another": False}),
    "t": ("polar_look", {"turned": True, "another": True}),
    "s": ("polar_look", {"turned": False, "another": True}),
    "r": ("polar_look", {"turned": False, "another": False}),
    "n": ("polar_anew", {}),
}
_HELP = (
    "Enter: the knobs were turned, look again; t: they were turned, look at another star; s: they were not, look at "
    "another star; r: they were not, look again; n: begin anew; w: write the mount's registers instead; q: leave it"
)


def words(command: argparse.ArgumentParser) -> None:
    """Add the grammar of `polar-align`."""
    command.add_argument("--witness", default="simulator", metavar="WHO", help=f"who sees the sky: {WITNESSES}")
    command.add_argument("--pole", choices=POLES, default="true", help="to which a polar axis shall point")
    command.add_argument("--goal", type=float, default=20.0, metavar="ARCSEC", help="near enough (default 20)")
    command.add_argument(
        "--scatter", type=float, default=1.0, metavar="ARCSEC",
        help="what a look scatters beyond what its witness says: the worm, flexure (default 1)",
    )  # fmt: skip
    command.add_argument("--settle", type=float, default=1.0, metavar="S", help="seconds before a look (default 1)")
    command.add_argument(
        "--write-mount", action="store_true",
        help="turn nothing: write mount_x_mas and mount_y_mas into the file of -c after three stars",
    )  # fmt: skip


def polar_align(args: argparse.Namespace) -> None:
    """Look, advise, wait for the knobs, look again, until the goal, `q` or the end of the input."""
    with backend(args.config, "polar-align") as telescope, interruption_stops(telescope):
        refuse_typed_elsewhere(args.witness, telescope)
        typed = StandardInput()
        states: list[dict[str, Any]] = []
        try:
            states.append(_begun(args, telescope, typed))
            written = _write(args, telescope) if args.write_mount else _turned(args, telescope, typed, states)
        except KeyboardInterrupt:
            if args.json:
                display.as_json({"ok": False, "reason": "interrupted", "states": states})
            raise
        telescope.call("stop")
    if args.json:
        display.as_json({**states[-1], **written, "states": states})


def _begun(args: argparse.Namespace, telescope: Backend, typed: StandardInput) -> dict[str, Any]:
    state = telescope.call(
        "polar_begin",
        _events(telescope, typed),
        witness=args.witness,
        pole=args.pole,
        goal_arcsec=args.goal,
        scatter_arcsec=args.scatter,
        settle_s=args.settle,
    )
    _show(args, state)
    return state


def _turned(
    args: argparse.Namespace, telescope: Backend, typed: StandardInput, states: list[dict[str, Any]]
) -> dict[str, Any]:
    """Look after every turn of the knobs; return what was written of the registers instead, if anything."""
    print(f"clockdrive: {_HELP}", file=sys.stderr, flush=True)
    while states[-1]["step"] != "stop":
        word = _word(typed)
        if word in {None, "q"}:
            break
        if word not in {*_KEYS, "w"}:
            print(f"clockdrive: {word!r}? {_HELP}", file=sys.stderr, flush=True)
            continue
        try:
            if word == "w":
                return _write(args, telescope)
            call, given = _KEYS[word]
            state = telescope.call(call, _events(telescope, typed), **given)
        except FAILURES as error:
            done = "written" if word == "w" else "taken"
            print(f"clockdrive: not {done}: {error}", file=sys.stderr, flush=True)
            continue
        states.append(state)
        _show(args, state)
    return {}


def _word(typed: StandardInput) -> str | None:
    """A line that was typed; None at the end of the input."""
    print("> ", end="", file=sys.stderr, flush=True)
    line = typed.line()
    return line.strip().lower() if line else None


def _write(args: argparse.Namespace, telescope: Backend) -> dict[str, Any]:
    """Put the lean of axis 1 into the mount's registers, and into the configuration file."""
    from clockdrive import configuration_edit  # noqa: PLC0415 - seldom needed

    found = telescope.call("polar_write")
    changes = {f"mount.{name}": found[name] for name in ("mount_x_mas", "mount_y_mas")}
    if args.config is not None:
        configuration_edit.change(Path(args.config), changes)
    said = f"{args.config} was changed" if args.config else "the configuration should say"
    print(
        f"clockdrive: {said}:\n{configuration_edit.lines(changes)}\nclockdrive: `sync` on a star before the next "
        "`goto`; where the drive holds these registers itself, `drive push` writes them",
        file=sys.stderr,
        flush=True,
    )
    return {"written": changes, "file": args.config}


def _show(args: argparse.Namespace, state: Mapping[str, Any]) -> None:
    if not args.json:
        print(spoken("\n".join(state["advice"])), flush=True)


def _events(telescope: Backend, typed: StandardInput) -> Callable[[Mapping[str, Any]], object]:
    """Tell of each star, and let the person answer what is asked."""

    def show(event: Mapping[str, Any]) -> None:
        if not typed.asked(telescope, event):
            print(f"clockdrive: {event['told']}", file=sys.stderr, flush=True)

    return show
