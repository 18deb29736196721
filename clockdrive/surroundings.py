"""What the telescope cannot change and must know: how right the computer's clock is, and what air it looks through.

`follow` belongs into every control cycle: it gives the planner the sky with the present air and returns what a person
must be told. `notes` belong under every plan. Neither waits or raises.
"""

from pathlib import Path
from typing import TYPE_CHECKING

from clockdrive.air import Air, effect_arcsec, sky_with
from clockdrive.clock import VirtualClock
from clockdrive.clock_watch import ClockWatch
from clockdrive.host_clock import HostClock, HostClockCheck, host_clock
from clockdrive.polled import Start, at_once, on_a_thread
from pointing.instant import Instant
from pointing.planner import Planner
from pointing.site import Site

if TYPE_CHECKING:
    from clockdrive.weather import LiveWeather
    from transports.link import Clock

_VIRTUAL = HostClock(synchronised=True, error_s=0.0, source="virtual clock")


class Surroundings:
    """Clock and air of one telescope.

    Parameters
    ----------
    planner : Planner
        Its sky has the configured air and is exchanged for one with the measured air.
    clock : Clock
        The time; the computer's clock is judged only when it is that.
    source : str, optional
        `[site.weather] source`.
    folder : Path, optional
        What a relative path in it is relative to.

    Raises
    ------
    WeatherError
        It is no weather source.
    """

    def __init__(
        self, planner: Planner, clock: "Clock", source: str | None = None, folder: Path | None = None
    ) -> None:
        virtual = isinstance(clock, VirtualClock)
        start = at_once if virtual else on_a_thread
        self._planner = planner
        self._site = planner.sky.site
        self._check = HostClockCheck((lambda: _VIRTUAL) if virtual else host_clock, start)
        self._watch = ClockWatch(clock.now, clock.now if virtual else None)
        self._live = _live_weather(source, folder, self._site, start) if source else None
        self.air = Air(self._site.weather)
        self.stepped = ""
        """The sentence on the last step of the clock, until somebody aims anew."""

    def open(self, now: float) -> tuple[str, ...]:
        """Ask clock and weather for the first time, waiting at most some seconds; before anything moves."""
        self._check.at(now)
        if self._live is not None:
            self._live.open(now)
        return self.follow(now, "opening")

    def follow(self, now: float, doing: str) -> tuple[str, ...]:
        """Take up the present air, on the control thread; return sentences for the history, each once.

        Parameters
        ----------
        now : float
            POSIX seconds.
        doing : str
            What the telescope does: "the slew to M1".
        """
        told = []
        step = self._watch.look()
        if step is not None:
            self.stepped = step.during(doing)
            told.append(self.stepped)
        was, self.air = self.air, self._air(now)
        if self.air.trouble and not was.trouble:
            told.append(self.air.trouble)
        elif was.trouble and not self.air.trouble:
            told.append(f"the weather is measured again: {self.air.origin}")
        self._planner.sky = sky_with(self._planner.sky, self.air.weather)
        return tuple(told)

    def clock(self, now: float) -> HostClock:
        """What is known of the computer's clock."""
        return self._check.at(now)

    def effect_arcsec(self, altitude: float) -> float:
        """How much higher a target at an observed altitude, radians, is seen than in the configured air."""
        reading = self.air.reading
        return 0.0 if reading is None else effect_arcsec(self._site, reading, altitude)

    def notes(self, now: float, altitude: float) -> tuple[str, ...]:
        """Say under a plan how right clock and Earth orientation are, and what the measured air does up there."""
        notes = [self.clock(now).text]
        earth = self._planner.sky.at(Instant.from_posix(now)).earth_orientation
        if earth.note:
            notes.append(earth.note)
        if self.air.reading is not None:
            effect = self.effect_arcsec(altitude)
            notes.append(f"air {self.air.origin}: target {effect:+.1f}″ in altitude against the configured air")
        if self.air.trouble:
            notes.append(self.air.trouble)
        return tuple(notes)

    def _air(self, now: float) -> Air:
        return Air(self._site.weather) if self._live is None else self._live.at(now)


def _live_weather(source: str, folder: Path | None, site: Site, start: Start) -> "LiveWeather":
    from clockdrive.weather import LiveWeather, weather_source  # noqa: PLC0415 - only where it is measured

    return LiveWeather(weather_source(source, folder), site, start=start)
