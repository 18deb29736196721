"""The grammar of the command line."""

import argparse
from collections.abc import Callable
from importlib import metadata

from clockdrive.axis_names import WORDS as AXIS_WORDS
from clockdrive.cli.commission_command import add_commission
from clockdrive.cli.drive_command import add_drive
from clockdrive.cli.fit_command import add_fit
from clockdrive.cli.pointing_run_command import add_pointing_run
from clockdrive.cli.polar_align_command import add_polar_align
from clockdrive.configuration_keys import DRIVE_KINDS, ROTATOR_MODES

Adder = Callable[[str, str], argparse.ArgumentParser]
_TARGET = (
    "05:34:31.9 +22:00:52 (ICRS), 83.633,22.0145 (degrees), a name (M1, NGC 7000, Vega, Moon, Jupiter), best, "
    "altaz:AZ,ALT or hadec:H,D (degrees, observed), tle:FILE#NAME (a satellite of a TLE file), mpc:FILE#NAME "
    "(orbital elements), ephem:FILE (ECSV table)"
)


def parser() -> argparse.ArgumentParser:
    """Everything the command line understands."""
    root = argparse.ArgumentParser(prog="clockdrive", description="Point a telescope.", allow_abbrev=False)
    root.add_argument("-c", "--config", metavar="FILE", help="configuration file; without it, the embedded simulator")
    root.add_argument("--version", action="version", version=f"%(prog)s {metadata.version('clockdrive')}")
    commands = root.add_subparsers(dest="command", metavar="COMMAND", required=True)

    def add(name: str, text: str) -> argparse.ArgumentParser:
        command = commands.add_parser(name, help=text, description=text, allow_abbrev=False)
        command.add_argument("--json", action="store_true", help="print one JSON document on stdout")
        return command

    def add_with_target(name: str, text: str) -> argparse.ArgumentParser:
        command = add(name, text)
        command.add_argument("target", nargs="+", metavar="TARGET", help=_TARGET)
        return command

    _asking(add_with_target)
    _moving(add, add_with_target)
    _correcting(add)
    _guiding(add)
    add_fit(add)
    add_pointing_run(add)
    add_polar_align(add)
    _serving(add)
    _around(add)
    return root


def _add_rate(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "--rate", metavar="EAST,NORTH", help="rates of one's own on top of the target's motion, arcseconds a second"
    )
    command.add_argument(
        "--rate-from", metavar="UTC", help="when they have displaced nothing yet (default the start)"
    )


def _add_rotator(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "--position-angle",
        type=float,
        metavar="DEG",
        help="where the rotator holds the instrument's y axis: to the east of north, or of what --rotator says",
    )
    command.add_argument(
        "--rotator",
        choices=ROTATOR_MODES,
        help="what the rotator holds: the sky, the horizon, or its own angle on the mount (default as configured)",
    )


def _asking(add_with_target: Adder) -> None:
    plan = add_with_target("plan", "show a slew to a target; nothing moves")
    plan.add_argument("--at", metavar="UTC", help="when the slew would start (default now)")
    plan.add_argument("--from", dest="start", metavar="C1,C2", help="start counts; no drive is contacted")
    plan.add_argument("--instrument", metavar="NAME", help="with --from: on which pointing origin (default main)")
    rates = add_with_target("rates", "tracking rates of both axes and the drive's registers")
    rates.add_argument("--at", metavar="UTC", help="for which moment (default now)")
    rates.add_argument("--instrument", metavar="NAME", help="on which pointing origin (default main)")
    passes = add_with_target("passes", "when a target, or each satellite of a TLE file, can be observed")
    passes.add_argument("--hours", type=float, default=24.0, help="for how long to search (default 24)")
    passes.add_argument("--at", metavar="UTC", help="from when on (default now)")
    passes.add_argument("--above", type=float, metavar="DEG", help="an altitude to exceed besides the limits")
    for command in (plan, rates):
        _add_rate(command)
        _add_rotator(command)


def _moving(add: Adder, add_with_target: Adder) -> None:
    goto = add_with_target(
        "goto",
        "slew to a target, check the arrival, track until Ctrl-C; with --json or --exit return after arrival, and "
        "leave the drive tracking by itself",
    )
    ending = goto.add_mutually_exclusive_group()
    ending.add_argument("--for", dest="duration", metavar="TIME", help="track for 30s, 5m, 1h, then stop")
    ending.add_argument(
        "--exit",
        action="store_true",
        help="return after arrival; the drive goes on tracking, where it can by itself: satellites are refused. "
        "--json without --for does the same",
    )
    track = add_with_target("track", "slew to a target and track it for a time")
    track.add_argument("--for", dest="duration", metavar="TIME", help="30s, 5m, 1h; until Ctrl-C without it")
    for command in (goto, track):
        _add_rate(command)
        _add_rotator(command)
    jog = add("jog", "move one axis at a speed for a time")
    jog.add_argument("axis", metavar="AXIS", help=AXIS_WORDS)
    jog.add_argument("deg_s", type=float, metavar="DEG_S", help="degrees a second")
    jog.add_argument("--for", dest="duration", metavar="TIME", required=True, help="for how long")
    add("flip", "take up the tracked target in the other posture, by a safe way")
    add("home", "go to the centre of both axes")
    add("park", "go to the park position and stay there")
    add("unpark", "allow motion again after park")
    add("stop", "stop everything at once, tracking included")


def _correcting(add: Adder) -> None:
    sync = add("sync", "declare that the telescope points at a target now; or where the rotator stands")
    sync.add_argument("target", nargs="*", metavar="TARGET", help=_TARGET)
    sync.add_argument(
        "--rotator-angle", type=float, metavar="DEG", help="in place of a target: the rotator's own angle now"
    )
    sync.add_argument(
        "--position-angle",
        type=float,
        metavar="DEG",
        help="likewise: where the instrument's y axis lies on the sky now, as a solved image tells",
    )
    sync.add_argument("--posture", choices=("normal", "beyond"), help="when it cannot be known from the position")
    sync.add_argument("--force", action="store_true", help="accept a correction beyond 5°")
    offset = add("offset", "displace the target: `offset EAST NORTH` in arcseconds, `offset clear NAME`, or show")
    offset.add_argument("words", nargs="*", metavar="EAST NORTH | clear NAME")


def _guiding(add: Adder) -> None:
    centre = add("centre", "bring the target onto the pointing origin, by where an image says the telescope pointed")
    centre.add_argument("target", nargs="+", metavar="RA DEC", help="ICRS, degrees or 05:34:31.9 +22:00:52")
    centre.add_argument("--at", metavar="UTC", help="the middle of the exposure (default now)")
    centre.add_argument("--force", action="store_true", help="accept a pointing error beyond 5°")
    guide = add("guide", "displace the target by a pulse at guide_rate, on the sky")
    guide.add_argument("direction", metavar="N|S|E|W", help="north, south, east or west")
    guide.add_argument("milliseconds", type=float, metavar="MS", help="1 to 10000")
    instrument = add("instrument", "show the pointing origins, or choose the one on which targets are put")
    instrument.add_argument("name", nargs="?", metavar="NAME", help="of a table [instruments.NAME]")


def _serving(add: Adder) -> None:
    status = add("status", "everything that is known now")
    status.add_argument("--watch", action="store_true", help="every second until Ctrl-C")
    add("run", "own the telescope in the foreground, for a service manager; other commands attach")
    add_drive(add)
    add_commission(add)
    simulate = add("simulate", "host a drive simulator")
    simulate.add_argument("kind", choices=DRIVE_KINDS)
    simulate.add_argument(
        "--listen",
        default="tcp://127.0.0.1:10001",
        metavar="URL",
        help="tcp://HOST:PORT or pty:PATH; a drive of several lines takes the ports that follow, or PATH-2 and so on",
    )


def _around(add: Adder) -> None:
    config = add("config", "check a configuration")
    config.add_argument("action", choices=("check",))
    init = add("init", "write a commented configuration to stdout")
    init.add_argument("kind", nargs="?", choices=DRIVE_KINDS)
    init.add_argument("--from", dest="unit", metavar="LINK", help="read a TC410's own registers at this link")
    init.add_argument("--mount", choices=("equatorial-fork", "german", "altaz-fork"), help="for which mount type")
    add("header", "FITS cards for an image taken now")
    report = add("report", "one zip file with what is needed to help")
    report.add_argument("--output", default="clockdrive-report.zip", metavar="FILE")
