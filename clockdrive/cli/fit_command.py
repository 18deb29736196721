"""`clockdrive fit` and `clockdrive model`: pointing models from runs of observations, and their files."""

import argparse
import math
import os
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from clockdrive.cli import display
from clockdrive.cli.spoken import spoken
from clockdrive.errors import ClockdriveError, InputError
from pointing.errors import PointingError
from pointing.model.words import PLACES, POLES

if TYPE_CHECKING:
    from clockdrive.fitting import Fitted, Wanted
    from pointing.model.fitted import Fit
    from pointing.site import Weather


def words(command: argparse.ArgumentParser) -> None:
    """Add the grammar of `fit`."""
    command.add_argument("file", metavar="FILE", help="the run of observations")
    add_file_options(command)
    add_fit_options(command)


def add_file_options(fit: argparse.ArgumentParser) -> None:
    """Add how a file of observations is read."""
    fit.add_argument("--places", choices=PLACES, help="frame of an equatorial TPOINT file's right ascensions")
    fit.add_argument(
        "--weather",
        metavar="HPA,C[,HUMIDITY]",
        help="of apparent and ICRS places, instead of the file's; none: no air",
    )


def add_fit_options(fit: argparse.ArgumentParser) -> None:
    """Add how observations are fitted, and what is written of it."""
    which = fit.add_mutually_exclusive_group()
    which.add_argument("--terms", metavar="NAMES", help='as in "IH ID CH"; without it the usual ones of the mount')
    which.add_argument("--auto", action="store_true", help="choose the terms that the run asks for")
    fit.add_argument("--fixed", metavar="NAME=ARCSEC", help='terms that keep a coefficient, as in "CH=0 TF=12.5"')
    fit.add_argument("--robust", action="store_true", help="weigh down what lies far off")
    fit.add_argument("--outliers", action="store_true", help="find and mask observations that do not belong")
    fit.add_argument("--by-pier", action="store_true", help="let the index errors differ beyond the pole")
    fit.add_argument("--mask", metavar="I,J", help="observations to leave out, counted from 0")
    fit.add_argument("--pole", choices=POLES, default="true", help="to which the polar axis shall be turned")
    fit.add_argument("-o", "--output", metavar="FILE", help="write the model in TPOINT's form")
    fit.add_argument("--residuals", metavar="FILE", help="write the residuals as an ECSV table")
    fit.add_argument("--plot", metavar="FILE", help="draw the residuals into a .png, .pdf or .svg; needs matplotlib")


def wanted_of(args: argparse.Namespace) -> "Wanted":
    """How a person wants a run fitted.

    Raises
    ------
    InputError
        An option makes no sense.
    """
    from clockdrive.fitting import Wanted  # noqa: PLC0415 - the mathematics takes 0.2 s to load

    if args.auto and args.fixed:
        raise InputError("--fixed goes with --terms: with --auto the terms are not known beforehand")
    if args.terms is not None:
        _refuse_unknown(args.terms)
    return Wanted(
        args.terms or "", args.auto, _fixed(args.fixed), args.places, weather_of(args.weather), args.robust,
        args.outliers, args.by_pier, indices(args.mask), args.pole,
    )  # fmt: skip


def fit(args: argparse.Namespace) -> None:
    """Fit, show the result, and write what is asked for; what could not be written is refused before."""
    wanted = wanted_of(args)
    refuse_unwritable(args)
    found = _fitted(args.file, wanted)
    if args.json:
        display.as_json({**found.json, "written": list(write_results(args, found.fit))})
        return
    steps = [] if found.choice is None else [f"{step.action} {step.term}: {step.why}" for step in found.choice.path]
    findings = [f"beware: {each}" for each in found.findings]
    lines = [*steps, repr(found.fit), *findings, found.advice]
    print("\n".join(line for line in lines if line), flush=True)
    for name in write_results(args, found.fit):
        print(f"written: {name}", flush=True)


def _fitted(path: str, wanted: "Wanted") -> "Fitted":
    """The fit, with what is said of it in the words of the command line."""
    from clockdrive.fitting import fit_file  # noqa: PLC0415 - as in `fit`

    try:
        found = fit_file(path, wanted)
    except PointingError as error:
        raise PointingError(spoken(str(error))) from error
    return replace(found, findings=tuple(map(spoken, found.findings)))


def _refuse_unknown(names: str) -> None:
    """Refuse words that are terms of no mount; what this mount does not have the fit refuses."""
    from pointing.model.place import KINDS  # noqa: PLC0415 - as in `fit`
    from pointing.model.terms import term  # noqa: PLC0415

    listed = names.replace(",", " ").split()
    if not listed:
        raise InputError(f'--terms {names!r} names none: give some, as in "IH ID CH"')
    for name in listed:
        refusals = []
        for kind in KINDS:
            try:
                term(name, kind)
            except PointingError as error:
                refusals.append(str(error))
        if len(refusals) == len(KINDS):
            raise InputError(f"--terms: {refusals[0]}")


def _refuse_overwriting(args: argparse.Namespace) -> None:
    """Refuse to write over the observations, or two things into one file."""
    file = getattr(args, "file", None)
    taken = {} if file is None else {Path(file).resolve(): "the observations"}
    for option, name in (("--plot", args.plot), ("--residuals", args.residuals), ("--output", args.output)):
        if not name:
            continue
        if what := taken.get(file := Path(name).resolve()):
            raise ClockdriveError(f"{option} {name} would write over {what}: name another file")
        taken[file] = f"what {option} writes"


def refuse_unwritable(args: argparse.Namespace) -> None:
    """Refuse files that could not be written, before a long fit and before another one is replaced."""
    _refuse_overwriting(args)
    for option, name in (("--plot", args.plot), ("--residuals", args.residuals), ("--output", args.output)):
        if not name:
            continue
        file = Path(name)
        if file.is_dir() or not file.parent.is_dir():
            what = "is a folder: name a file in it" if file.is_dir() else f"there is no folder {str(file.parent)!r}"
            raise ClockdriveError(f"{option} {name} cannot be written: {what}")
        if not os.access(file if file.exists() else file.parent, os.W_OK):
            raise ClockdriveError(f"{option} {name} cannot be written: you may not; name a file in a folder of yours")
    if args.plot:
        from pointing.model.plots import refuse_undrawable  # noqa: PLC0415 - takes matplotlib along

        refuse_undrawable(args.plot)


def write_results(args: argparse.Namespace, found: "Fit") -> Iterator[str]:
    """Write the files that were asked for, one by one with its name; the model last, as it may replace one in use."""
    if args.plot:
        from pointing.model.plots import save_panels  # noqa: PLC0415 - takes matplotlib along

        save_panels(found, args.plot)
        yield args.plot
    if args.residuals:
        found.write_residuals(args.residuals)
        yield args.residuals
    if args.output:
        found.save(args.output)
        yield args.output


def _fixed(text: str | None) -> dict[str, float]:
    """Coefficients in arcseconds by name, of `CH=0 TF=12.5`."""
    found = {}
    for word in (text or "").replace(",", " ").split():
        name, equals, value = word.partition("=")
        number = math.nan
        try:
            number = float(value.replace("−", "-"))
        except ValueError:
            equals = ""
        if name.upper() in found:
            raise InputError(f"--fixed {text}: {name.upper()} stands twice; give each term once")
        if not (name and equals):
            raise InputError(f'--fixed {word}: give NAME=ARCSEC, as in "CH=0 TF=12.5"')
        found[name.upper()] = number
    return found


def weather_of(text: str | None) -> "Weather | None":
    """The air of `1010,12` or `1010,12,0.6`, or that of `none`, which does not refract."""
    from pointing.site import Weather  # noqa: PLC0415 - as in `fit`

    if text is None:
        return None
    if text == "none":
        return Weather(refraction=False)
    try:
        pressure, temperature, *humidity = (float(word.replace("−", "-")) for word in text.split(","))
        (relative,) = humidity or (Weather().relative_humidity,)
    except ValueError:
        raise InputError(
            f"--weather {text}: give pressure in hPa, temperature in °C, humidity, as in 1010,12,0.6, or none"
        ) from None
    try:
        return Weather(pressure_hpa=pressure, temperature_c=temperature, relative_humidity=relative)
    except PointingError as error:
        raise PointingError(f"--weather {text}: {error}") from None


def indices(text: str | None) -> tuple[int, ...]:
    """Observations of `3,7`, counted from 0."""
    words = (text or "").replace(",", " ").split()
    if not all(word.isdecimal() for word in words):
        raise InputError(f"{text}: give observations counted from 0, as in 3,7")
    return tuple(int(word) for word in words)


def model(args: argparse.Namespace) -> None:
    """Show, check or compare model files."""
    from clockdrive import fitting  # noqa: PLC0415 - as in `fit`

    ask, text = {
        "show": (fitting.show_models, models_text),
        "check": (fitting.check_models, models_text),
        "compare": (fitting.compare_models, comparison_text),
    }[args.action]
    answer = ask(args.files)
    if args.json:
        display.as_json(answer)
    else:
        print(text(answer), flush=True)


def models_text(answer: Mapping[str, Any]) -> str:
    """Each model, a line a term."""
    lines = []
    for each in answer["models"]:
        lines.append(
            f"{each['file']}: {each['caption']}; {each['mount']} mount, n = {each['n']}, "
            f"sky RMS {each['sky_rms_arcsec']:g}″"
        )
        for row in each["terms"]:
            sigma = "" if row["sigma_arcsec"] is None else f"± {row['sigma_arcsec']:.3f}″"
            marks = [mark for mark, so in (("fixed", row["fixed"]), (row["evidence"], True)) if so]
            marked = f"  ({', '.join(mark for mark in marks if mark != 'published')})".replace("  ()", "")
            lines.append(f"  {row['name']:<7} {row['arcsec']:+11.4f}″ {sigma:<10}  {row['sentence']}{marked}")
    return "\n".join(lines)


def comparison_text(answer: Mapping[str, Any]) -> str:
    """A row a term, a column a model, with how many σ each is from the first."""
    lines = ["  ".join((f"{'':<7}", *(f"{name:>20}" for name in answer["files"])))]
    for row in answer["terms"]:
        cells = [_cell(value, None) for value in row["arcsec"][:1]]
        cells += [_cell(*pair) for pair in zip(row["arcsec"][1:], row["sigmas_apart"], strict=True)]
        lines.append("  ".join((f"{row['name']:<7}", *(f"{cell:>20}" for cell in cells))))
    return "\n".join(lines)


def _cell(arcsec: float | None, sigmas: float | None) -> str:
    if arcsec is None:
        return "absent"
    return f"{arcsec:+.3f}″" + ("" if sigmas is None else f" ({sigmas:+.1f}σ)")
