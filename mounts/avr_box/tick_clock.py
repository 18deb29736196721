"""When the box's TIMER1 ticks, found out from the PEC bin, which changes on the tick.

Each answer to `P` bounds the moment of the last tick: not after the answer, not a tick before the question. Bounds
are carried on from tick to tick, a little wider each time as long as the crystal is not known, and intersected. Over
minutes they tell the crystal as well. An index pulse of the worm moves the bin and not the tick: a jump of the bin
tells nothing of the tick. Once one was seen, the next comes a turn of the worm later, unless the axis is moved: what
looks like one sooner is a clock that was set.
"""

import math

from mounts.avr_box.commands import BINS
from mounts.avr_box.timers import TICK_S

CRYSTAL_UNCERTAINTY = 1e-4
"""Of a crystal that nobody has measured, relative."""
_SURER = 0.5  # times as sure as before, for the crystal to be taken anew
NEAR_TICKS = 2.0
_PULSE_S = 30.0  # for which nothing need be heard, that a bin which a pulse moved is believed
_TURN = 0.96 * BINS, 1.04 * BINS  # ticks that a turn of the worm takes, however it is guided
_LEAST = 2e-6  # to which a crystal is believed; it changes with the temperature


class TickClock:
    """The ticks of one box.

    Parameters
    ----------
    crystal : float
        True frequency of its crystal over the nominal one.
    uncertainty : float
        Of that, relative.
    """

    def __init__(self, crystal: float = 1.0, uncertainty: float = CRYSTAL_UNCERTAINTY) -> None:
        self.crystal = crystal
        self.crystal_uncertainty = uncertainty
        self.moved_at = -math.inf
        """When the bin was last another one than the ticks lead to, POSIX seconds: an index pulse, or switched on."""
        self.stepped = False
        """Whether no tick and no index pulse explains the bin: a clock was set, or the box began anew."""
        self.slipped_s = 0.0
        """Seconds by which ticks came otherwise than they should, by less than a tick, all told."""
        self._pulse = -math.inf  # POSIX seconds, of the last one where tracking alone has turned the worm since then
        self._heard = -math.inf  # POSIX seconds, when an answer was taken in last
        self._bin: int | None = None  # after the tick below
        self._low = self._high = -math.inf  # bounds of a tick, POSIX seconds
        self._first: tuple[float, float, int] | None = None  # bounds of an early tick, and how many there were since

    @property
    def tick_s(self) -> float:
        """How long a tick lasts by the host's clock."""
        return TICK_S / self.crystal

    @property
    def uncertainty_s(self) -> float:
        """By how much the moment of a tick may be off; infinite before the first answer."""
        return (self._high - self._low) / 2.0 if self._bin is not None else math.inf

    def last_tick(self, time: float) -> float:
        """The moment of the last tick before a time, as well as it is known."""
        middle = (self._low + self._high) / 2.0
        return middle + math.floor((time - middle) / self.tick_s) * self.tick_s

    def since_tick(self, time: float) -> float:
        """Seconds since the last tick."""
        return time - self.last_tick(time)

    def is_elsewhere(self, number: int, time: float) -> bool:
        """Whether a bin that was told is another one than the ticks lead to."""
        if self._bin is None:
            return False
        expected = self._bin + (time - (self._low + self._high) / 2.0) / self.tick_s
        return abs((number - expected + 0.5 + BINS / 2.0) % BINS - BINS / 2.0) > NEAR_TICKS

    def unexplained(self, number: int, zero: int, earliest: float, latest: float) -> float:
        """By how many ticks a bin is elsewhere than time and an index pulse since the last answer lead to."""
        middle = (earliest + latest) / 2.0
        if self._bin is None or self._passed(number, middle) is not None:
            return 0.0
        if self._pulsed(number, zero, latest):
            return 0.0
        expected = self._bin + (middle - (self._low + self._high) / 2.0) / self.tick_s
        return abs((number - expected + 0.5 + BINS / 2.0) % BINS - BINS / 2.0)

    def _pulsed(self, number: int, zero: int, latest: float) -> bool:
        """Whether an index pulse since the last answer may have made the bin what it is."""
        if latest - self._pulse < _TURN[0] * self.tick_s:
            return False
        return (number - zero) % BINS <= min(latest - self._heard, _PULSE_S) / self.tick_s + NEAR_TICKS

    def worm_turned(self) -> None:
        """The axis was moved: the next index pulse may come whenever it will."""
        self._pulse = -math.inf

    def forget(self) -> None:
        """The bin was set, or the box began anew: the next answer is the first."""
        self._bin, self._first, self.stepped = None, None, False
        self.worm_turned()

    def heard(self, number: int, earliest: float, latest: float, zero: int = 0) -> None:
        """Take in that the bin was this at some moment between two times; an index pulse makes it `zero`."""
        pulsed, self._heard = self._pulsed(number, zero, latest), latest
        last = latest - (number - zero) % BINS * self.tick_s
        if math.isfinite(self._pulse) and latest - self._pulse > _TURN[1] * self.tick_s:  # it came where the bin led
            self._pulse = last
        bounds = latest - self.tick_s - (latest - earliest), latest
        if self._bin is None or self._first is None:
            self._bin, (self._low, self._high) = number, bounds
            self._first = (*bounds, 0)
            return
        ticks = self._passed(number, (earliest + latest) / 2.0)
        if ticks is not None and pulsed and not self._meets(ticks, *bounds):
            ticks = None
        self._carry(ticks or 0)
        if ticks is None:  # the index pulse moved the bin
            self.moved_at, self._pulse = latest, last if pulsed else -math.inf
            self._carry(math.floor((earliest - self._high) / self.tick_s))
            self._bin = number
            if self._low + self.tick_s <= latest:  # it may have been told before the next tick, or after it
                self._bin = self._first = None
            return
        self._bin = number
        low, high = max(self._low, bounds[0]), min(self._high, bounds[1])
        if low > high:  # a delay that was not seen: begin anew
            self.slipped_s += low - high
            low, high = bounds
            self._first = (*bounds, 0)
        self._low, self._high = low, high
        self._measure()

    def _passed(self, number: int, time: float) -> int | None:
        """Ticks since the last answer, by the bin; None where bin and time do not agree."""
        assert self._bin is not None  # noqa: S101 - there was an answer
        expected = (time - (self._low + self._high) / 2.0) / self.tick_s
        ticks = (number - self._bin) % BINS
        ticks += BINS * round((expected - 0.5 - ticks) / BINS)
        wide = 1.0 + self.uncertainty_s / self.tick_s
        return ticks if -wide < expected - 0.5 - ticks < wide and ticks >= 0 else None

    def _meets(self, ticks: int, low: float, high: float) -> bool:
        """Whether so many ticks later is within bounds."""
        wider = ticks * self.tick_s * self.crystal_uncertainty
        return self._low + ticks * self.tick_s - wider <= high and low <= self._high + ticks * self.tick_s + wider

    def _carry(self, ticks: int) -> None:
        """Speak of a later tick from now on."""
        wider = ticks * self.tick_s * self.crystal_uncertainty
        self._low += ticks * self.tick_s - wider
        self._high += ticks * self.tick_s + wider
        if self._first is not None:
            self._first = (*self._first[:2], self._first[2] + ticks)

    def _measure(self) -> None:
        """Tell the crystal from the ticks since the first, where that tells it better."""
        assert self._first is not None  # noqa: S101 - there was an answer
        low, high, ticks = self._first
        if ticks < 1:
            self._first = (self._low, self._high, 0)
            return
        span = (self._low + self._high - low - high) / 2.0
        doubt = (self._high - self._low + high - low) / 2.0 / span
        if doubt < _SURER * self.crystal_uncertainty:
            measured = ticks * TICK_S / span
            agrees = abs(measured - self.crystal) <= doubt  # then what is believed is kept, which wavers less
            self.crystal = self.crystal if agrees else measured
            self.crystal_uncertainty = min(
                self.crystal_uncertainty, max(doubt + abs(measured - self.crystal), _LEAST)
            )
        if high - low > 2.0 * (self._high - self._low) and span < 60.0 * self.tick_s:
            self._first = (self._low, self._high, 0)  # a beginning that is better known
