r"""TPOINT's file of observations.

    { "!" or ";" comment }  caption  { ":" KEYWORD [args] }  run parameters  { observation }  [ "END" ]

Run parameters are the latitude as D M S, then year month day, temperature in °C, pressure in hPa, height in m,
relative humidity, wavelength in µm and lapse rate in K/m, of which any number may be left out from the end. An
altazimuth observation holds azimuth and elevation of the star as observed, then of the telescope, in degrees; an
equatorial one RA, Dec, telescope RA and Dec, and the sidereal time as h and m. A rotator angle and, behind `&`,
auxiliary readings may follow; a `\` at the end continues the line. Commented-out observations are left out.
"""

import math
import re
from dataclasses import dataclass, replace
from datetime import date
from pathlib import Path

import numpy as np

from pointing.errors import PointingError
from pointing.model.equatorial_places import YEARS, Circumstances, dated, observed_places
from pointing.model.place import MountKind
from pointing.model.records import Number, Record, sexagesimal, write_lines
from pointing.model.run import PointingRun
from pointing.model.tpoint_observation import read_observation
from pointing.model.tpoint_records import is_end, is_option, read_runs, without_comment
from pointing.model.words import PLACES, Places
from pointing.site import Weather

KEYWORDS = {  # how many numbers each takes, at most
    "EQUAT": 0, "ALTAZ": 0, "GIMBAL": 3, "NODA": 0, "ALLSKY": 0, "EQUINOX": 1,
    "ROTTEL": 0, "ROTL": 0, "ROTNL": 0, "ROTNR": 0, "ROTCL": 0, "ROTCR": 0,
}  # fmt: skip
_MOUNTS: dict[str, MountKind] = {"EQUAT": "equatorial", "ALTAZ": "altazimuth"}
_J2000 = 2000.0
_ARGUMENT = re.compile(r"[JB]?[+-]?(\d+\.?\d*|\.\d+)", re.ASCII)
_PARAMETERS = (3, 6, 7, 8, 9, 10, 11, 12)
_WANTED = "latitude D M S [Y M D [temperature_C pressure_hPa height_m humidity wavelength_um lapse_K_m]]"
_STANDARD = Weather()


def read_tpoint(path: str | Path, *, places: Places | None = None, weather: Weather | None = None) -> PointingRun:
    """Read the one run of a file.

    Parameters
    ----------
    path : path
        The file.
    places : str, optional
        Frame of an equatorial file's RA and Dec: `apparent`, `icrs` or `observed`; of no concern for altazimuth.
    weather : Weather, optional
        Instead of the run parameters'.

    Raises
    ------
    PointingError
        It cannot be read, holds several runs, or is equatorial without `places`; with line, column and text.
    """
    runs = read_runs(path)
    if len(runs) > 1:
        raise PointingError(
            f"{runs[1][0].file}, line {runs[1][0].line}: a second run begins here, of {len(runs)}: split the file"
            ", or read them as a list with read_tpoint_all"
        )
    return _read_run(path, runs[0], places, weather)


def read_tpoint_all(
    path: str | Path, *, places: Places | None = None, weather: Weather | None = None
) -> list[PointingRun]:
    """Read every run of a file; as `read_tpoint`.

    Raises
    ------
    PointingError
        As there.
    """
    return [_read_run(path, records, places, weather) for records in read_runs(path)]


@dataclass(frozen=True)
class _Parameters:
    """The run parameters, read."""

    latitude: float
    date: date | None
    weather: Weather | None
    height_m: float
    lapse_k_m: float


def _read_run(path: str | Path, records: list[Record], places: Places | None, weather: Weather | None) -> PointingRun:
    caption, rest = ("", records) if is_option(records[0]) else (records[0].text.strip(), records[1:])
    options = [record for record in rest if is_option(record)]
    body = [record for record in rest if not is_option(record)]
    if body and is_end(body[-1]):
        body = body[:-1]
    words = [option for record in options for option in _options(record)]
    mount = _mount(records[0], words)
    if not body:
        records[-1].refuse("the run ends before its run parameters: give the latitude as degrees, minutes, seconds")
    parameters = _parameters(body[0])
    air = weather or parameters.weather
    frame = _frame(records, body[1:], places, words)
    if frame == "icrs" and parameters.date is not None and not dated(parameters.date):
        year = body[0].numbers(_WANTED)[3]
        body[0].refuse(
            f"the year, to which ICRS places are brought: possible are {YEARS[0]} to {YEARS[1]}; write it with four "
            "digits", year.column, year.text,
        )  # fmt: skip
    run = _observations(mount, body[1:], frame, replace(parameters, weather=air))
    return replace(
        run, caption=caption, source=str(path), date=parameters.date, weather=air,
        height_m=parameters.height_m, lapse_k_m=parameters.lapse_k_m, options=tuple(words),
    )  # fmt: skip


def _options(record: Record) -> list[str]:
    """Keywords of an option record, each with its arguments."""
    found: list[list[str]] = []
    for word in record.text.strip().lstrip(":").split():
        name = word.upper()
        if name in KEYWORDS:
            found.append([name])
        elif found and len(found[-1]) <= KEYWORDS[found[-1][0]] and _ARGUMENT.fullmatch(name):
            found[-1].append(name)
        else:
            record.refuse(f"unknown option; known are {' '.join(KEYWORDS)}", record.text.index(word) + 1, word)
    return [" ".join(words) for words in found]


def _mount(first: Record, words: list[str]) -> MountKind:
    named = [word for word in words if word in _MOUNTS]
    gimbal = [word for word in words if word.startswith("GIMBAL")]
    if gimbal:
        raise PointingError(
            f"{first.file}, line {first.line}: {gimbal[0]}: the axes of a gimbal are neither equatorial nor "
            "altazimuth, which are fitted: turn the places into one of these"
        )
    if len(named) != 1:
        raise PointingError(
            f"{first.file}, line {first.line}: the run's options are {' '.join(words) or 'none'}: write one of "
            ":EQUAT and :ALTAZ behind the caption"
        )
    return _MOUNTS[named[0]]


def _parameters(record: Record) -> _Parameters:
    numbers = record.numbers(_WANTED)
    if len(numbers) not in _PARAMETERS:
        record.refuse(f"{len(numbers)} run parameters; possible are {', '.join(map(str, _PARAMETERS))}: {_WANTED}")
    latitude = math.radians(sexagesimal(record, numbers[:3], 90.0, "latitude"))
    values = [number.value for number in numbers]
    day = _date(record, numbers[3:6]) if len(numbers) >= 6 else None
    height_m = values[8] if len(values) > 8 else math.nan
    lapse = values[11] if len(values) > 11 else math.nan
    return _Parameters(latitude, day, _weather(record, values), height_m, lapse)


def _weather(record: Record, values: list[float]) -> Weather | None:
    """The air, when temperature and pressure are told; humidity and wavelength are the usual ones where not."""
    if len(values) < 8:
        return None
    humidity = values[9] if len(values) > 9 else _STANDARD.relative_humidity
    wavelength = values[10] if len(values) > 10 else _STANDARD.wavelength_um
    try:
        return Weather(
            pressure_hpa=values[7], temperature_c=values[6], relative_humidity=humidity, wavelength_um=wavelength
        )
    except PointingError as error:
        record.refuse(str(error))


def _date(record: Record, numbers: list[Number]) -> date:
    year, month, day = (number.value for number in numbers)
    try:
        return date(int(year), int(month), int(day))
    except (ValueError, OverflowError):
        record.refuse("no date; give year, month, day", numbers[0].column)


def _observations(
    mount: MountKind, records: list[Record], frame: Places | None, parameters: _Parameters
) -> PointingRun:
    rows = [read_observation(mount, record) for record in records]
    angles = np.array([row.angles for row in rows], float).reshape(-1, 5 if mount == "equatorial" else 4).T
    latitude, sidereal = parameters.latitude, np.full(len(rows), math.nan)
    if frame is not None:
        ra, dec, axis1, axis2, sidereal = angles
        height = 0.0 if math.isnan(parameters.height_m) else parameters.height_m
        at = Circumstances(latitude, height, parameters.weather, parameters.date)
        star1, star2 = observed_places(frame, ra, dec, sidereal, at)
        # The telescope's right ascension is read off its hour axis, wherever the tube looks.
        axis1 = math.pi - (math.pi - (sidereal - axis1)) % math.tau
    else:
        star1, star2, axis1, axis2 = angles
    width = max((len(row.auxiliary) for row in rows), default=0)
    auxiliary = [row.auxiliary + (math.nan,) * (width - len(row.auxiliary)) for row in rows]
    return PointingRun(
        mount, latitude, star1, star2, axis1, axis2, sidereal_time=sidereal,
        rotator=np.array([row.rotator for row in rows]), auxiliary=np.array(auxiliary).reshape(len(rows), width),
        line=np.array([record.line for record in records], int),
        refraction_applied=frame in {None, "observed"} or parameters.weather is None or parameters.weather.refraction,
        places=frame or "",
    )  # fmt: skip


def _frame(records: list[Record], body: list[Record], places: Places | None, words: list[str]) -> Places | None:
    """In which frame right ascensions shall be read; None where there are none."""
    if "EQUAT" not in words:
        return None
    equinox = next((word.split()[1] for word in words if word.startswith("EQUINOX ")), "")
    if places == "icrs" and equinox and float(equinox.lstrip("JB")) != _J2000:
        raise PointingError(
            f"{records[0].file}: its EQUINOX is {equinox}, and places = 'icrs' are of J2000: turn the places into "
            "those of J2000 or of date first"
        )
    if places in PLACES:
        return places
    if places is None and not body:
        return "observed"  # no place is there to be read in a wrong frame
    raise PointingError(
        f"{records[0].file}: the frame of its RA and Dec is {'not told' if places is None else repr(places)}: give "
        "places='apparent' (of date), places='icrs' (J2000) or places='observed' (refracted). To find out: compare "
        "a named star with a catalogue, from whose J2000 place that of date is 20′ away by now; or read it as "
        "apparent: where the residuals show J2000, `diagnose` says so"
    )


def write_tpoint(run: PointingRun, path: str | Path) -> None:
    """Write a run; its angles are read back to 1e-10 rad.

    Equatorial places are written as they were observed, to be read with places='observed'. Masked observations are
    commented out.

    Raises
    ------
    PointingError
        Observations have weights, for which the format has no room.
    """
    if np.any(run.weight != 1.0):
        raise PointingError("the run has weights, for which TPOINT's format has no room: write ECSV")
    keyword = next(word for word, mount in _MOUNTS.items() if mount == run.mount)
    frame = ["! Right ascensions and declinations are observed places"] if run.mount == "equatorial" else []
    options = [keyword, *(option for option in run.options if option != keyword)]
    row = _written_equatorial if run.mount == "equatorial" else _written_altazimuth
    lines = [*frame, _written_caption(run.caption), *(f":{option}" for option in options), _written_parameters(run)]
    for i, kept in enumerate(run.kept):
        lines.append(("" if kept else "! ") + row(run, i) + _written_extras(run, i))
    write_lines(path, [*lines, "END"])


def _written_caption(caption: str) -> str:
    r"""The caption without what would be read as something else: a comment, an option's `:`, a continuing `\`."""
    return without_comment(" ".join(caption.split())).lstrip(": ").rstrip("\\ ") or "Pointing run"


def _written_parameters(run: PointingRun) -> str:
    """As many run parameters as are known without a gap."""
    text = _sexagesimal(math.degrees(run.latitude), 9, "+")
    if run.date is None:
        return text
    text += f"  {run.date.year} {run.date.month} {run.date.day}"
    air = run.weather
    if air is None or not air.refraction:
        return text
    known = (air.temperature_c, air.pressure_hpa, run.height_m, air.relative_humidity, air.wavelength_um)
    for value in (*known, run.lapse_k_m):
        if math.isnan(value):
            break
        text += f" {value!r}"
    return text


def _written_equatorial(run: PointingRun, i: int) -> str:
    lst = float(run.sidereal_time[i])
    hours = 0.0 if math.isnan(lst) else math.degrees(lst) / 15.0 % 24.0
    ra, axis1 = ((hours - math.degrees(angle) / 15.0) % 24.0 for angle in (run.star1[i], run.axis1[i]))
    whole, minutes = divmod(round(hours * 60.0, 9), 60.0)
    return (
        f"{_sexagesimal(ra, 8)} {_sexagesimal(math.degrees(run.star2[i]), 7, '+')}  {_sexagesimal(axis1, 8)} "
        f"{_sexagesimal(math.degrees(run.axis2[i]), 7, '+')}  {int(whole):02d} {minutes:012.9f}"
    )


def _written_altazimuth(run: PointingRun, i: int) -> str:
    angles = (run.star1[i], run.star2[i], run.axis1[i], run.axis2[i])
    return " ".join(f"{math.degrees(angle):.11f}" for angle in angles)


def _written_extras(run: PointingRun, i: int) -> str:
    rotator = "" if math.isnan(run.rotator[i]) else f" {math.degrees(run.rotator[i]):.11f}"
    known = [value for value in run.auxiliary[i].tolist() if not math.isnan(value)]
    return rotator + (" & " + " ".join(repr(value) for value in known) if known else "")


def _sexagesimal(value: float, digits: int, sign: str = "-") -> str:
    """Units, minutes and seconds; the sign of −0° survives."""
    ticks = round(abs(value) * 3600.0 * 10**digits)
    minutes, ticks = divmod(ticks, 60 * 10**digits)
    units, minutes = divmod(minutes, 60)
    before = "-" if math.copysign(1.0, value) < 0.0 else sign.replace("-", "")
    seconds = f"{ticks // 10**digits:02d}.{ticks % 10**digits:0{digits}d}"
    return f"{before}{units:02d} {minutes:02d} {seconds}"
