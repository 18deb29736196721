"""What each command does; the table at the end is the command line."""

import argparse
import math
import sys
import time
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from importlib import import_module
from pathlib import Path
from typing import Any

from clockdrive.cli import display
from clockdrive.cli.backend import Backend, backend, configuration_of, interruption_stops
from clockdrive.configuration_keys import DRIVE_KINDS, READABLE
from clockdrive.errors import InputError, Refused

Command = Callable[[argparse.Namespace], None]


def plan(args: argparse.Namespace) -> None:
    """Plan from given counts without any drive, or from where the telescope is."""
    from clockdrive import parse, planning  # noqa: PLC0415 - the mathematics takes 0.2 s to load

    at = parse.utc(args.at or "now", time.time())
    if args.start is not None:
        configuration = configuration_of(args.config)
        counts, drift = parse.counts(args.start, *planning.counted(configuration)), planning.drift_of(**_rate(args))
        answer = planning.plan_from(
            configuration, _target(args), at, counts, instrument=args.instrument, drift=drift, **_hold(args)
        ).json
    elif args.instrument is not None:
        raise InputError(f"--instrument {args.instrument} goes with --from; `clockdrive instrument` chooses one")
    else:
        with backend(args.config, "plan", keep_tracking=True) as telescope:
            answer = telescope.call(
                "plan", target=_target(args), at=at if args.at else None, **_rate(args), **_hold(args)
            )
    _show(args, answer, display.plan_text)


def rates(args: argparse.Namespace) -> None:
    """Rates need no drive."""
    from clockdrive import parse, planning  # noqa: PLC0415 - as in `plan`

    at = parse.utc(args.at or "now", time.time())
    drift = planning.drift_of(**_rate(args))
    answer = planning.rates_at(
        configuration_of(args.config), _target(args), at, instrument=args.instrument, drift=drift, **_hold(args)
    ).json
    _show(args, answer, display.rates_text)


def passes(args: argparse.Namespace) -> None:
    """Search for passes; nothing is contacted."""
    from clockdrive import parse  # noqa: PLC0415 - as in `plan`
    from clockdrive.pass_search import search  # noqa: PLC0415 - likewise

    at = parse.utc(args.at or "now", time.time())
    configuration = configuration_of(args.config)
    with display.search_bar(quiet=args.json) as show:
        answer = search(configuration, _target(args), at, args.hours, args.above, show)
    _show(args, answer.json, display.passes_text)


def goto(args: argparse.Namespace) -> None:
    """Slew, then track: with a live line for a time or until Ctrl-C, or leave the drive tracking."""
    seconds = _seconds(args)
    stay = args.command == "track" or seconds is not None
    leave = not stay and (args.exit or args.json)
    wishes = {**_rate(args), **_hold(args)}
    with backend(args.config, f"goto {_target(args)}") as telescope, interruption_stops(telescope):
        if leave and not telescope.attached:
            _require_left(telescope.call("plan", target=_target(args), **wishes))
        if leave and not telescope.tracks_alone:
            print(f"clockdrive: {_STOPS}", file=sys.stderr, flush=True)
        with display.progress_bar(quiet=args.json) as show:
            answer = telescope.call("goto", show, target=_target(args), **wishes)
        if not args.json:
            print(display.arrival_text(answer), flush=True)
        telescope.leaves_tracking = leave
        if stay or not (leave or telescope.attached):
            _track(telescope, seconds, quiet=args.json)
        if args.json:
            display.as_json(answer | {"goes_on_tracking": leave and telescope.tracks_alone})


_STOPS = (
    "this drive does not track by itself within limits of its own: the telescope is stopped on arrival; say `--for "
    "TIME`, or have `clockdrive run` in another terminal go on with it"
)


def _require_left(plan: Mapping[str, Any]) -> None:
    """Refuse a target that the drive cannot go on with by itself, before anything moves.

    Raises
    ------
    Refused
        It is followed by direct speed control, which ends with this command.
    """
    if "pass" in plan:
        raise Refused(
            f"{plan['target']} is too fast to be left to the drive alone, and --exit and --json return on arrival: "
            "say how long to follow it, `--for 5m`, or have `clockdrive run` own the telescope, which goes on with it"
        )


def jog(args: argparse.Namespace) -> None:
    """Move one axis."""
    seconds = _seconds(args)
    with backend(args.config, f"jog {args.axis}") as telescope, display.progress_bar(quiet=args.json) as show:
        answer = telescope.call("jog", show, axis=args.axis, deg_s=args.deg_s, seconds=seconds)
    _show(args, answer, display.plan_text)


def go(args: argparse.Namespace) -> None:
    """Go home or to park."""
    with backend(args.config, args.command) as telescope, display.progress_bar(quiet=args.json) as show:
        answer = telescope.call(args.command, show)
    _show(args, answer, display.plan_text)


def flip(args: argparse.Namespace) -> None:
    """Change the posture in which the target is tracked."""
    with (
        backend(args.config, "flip", keep_tracking=True) as telescope,
        interruption_stops(telescope),
        display.progress_bar(quiet=args.json) as show,
    ):
        answer = telescope.call("flip", show)
    _show(args, answer, display.arrival_text)


def simple(args: argparse.Namespace) -> None:
    """Make a call that takes nothing and answers nothing."""
    with backend(args.config, args.command, keep_tracking=args.command != "stop") as telescope:
        _show(args, telescope.call(args.command), lambda answer: f"{args.command}: {_done(answer)}")


def _done(answer: Mapping[str, Any]) -> str:
    if answer.get("was_parked") is False:
        return "it was not parked; nothing is changed"
    return str(answer.get("note", "done"))


def sync(args: argparse.Namespace) -> None:
    """Synchronise on a target, or the rotator alone."""
    angles = {"rotator_angle_deg": args.rotator_angle, "position_angle_deg": args.position_angle}
    if bool(args.target) is any(angle is not None for angle in angles.values()):
        raise InputError(
            "sync: give a target for the axes, or `--rotator-angle DEG` or `--position-angle DEG` for the rotator; "
            "one at a time"
        )
    with backend(args.config, "sync", keep_tracking=True) as telescope:
        answer = telescope.call("sync", target=_target(args), posture=args.posture, force=args.force, **angles)
    _show(args, answer, lambda found: f"synchronised {found['noted']}")


def offset(args: argparse.Namespace) -> None:
    """Displace, clear, or show the offsets."""
    words = list(args.words)
    with backend(args.config, "offset", keep_tracking=True) as telescope:
        if words[:1] == ["clear"]:
            if len(words) == 1:
                raise InputError(
                    "`offset clear NAME`: give the name of a correction, or offset, guide, centre for both of a kind"
                )
            telescope.call("clear", correction=" ".join(words[1:]))
        elif words:
            east, north = _two_numbers(words)
            telescope.call("offset", east_arcsec=east, north_arcsec=north)
        rows = telescope.call("status").get("corrections", [])
    made: dict[str, Any] = {"ok": True, "corrections": [row for row in rows if str(row["name"]).startswith("offset")]}
    _show(
        args,
        made,
        lambda found: (
            "\n".join(f"{row['name']}: {row['value']:+.2f}″" for row in found["corrections"]) or "no offsets"
        ),
    )


def guide(args: argparse.Namespace) -> None:
    """Displace the target by a pulse."""
    with backend(args.config, "guide", keep_tracking=True) as telescope:
        answer = telescope.call("guide", direction=args.direction, milliseconds=args.milliseconds)
    _show(args, answer, display.guide_text)


def centre(args: argparse.Namespace) -> None:
    """Centre the target by a solved image."""
    from clockdrive import parse  # noqa: PLC0415 - as in `plan`

    at = None if args.at is None else parse.utc(args.at, time.time())
    with (
        backend(args.config, "centre", keep_tracking=True) as telescope,
        display.progress_bar(quiet=args.json) as show,
    ):
        answer = telescope.call("centre", show, place=_target(args), at=at, force=args.force)
    _show(args, answer, display.centre_text)


def instrument(args: argparse.Namespace) -> None:
    """Show the pointing origins, or choose one."""
    with (
        backend(args.config, "instrument", keep_tracking=True) as telescope,
        display.progress_bar(quiet=args.json) as show,
    ):
        answer = telescope.call("instrument", show, instrument=args.name)
    _show(args, answer, display.instrument_text)


def status(args: argparse.Namespace) -> None:
    """Show all, once or every second."""
    with backend(args.config, "status", keep_tracking=True) as telescope:
        _show(args, telescope.call("status"), display.status_text)
        while args.watch:
            time.sleep(1.0)
            _show(args, telescope.call("status"), display.status_text)


def run(args: argparse.Namespace) -> None:
    """Own the telescope until interrupted."""
    with backend(args.config, "run", may_attach=False):
        print("clockdrive: owning the telescope; Ctrl-C ends, other commands attach", file=sys.stderr, flush=True)
        while True:
            time.sleep(3600.0)


def simulate(args: argparse.Namespace) -> None:
    """Host a simulator until interrupted."""
    from clockdrive.clock import SystemClock  # noqa: PLC0415 - only here
    from clockdrive.drives import kind_of  # noqa: PLC0415 - likewise
    from transports.serve import addresses, serve  # noqa: PLC0415 - likewise

    configuration = configuration_of(args.config, overrides={"drive.kind": args.kind})
    clock, baud = SystemClock(), configuration.simulator.baud or None
    lines = kind_of(configuration).simulated(configuration, clock.now(), None).lines
    with ExitStack() as served:
        servers = [
            served.enter_context(serve(line, clock, address, baud=baud))
            for line, address in zip(lines, addresses(args.listen, len(lines)), strict=True)
        ]
        where = ", ".join(server.address for server in servers)
        print(f"clockdrive: simulated {args.kind} at {where}; Ctrl-C ends", file=sys.stderr, flush=True)
        while True:
            time.sleep(3600.0)


def config(args: argparse.Namespace) -> None:
    """Check a configuration as a whole, and that this version can do what it asks for."""
    from clockdrive import assembly  # noqa: PLC0415 - as in `plan`
    from pointing.kernel import kernel  # noqa: PLC0415 - likewise

    configuration = configuration_of(args.config, with_files=True)
    assembly.planner(configuration)
    if configuration.targets.kernel is not None:
        kernel(configuration.targets.kernel)
    _show(
        args,
        {"ok": True, "source": configuration.source, "cautions": list(configuration.cautions)},
        lambda found: "\n  ".join((f"{found['source']}: nothing is wrong with it", *found["cautions"])),
    )


def init(args: argparse.Namespace) -> None:
    """Print a commented configuration."""
    from clockdrive.configuration_file import commented_template  # noqa: PLC0415 - only here

    if args.kind not in {None, READABLE} and args.unit is not None:
        raise InputError(
            f"init {args.kind} --from {args.unit}: it keeps none of them; `clockdrive init {args.kind}` writes the "
            f"keys of the {args.kind}, `clockdrive init {READABLE} --from LINK` reads a {READABLE}"
        )
    if args.unit is not None and args.mount is not None:
        raise InputError(f"init --from {args.unit} --mount {args.mount}: the unit's registers say the mount type")
    if args.unit is not None:
        from clockdrive.clock import SystemClock  # noqa: PLC0415 - only here
        from clockdrive.drives import part_of  # noqa: PLC0415 - likewise

        text = part_of(READABLE, "first_configuration").commented_from(args.unit, SystemClock())
    elif args.kind is None:
        raise InputError(f"init: say which drive, {', '.join(DRIVE_KINDS)}, or --from its link")
    else:
        text = commented_template(args.kind, args.mount)
    _show(args, {"ok": True, "toml": text}, lambda found: found["toml"].rstrip("\n"))


def header(args: argparse.Namespace) -> None:
    """Print FITS cards."""
    from clockdrive.fits_header import cards  # noqa: PLC0415 - astropy takes a second to load

    with backend(args.config, "header", keep_tracking=True) as telescope:
        found = cards(telescope.call("status"), configuration_of(args.config))
    _show(args, {"ok": True, "cards": dict(found)}, lambda _: found.tostring(sep="\n", endcard=False, padding=False))


def report(args: argparse.Namespace) -> None:
    """Write the file for help."""
    from clockdrive.report import write_report  # noqa: PLC0415 - only here

    path = write_report(Path(args.output), args.config)
    _show(
        args,
        {"ok": True, "file": str(path)},
        lambda found: (
            f"wrote {found['file']}, with your configuration file as it is: look through it before you give it away"
        ),
    )


def _track(telescope: Backend, seconds: float | None, *, quiet: bool) -> None:
    """Show a live line while the telescope tracks, or does what another command asks; end with what ended it."""
    end = math.inf if seconds is None else time.monotonic() + seconds
    with display.live(quiet=quiet) as show:
        while time.monotonic() < end:
            found = telescope.call("status")
            show(found)
            if found["doing"] in {"idle", "parked"}:
                raise Refused(found["trouble"] or "the telescope was stopped by another command")
            time.sleep(max(0.0, min(1.0, end - time.monotonic())))
    telescope.call("stop")
    if not quiet:
        print("stopped", file=sys.stderr)


def _show(args: argparse.Namespace, answer: Mapping[str, Any], text: Callable[[Mapping[str, Any]], str]) -> None:
    if args.json:
        display.as_json(answer)
    else:
        print(text(answer), flush=True)


def _target(args: argparse.Namespace) -> str:
    from clockdrive import parse  # noqa: PLC0415 - as in `plan`

    return parse.anchored(" ".join(args.target), Path.cwd())


def _rate(args: argparse.Namespace) -> dict[str, Any]:
    """Rates of one's own, as the calls take them."""
    from clockdrive import parse  # noqa: PLC0415 - as in `plan`

    return {
        "rate_arcsec_s": None if args.rate is None else parse.rate(args.rate),
        "rate_from": None if args.rate_from is None else parse.utc(args.rate_from, time.time()),
    }


def _hold(args: argparse.Namespace) -> dict[str, Any]:
    """What the rotator is to hold, as the calls take it."""
    return {"rotator": args.rotator, "position_angle_deg": args.position_angle}


def _seconds(args: argparse.Namespace) -> float | None:
    from clockdrive import parse  # noqa: PLC0415 - as in `plan`

    return None if args.duration is None else parse.duration(args.duration)


def _two_numbers(words: list[str]) -> tuple[float, float]:
    try:
        east, north = (float(word.replace("−", "-")) for word in words)
    except ValueError:
        raise InputError(f"offset {' '.join(words)}: give two numbers, east and north in arcseconds") from None
    return east, north


def _of(module: str, name: str) -> Command:
    """A command that has a module to itself, loaded when it is given."""

    def command(args: argparse.Namespace) -> None:
        getattr(import_module(f"clockdrive.cli.{module}"), name)(args)

    return command


COMMANDS: dict[str, Command] = {
    "centre": centre,
    "commission": _of("commission_command", "commission"),
    "config": config,
    "drive": _of("drive_command", "drive"),
    "fit": _of("fit_command", "fit"),
    "flip": flip,
    "goto": goto,
    "guide": guide,
    "header": header,
    "home": go,
    "init": init,
    "instrument": instrument,
    "jog": jog,
    "model": _of("fit_command", "model"),
    "offset": offset,
    "park": go,
    "passes": passes,
    "plan": plan,
    "pointing-run": _of("pointing_run_command", "pointing_run"),
    "polar-align": _of("polar_align_command", "polar_align"),
    "rates": rates,
    "report": report,
    "run": run,
    "simulate": simulate,
    "status": status,
    "stop": simple,
    "sync": sync,
    "track": goto,
    "unpark": simple,
}
