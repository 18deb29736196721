"""The grammar of the command line: a table of the commands, in the order in which help shows them."""

import argparse
import re
from collections.abc import Callable, Iterable, Sequence
from importlib import import_module
from typing import Any, NamedTuple, cast

from clockdrive.axis_names import WORDS as AXIS_WORDS
from clockdrive.configuration_keys import DRIVE_KINDS, MOUNT_TYPES, ROTATOR_MODES

Words = Callable[[argparse.ArgumentParser], None]
_NEGATIVE = re.compile(r"-(?:\d+\.?\d*|\.\d+)")  # a number, which is no option
_TARGET = (
    "05:34:31.9 +22:00:52 (ICRS), 83.633,22.0145 (degrees), a name (M1, NGC 7000, Vega, Moon, Jupiter), best, "
    "altaz:AZ,ALT or hadec:H,D (degrees, observed), tle:FILE#NAME (a satellite of a TLE file), mpc:FILE#NAME "
    "(orbital elements), ephem:FILE (ECSV table)"
)


def shielded(words: Iterable[str]) -> list[str]:
    """Command-line words in which `-22:00:52` can no longer be taken for an option."""
    return [f"−{word[1:]}" if re.match(r"-[\d.]", word) and not _NEGATIVE.fullmatch(word) else word for word in words]


def parser() -> argparse.ArgumentParser:
    """Everything the command line understands."""
    root = argparse.ArgumentParser(prog="clockdrive", description="Point a telescope.", allow_abbrev=False)
    root.add_argument("-c", "--config", metavar="FILE", help="configuration file; without it, the embedded simulator")
    root.add_argument("--version", action=_Version, nargs=0, help="show program's version number and exit")
    make = cast("type[argparse.ArgumentParser]", _GivenCommand)
    commands = root.add_subparsers(dest="command", metavar="COMMAND", required=True, parser_class=make)
    for row in _COMMANDS:
        commands.add_parser(row.name, help=row.text, description=row.text, allow_abbrev=False, words=row.words)
    return root


class _GivenCommand:
    """The grammar of one command, made when that is the one given: all thirty take 15 ms."""

    def __init__(self, *, words: Words, **settings: Any) -> None:  # noqa: ANN401 - as argparse has them
        self._words = words
        self._settings = settings

    def parse_known_args(
        self, args: Sequence[str], namespace: argparse.Namespace | None
    ) -> tuple[argparse.Namespace, list[str]]:
        """Parse the words after the command, as argparse asks for."""
        command = argparse.ArgumentParser(**self._settings)
        command.add_argument("--json", action="store_true", help="print one JSON document on stdout")
        self._words(command)
        return command.parse_known_args(args, namespace)


class _Version(argparse.Action):
    """Prints the version."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        from importlib import metadata  # noqa: PLC0415 - 10 ms: only who asks for it pays

        print(f"{parser.prog} {metadata.version('clockdrive')}")
        parser.exit()


def _of(module: str) -> Words:
    """The words of a command that has a module to itself, loaded when they are wanted."""

    def add(command: argparse.ArgumentParser) -> None:
        import_module(f"clockdrive.cli.{module}").words(command)

    return add


def _none(_command: argparse.ArgumentParser) -> None:
    """Nothing is to be said besides."""


def _target(command: argparse.ArgumentParser) -> None:
    command.add_argument("target", nargs="+", metavar="TARGET", help=_TARGET)


def _rate(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "--rate", metavar="EAST,NORTH", help="rates of one's own on top of the target's motion, arcseconds a second"
    )
    command.add_argument(
        "--rate-from", metavar="UTC", help="when they have displaced nothing yet (default the start)"
    )


def _rotator(command: argparse.ArgumentParser) -> None:
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


def _plan(plan: argparse.ArgumentParser) -> None:
    _target(plan)
    plan.add_argument("--at", metavar="UTC", help="when the slew would start (default now)")
    plan.add_argument("--from", dest="start", metavar="C1,C2", help="start counts; no drive is contacted")
    plan.add_argument("--instrument", metavar="NAME", help="with --from: on which pointing origin (default main)")
    _rate(plan)
    _rotator(plan)


def _rates(rates: argparse.ArgumentParser) -> None:
    _target(rates)
    rates.add_argument("--at", metavar="UTC", help="for which moment (default now)")
    rates.add_argument("--instrument", metavar="NAME", help="on which pointing origin (default main)")
    _rate(rates)
    _rotator(rates)


def _passes(passes: argparse.ArgumentParser) -> None:
    _target(passes)
    passes.add_argument("--hours", type=float, default=24.0, help="for how long to search (default 24)")
    passes.add_argument("--at", metavar="UTC", help="from when on (default now)")
    passes.add_argument("--above", type=float, metavar="DEG", help="an altitude to exceed besides the limits")


def _goto(goto: argparse.ArgumentParser) -> None:
    _target(goto)
    ending = goto.add_mutually_exclusive_group()
    ending.add_argument("--for", dest="duration", metavar="TIME", help="track for 30s, 5m, 1h, then stop")
    ending.add_argument(
        "--exit",
        action="store_true",
        help="return after arrival; the drive goes on tracking, where it can by itself: satellites are refused. "
        "--json without --for does the same",
    )
    _rate(goto)
    _rotator(goto)


def _track(track: argparse.ArgumentParser) -> None:
    _target(track)
    track.add_argument("--for", dest="duration", metavar="TIME", help="30s, 5m, 1h; until Ctrl-C without it")
    _rate(track)
    _rotator(track)


def _jog(jog: argparse.ArgumentParser) -> None:
    jog.add_argument("axis", metavar="AXIS", help=AXIS_WORDS)
    jog.add_argument("deg_s", type=float, metavar="DEG_S", help="degrees a second")
    jog.add_argument("--for", dest="duration", metavar="TIME", required=True, help="for how long")


def _sync(sync: argparse.ArgumentParser) -> None:
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


def _offset(offset: argparse.ArgumentParser) -> None:
    offset.add_argument("words", nargs="*", metavar="EAST NORTH | clear NAME")


def _centre(centre: argparse.ArgumentParser) -> None:
    centre.add_argument("target", nargs="+", metavar="RA DEC", help="ICRS, degrees or 05:34:31.9 +22:00:52")
    centre.add_argument("--at", metavar="UTC", help="the middle of the exposure (default now)")
    centre.add_argument("--force", action="store_true", help="accept a pointing error beyond 5°")


def _guide(guide: argparse.ArgumentParser) -> None:
    guide.add_argument("direction", metavar="N|S|E|W", help="north, south, east or west")
    guide.add_argument("milliseconds", type=float, metavar="MS", help="1 to 10000")


def _instrument(instrument: argparse.ArgumentParser) -> None:
    instrument.add_argument("name", nargs="?", metavar="NAME", help="of a table [instruments.NAME]")


def _model(model: argparse.ArgumentParser) -> None:
    model.add_argument("action", choices=("show", "check", "compare"))
    model.add_argument("files", nargs="+", metavar="FILE", help="in TPOINT's form")


def _status(status: argparse.ArgumentParser) -> None:
    status.add_argument("--watch", action="store_true", help="every second until Ctrl-C")


def _simulate(simulate: argparse.ArgumentParser) -> None:
    simulate.add_argument("kind", choices=DRIVE_KINDS)
    simulate.add_argument(
        "--listen",
        default="tcp://127.0.0.1:10001",
        metavar="URL",
        help="tcp://HOST:PORT or pty:PATH; a drive of several lines takes the ports that follow, or PATH-2 and so on",
    )


def _config(config: argparse.ArgumentParser) -> None:
    config.add_argument("action", choices=("check",))


def _init(init: argparse.ArgumentParser) -> None:
    init.add_argument("kind", nargs="?", choices=DRIVE_KINDS)
    init.add_argument("--from", dest="unit", metavar="LINK", help="read a TC410's own registers at this link")
    init.add_argument("--mount", choices=MOUNT_TYPES, help="for which mount type")


def _report(report: argparse.ArgumentParser) -> None:
    report.add_argument("--output", default="clockdrive-report.zip", metavar="FILE")


class _Row(NamedTuple):
    name: str
    text: str
    words: Words = _none


_COMMANDS = (
    _Row("plan", "show a slew to a target; nothing moves", _plan),
    _Row("rates", "tracking rates of both axes and the drive's registers", _rates),
    _Row("passes", "when a target, or each satellite of a TLE file, can be observed", _passes),
    _Row(
        "goto",
        "slew to a target, check the arrival, track until Ctrl-C; with --json or --exit return after arrival, and "
        "leave the drive tracking by itself",
        _goto,
    ),
    _Row("track", "slew to a target and track it for a time", _track),
    _Row("jog", "move one axis at a speed for a time", _jog),
    _Row("flip", "take up the tracked target in the other posture, by a safe way"),
    _Row("home", "go to the centre of both axes"),
    _Row("park", "go to the park position and stay there"),
    _Row("unpark", "allow motion again after park"),
    _Row("stop", "stop everything at once, tracking included"),
    _Row("sync", "declare that the telescope points at a target now; or where the rotator stands", _sync),
    _Row("offset", "displace the target: `offset EAST NORTH` in arcseconds, `offset clear NAME`, or show", _offset),
    _Row(
        "centre", "bring the target onto the pointing origin, by where an image says the telescope pointed", _centre
    ),
    _Row("guide", "displace the target by a pulse at guide_rate, on the sky", _guide),
    _Row("instrument", "show the pointing origins, or choose the one on which targets are put", _instrument),
    _Row("fit", "fit a pointing model to a file of observations (TPOINT, SPK or ECSV)", _of("fit_command")),
    _Row("model", "show, check or compare pointing-model files", _model),
    _Row(
        "pointing-run",
        "look at stars all over the sky, fit a pointing model, and keep every observation",
        _of("pointing_run_command"),
    ),
    _Row(
        "polar-align",
        "look at three stars, say what to turn to put axis 1 right, and look again",
        _of("polar_align_command"),
    ),
    _Row("status", "everything that is known now", _status),
    _Row("run", "own the telescope in the foreground, for a service manager; other commands attach"),
    _Row("drive", "the drive's own registers, power and speed", _of("drive_command")),
    _Row(
        "commission",
        "find signs, gears, speeds, landing and the drive's own ways by guided small moves",
        _of("commission_command"),
    ),
    _Row("simulate", "host a drive simulator", _simulate),
    _Row("config", "check a configuration", _config),
    _Row("init", "write a commented configuration to stdout", _init),
    _Row("header", "FITS cards for an image taken now"),
    _Row("report", "one zip file with what is needed to help", _report),
)
