"""`clockdrive pointing-run`: take, resume, look at, fit and keep pointing runs."""

import argparse
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from clockdrive.cli import display
from clockdrive.cli.backend import Backend, backend, configuration_of, running
from clockdrive.cli.fit_command import (
    add_file_options,
    add_fit_options,
    indices,
    refuse_unwritable,
    wanted_of,
    weather_of,
    write_results,
)
from clockdrive.cli.spoken import spoken
from clockdrive.cli.standard_input import WITNESSES, StandardInput, refuse_typed_elsewhere
from clockdrive.configuration import Configuration, load
from clockdrive.errors import InputError

if TYPE_CHECKING:
    from clockdrive.fitting import Wanted
    from clockdrive.pointing_runs import PointingRuns
    from clockdrive.run_report import RunReport

_TAKING = ("take", "resume", "append")


def words(command: argparse.ArgumentParser) -> None:
    """Add the grammar of `pointing-run`."""
    command.add_argument(
        "action",
        nargs="?",
        default="take",
        choices=(*_TAKING, *_KEPT),
        help="take a run (default), go on with one, add stars; or do with a kept one, by default the newest",
    )
    command.add_argument(
        "words",
        nargs="*",
        metavar="NAME | I,J | FILE",
        help="the run; for mask and unmask the observations as well, counted from 0; for import and export the file",
    )
    command.add_argument("--name", metavar="NAME", help="of the run to take, resume or append to")
    command.add_argument("--stars", type=int, default=50, metavar="N", help="how many (default 50)")
    command.add_argument("--witness", default="simulator", metavar="WHO", help=f"who sees the sky: {WITNESSES}")
    command.add_argument("--try", action="store_true", dest="only_try", help="the witness looks once; nothing moves")
    command.add_argument("--bright", action="store_true", help="go to bright stars, not to places of the sky")
    command.add_argument("--settle", type=float, default=1.0, metavar="S", help="seconds before a look (default 1)")
    command.add_argument("--count", type=int, default=1, metavar="N", help="how many of the worst to mask")
    command.add_argument("--apply", action="store_true", help="point with the fitted model from now on")
    command.add_argument("--reason", default="", help="why observations are masked")
    add_file_options(command)
    add_fit_options(command)


def pointing_run(args: argparse.Namespace) -> None:
    """Take a run, or do something with a kept one."""
    if args.only_try:
        _try(args)
    elif args.action in _TAKING:
        _take(args)
    elif args.action == "fit" and args.apply:
        _fit_and_apply(args)
    else:
        configuration = configuration_of(args.config)
        with _kept(configuration, running(configuration)) as runs:
            _KEPT[args.action](args, runs)


def _kept(configuration: Configuration, telescope: Backend | None) -> "PointingRuns":
    """The kept runs: with what is in force in a telescope that is open, which its files need not tell."""
    from clockdrive.pointing_runs import PointingRuns  # noqa: PLC0415 - the mathematics takes 0.2 s to load

    if telescope is None:
        return PointingRuns.open(configuration)
    return PointingRuns.beside(configuration, telescope.call("run_frame"))


def _take(args: argparse.Namespace) -> None:
    name = _one([*args.words, *([args.name] if args.name else [])], "a name")
    refuse_unwritable(args)
    wanted = _wanted(args)
    with backend(args.config, "pointing-run") as telescope:
        taken: list[str] = []
        refuse_typed_elsewhere(args.witness, telescope)
        try:
            answer = telescope.call(
                "pointing_run",
                _events(telescope, taken, quiet=args.json),
                stars=args.stars,
                witness=args.witness,
                run=name,
                resume=args.action == "resume",
                append=args.action == "append",
                bright=args.bright,
                settle_s=args.settle,
                fit=False,
            )
        except KeyboardInterrupt:
            print("clockdrive: what was seen is kept; `pointing-run resume` goes on with it", file=sys.stderr)
            if args.json:
                display.as_json({"ok": False, "reason": "interrupted", "run": taken[-1] if taken else None})
            raise
        _fitted(args, telescope, answer["run"]["name"], wanted)


def _try(args: argparse.Namespace) -> None:
    """Let the witness look once where the telescope rests."""
    with backend(args.config, "pointing-run", keep_tracking=True) as telescope:
        refuse_typed_elsewhere(args.witness, telescope)
        seen = telescope.call("try_witness", _events(telescope, [], quiet=True), witness=args.witness)
    _print(
        args,
        seen,
        lambda found: (
            f"seen at azimuth {found['azimuth_deg']:.3f}° altitude {found['altitude_deg']:.3f}°, "
            f"{found['off_arcsec']:.1f}″ from where the telescope believes to point; nothing has moved"
        ),
    )


def _fit_and_apply(args: argparse.Namespace) -> None:
    """Fit a kept run for what is in force in the telescope, and put it in force there."""
    name = _one(args.words, "a name")
    refuse_unwritable(args)
    wanted = _wanted(args)
    with backend(args.config, "pointing-run", keep_tracking=True) as telescope:
        _fitted(args, telescope, name, wanted)


def _fitted(args: argparse.Namespace, telescope: Backend, name: str | None, wanted: "Wanted") -> None:
    with _kept(load(args.config), telescope) as runs:
        report = runs.report(name, wanted)
    if args.apply:
        _apply(telescope, report)
    _show_fit(args, report)


def _events(telescope: Backend, taken: list[str], *, quiet: bool) -> Callable[[Mapping[str, Any]], object]:
    """Tell of each place, let the person answer what is asked, and note which run is `taken`."""
    typed = StandardInput()

    def show(event: Mapping[str, Any]) -> None:
        if typed.asked(telescope, event):
            return
        taken[:] = [event["run"]]
        if not quiet and event["state"] in {"observed", "skipped"}:
            where = event["star"] or f"azimuth {event['azimuth_deg']:5.1f}° altitude {event['altitude_deg']:4.1f}°"
            left = "" if event["minutes_left"] is None else f"; {event['minutes_left']:.0f} min left"
            said = f"{event['state']}, {event['detail']}{left}"
            print(
                f"{event['number']:3}/{event['of']} {where} {event['posture']}: {said}", file=sys.stderr, flush=True
            )

    return show


def _list(args: argparse.Namespace, runs: "PointingRuns") -> None:
    _one(args.words, None)
    from clockdrive.run_report import run_json  # noqa: PLC0415 - as in `pointing_run`

    found = {"ok": True, "runs": [run_json(runs[name]) for name in runs.names]}
    _print(args, found, lambda answer: "\n".join(map(_row, answer["runs"])) or "no pointing runs yet")


def _show(args: argparse.Namespace, runs: "PointingRuns") -> None:
    from clockdrive.run_report import run_json  # noqa: PLC0415 - as in `pointing_run`

    stored = runs.store.read(_one(args.words, "a name"))
    answer = {"ok": True, "run": run_json(stored)}
    _print(args, answer, lambda found: "\n".join((_row(found["run"]), *map(_skipped, found["run"]["skipped"]))))


def _fit(args: argparse.Namespace, runs: "PointingRuns") -> None:
    name = _one(args.words, "a name")
    refuse_unwritable(args)
    _show_fit(args, runs.report(name, _wanted(args)))


def _mask(args: argparse.Namespace, runs: "PointingRuns") -> None:
    name, which = _name_and_indices(args)
    runs.mask(name, which, args.reason)
    _done(args, runs, name)


def _unmask(args: argparse.Namespace, runs: "PointingRuns") -> None:
    name, which = _name_and_indices(args)
    runs.unmask(name, which)
    _done(args, runs, name)


def _worst(args: argparse.Namespace, runs: "PointingRuns") -> None:
    name = runs.store.read(_one(args.words, "a name")).name
    found = runs.mask_worst(name, args.count)
    print(f"clockdrive: masked {', '.join(map(str, found))} of {name}", file=sys.stderr)
    _done(args, runs, name)


def _import(args: argparse.Namespace, runs: "PointingRuns") -> None:
    if len(args.words) != 2:
        raise InputError("pointing-run import NAME FILE: give a name for the run, and the file")
    name, file = args.words
    runs.take_in(file, name, time.time(), places=args.places, weather=weather_of(args.weather))
    _done(args, runs, name)


def _export(args: argparse.Namespace, runs: "PointingRuns") -> None:
    if len(args.words) != 2:
        raise InputError("pointing-run export NAME FILE: give the run, and a file that ends in .ecsv or .dat")
    name, file = args.words
    runs.write(name, file)
    _print(args, {"ok": True, "written": file}, lambda found: f"written: {found['written']}")


def _rename(args: argparse.Namespace, runs: "PointingRuns") -> None:
    if len(args.words) != 2:
        raise InputError("pointing-run rename NAME OTHER: give the run, and its name from now on")
    name, to = args.words
    runs.rename(name, to)
    _done(args, runs, to)


def _forget(args: argparse.Namespace, runs: "PointingRuns") -> None:
    name = _one(args.words, "a name")
    if name is None:
        raise InputError("pointing-run forget NAME: say which run to delete")
    runs.store.forget(name)
    _print(args, {"ok": True}, lambda _found: f"{name} is deleted")


_KEPT: dict[str, Callable[[argparse.Namespace, "PointingRuns"], None]] = {
    "list": _list,
    "show": _show,
    "fit": _fit,
    "mask": _mask,
    "unmask": _unmask,
    "worst": _worst,
    "import": _import,
    "export": _export,
    "rename": _rename,
    "forget": _forget,
}


def _wanted(args: argparse.Namespace) -> "Wanted":
    """How to fit; where nobody says with which terms, the run decides.

    Raises
    ------
    InputError
        An option makes no sense, or is one of `import`.
    """
    if args.places or args.weather:
        raise InputError("--places and --weather tell how a file is read: give them to `pointing-run import`")
    wanted = wanted_of(args)
    return replace(wanted, by_run=replace(wanted, pole="true", mask=()) == type(wanted)())


def _show_fit(args: argparse.Namespace, report: "RunReport") -> None:
    if args.json:
        display.as_json({**report.json, "written": list(write_results(args, report.fit))})
        return
    print(spoken(report.text), flush=True)
    for name in write_results(args, report.fit):
        print(f"written: {name}", flush=True)
    if args.apply:
        print(
            "the telescope points with this model now; `clockdrive offset clear pointing model` ends that", flush=True
        )


def _apply(telescope: Backend, report: "RunReport") -> None:
    """Put the model of a fit in force."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "model.mod"
        report.fit.save(file)
        telescope.call("use_model", model=str(file))


def _done(args: argparse.Namespace, runs: "PointingRuns", name: str) -> None:
    args.words = [name]
    _show(args, runs)


def _row(run: Mapping[str, Any]) -> str:
    masked = f", {len(run['masked'])} masked" if run["masked"] else ""
    skipped = f", {len(run['skipped'])} skipped" if run["skipped"] else ""
    left = f", {run['planned']} to go: resume it" if run["planned"] else ""
    return f"{run['name']}: {run['mount']}, {run['observed']} observed{masked}{skipped}{left}"


def _skipped(place: Mapping[str, Any]) -> str:
    where = f"azimuth {place['azimuth_deg']:.1f}° altitude {place['altitude_deg']:.1f}° {place['posture']}"
    return f"  {place['number']:3} {where}: {place['reason']}"


def _one(words: list[str], what: str | None) -> str | None:
    if len(words) > (what is not None):
        raise InputError(f"{' '.join(words)}: give {what or 'nothing'} at most")
    return words[0] if words else None


def _name_and_indices(args: argparse.Namespace) -> tuple[str, tuple[int, ...]]:
    if len(args.words) < 2:
        raise InputError(f"pointing-run {args.action} NAME I,J: give the run, and observations counted from 0")
    return args.words[0], indices(" ".join(args.words[1:]))


def _print(args: argparse.Namespace, answer: dict[str, Any], text: Callable[[dict[str, Any]], str]) -> None:
    if args.json:
        display.as_json(answer)
    else:
        print(text(answer), flush=True)
