"""The air over the telescope now, where there is a source that measures it.

A measurement is taken when it is recent and possible at the site's height; otherwise the last good one goes on,
before the first the configured air, and a sentence says why. Sources are asked on a thread of their own, so that
nobody waits.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from clockdrive.air import Air, WeatherReading, ago
from clockdrive.errors import WeatherError
from clockdrive.polled import Polled, Start, on_a_thread
from clockdrive.weather_sources import CommandSource, FileSource, Measured, WeatherSource
from pointing.site import Site, Weather

MAX_AGE_S = 900.0
EVERY_S = 30.0
_FIRST_S = 10.0
_LATE_S = 30.0  # every source gives up by itself before
_AHEAD_S = 60.0  # clocks of stations are not better
_PRESSURE_HPA = (10.0, 1100.0)
_TEMPERATURE_C = (-95.0, 58.0)  # the extremes ever measured on the ground
# Of the standard atmosphere: polar winters at 3000 m reach 0.89, the highest pressure ever measured 1.07.
_STANDARD = (0.88, 1.08)
_SHORT = {"pressure_hpa": "pressure", "temperature_c": "temperature", "relative_humidity": "humidity"}


@dataclass(frozen=True)
class _Outcome:
    """What asking led to: the last good reading, and why there is no newer one."""

    good: WeatherReading | None = None
    trouble: str = ""


class LiveWeather:
    """The weather of a source, kept up to date while nobody waits for it.

    Parameters
    ----------
    source : WeatherSource
        Is asked.
    site : Site
        Its height decides which pressure is possible; its weather stands in for what is not measured.
    every_s : float
        How often the source is asked.
    max_age_s : float
        An older measurement is stale.
    start : callable
        Begins the asking: `on_a_thread`, or `at_once` for a virtual clock.
    """

    def __init__(
        self,
        source: WeatherSource,
        site: Site,
        *,
        every_s: float = EVERY_S,
        max_age_s: float = MAX_AGE_S,
        start: Start = on_a_thread,
    ) -> None:
        self._source = source
        self._site = site
        self._max_age_s = max_age_s
        self._last = _Outcome()
        self._polled = Polled(self._ask, every_s, start)

    def open(self, now: float) -> Air:
        """Ask and wait for the first answer, at most 10 s; for when nothing moves yet. Raises nothing."""
        self._polled.fresh(now, _FIRST_S)
        return self.at(now)

    def at(self, now: float) -> Air:
        """The air at a moment, at once; to be called in every cycle. Raises nothing."""
        outcome = self._polled.at(now) or _Outcome()
        good = outcome.good
        age = None if good is None else good.age_s(now)
        troubles = list(self._troubles(outcome, age, now))
        if troubles:
            troubles.append(
                "the configured air is used" if age is None else f"the air of {ago(age)} ago goes on being used"
            )
        return Air(self._site.weather if good is None else good.weather, good, age, "; ".join(troubles))

    def _troubles(self, outcome: _Outcome, age: float | None, now: float) -> Iterator[str]:
        if outcome.trouble:
            yield outcome.trouble
        waiting = self._polled.waiting_s(now)
        if waiting > _LATE_S:
            yield f"{self._source.name} has not answered for {ago(waiting)} (bound {ago(_LATE_S)}); check it"
        if age is not None and age > self._max_age_s and not outcome.trouble:
            yield f"the last measurement is {ago(age)} old (bound {ago(self._max_age_s)}); check the station"

    def _ask(self, now: float) -> _Outcome:
        try:
            self._last = _Outcome(reading_of(self._source, self._site, now, self._max_age_s))
        except WeatherError as error:
            self._last = replace(self._last, trouble=str(error))
        except Exception as error:  # noqa: BLE001 - whatever a source does, the telescope goes on
            text = f"{self._source.name} failed ({error!r}); `clockdrive report` helps to find it"
            self._last = replace(self._last, trouble=text)
        return self._last


def reading_of(source: WeatherSource, site: Site, now: float, max_age_s: float = MAX_AGE_S) -> WeatherReading:
    """Ask a source once and judge what it gives.

    Raises
    ------
    WeatherError
        It gives nothing, or what is stale or impossible; with value, bound and remedy.
    """
    found = source.measure(now)
    for trouble in _objections(found, site.height_m, now, max_age_s):
        raise WeatherError(f"{source.name}: {trouble}")
    given = {name: value for name in _SHORT if (value := getattr(found, name)) is not None}
    missing = " and ".join(short for name, short in _SHORT.items() if name not in given)
    origin = f"{source.name} ({missing} as configured)" if missing else source.name
    return WeatherReading(replace(site.weather, **given), found.time, origin)


def weather_source(text: str, folder: Path | None = None) -> WeatherSource:
    """Make the source that `[site.weather] source` names.

    Parameters
    ----------
    text : str
        `file:PATH`, `command:PROGRAM ARGUMENTS` or `alpaca:URL`.
    folder : Path, optional
        What a relative PATH is relative to: where the configuration file is.

    Raises
    ------
    WeatherError
        It is none of these.
    """
    kind, _, rest = text.partition(":")
    if kind == "file" and rest:
        return FileSource((folder or Path()) / Path(rest).expanduser())
    if kind == "command":
        return CommandSource(rest)
    if kind == "alpaca":
        from clockdrive.weather_alpaca import AlpacaSource  # noqa: PLC0415 - HTTP takes 20 ms; only its users pay

        return AlpacaSource(rest)
    raise WeatherError(
        f"{text!r} is no weather source; write file:PATH, command:PROGRAM or alpaca:http://ADDRESS:PORT"
    )


def _objections(found: Measured, height_m: float, now: float, max_age_s: float) -> Iterator[str]:
    age = now - found.time
    if not age <= max_age_s:
        yield f"measured {ago(age)} ago (bound {ago(max_age_s)}); check that the weather station runs"
    if age < -_AHEAD_S:
        yield f"measured {ago(-age)} in the future (bound {ago(_AHEAD_S)}); correct the wrong clock, or its zone"
    if found.pressure_hpa is not None:
        yield from _impossible_pressure(found.pressure_hpa, height_m)
    low, high = _TEMPERATURE_C
    if found.temperature_c is not None and not low <= found.temperature_c <= high:
        yield f"temperature {found.temperature_c:.6g} °C; possible are {low:g} to {high:g}: give degrees Celsius"
    if found.relative_humidity is not None and not 0.0 <= found.relative_humidity <= 1.0:
        yield f"relative humidity {found.relative_humidity:.6g}; possible are 0 to 1: give a fraction, not percent"


def _impossible_pressure(hpa: float, height_m: float) -> Iterator[str]:
    """Compare with the standard atmosphere: a pressure reduced to sea level stands out above 650 m."""
    standard = Weather.standard(height_m).pressure_hpa
    low = max(_PRESSURE_HPA[0], standard * _STANDARD[0])
    high = min(_PRESSURE_HPA[1], standard * _STANDARD[1])
    if not low <= hpa <= high:
        yield (
            f"pressure {hpa:.6g} hPa; at {height_m:.0f} m {low:.0f} to {high:.0f} are possible: give hPa at the "
            "station, not reduced to sea level, and check height_m"
        )
