"""Axis controllers to which things happen, and a witness who knows at every moment where the axes truly are."""

import bisect
import random
from collections import Counter
from typing import TYPE_CHECKING

from apo_bench import ApoWitness
from fault_bench import OUTAGES, WIRE, Event, FaultyLine

from clockdrive import Telescope
from mounts.apo.status_word import StatusWord

if TYPE_CHECKING:
    from collections.abc import Callable

CONTROLLER = (
    *("restart", "restart that loses the position", "restart that loses the clock"),
    *("clock set forward", "clock set back", "late clock", "stop button", "motion error", "limit switch"),
)
SDSS = ("semaphore", "out of closed loop")
_STEP_S = 0.02  # between two looks at the truth; at 0.25°/s² a chord is then off by 0.05″
_SLACK_DEG = 2e-5
_RECENT_S = 16.0  # what the buffer holds, and what it may lack after an outage until it is full again


class ApoLine(FaultyLine):
    """A line between driver and controllers that goes wrong."""

    def __init__(self, line, seed: int) -> None:
        line.advance = lambda _: None  # its controllers are asked one by one
        super().__init__(line, seed)
        self.unsound: list[list[float]] = []  # begins and ends
        self.now: Callable[[], float] = lambda: 0.0

    def broken(self) -> None:
        self.unsound.append([self.now(), float("inf")])

    def be_whole(self) -> None:
        super().be_whole()
        if self.unsound:
            self.unsound[-1][1] = self.now()

    def was_unsound(self, begin: float, end: float) -> bool:
        return any(start < end and stop > begin for start, stop in self.unsound)


class FaultWitness(ApoWitness):
    """Watches; collects every broken promise."""

    def __init__(self, scope: Telescope, lines: list[ApoLine]) -> None:
        self.broken: list[str] = []
        self.worst = (0.0, 0.0)  # |reported − true| and the uncertainty stated, degrees
        self.readings = self.unsynchronised = 0
        self._events: list[Event] = []
        self._truth: list[tuple[list[float], list[float]]] = [([], []) for _ in scope.simulator.axes]
        super().__init__(scope)
        self.lines = lines
        session = scope._session
        self._take, session.taken = session.taken, self._taken
        for line in lines:
            line.before, line.now = self._happens, scope.clock.now

    def plan(self, events: list[Event]) -> None:
        self._events = sorted(events)

    @property
    def last_event(self) -> float:
        return self._events[-1].time if self._events else self.scope.clock.now()

    def fail(self, text: str) -> None:
        self.broken.append(f"{self.scope.clock.now() - self.t0:.1f} s: {text}")

    t0 = 0.0

    def _happens(self, t: float) -> None:
        while self._events and self._events[0].time <= t:
            event = self._events.pop(0)
            for axis in self.device.axes:
                axis.advance(max(event.time, self._known(axis)))
            event.action()
        for axis in self.device.axes:
            axis.advance(t)

    def now(self) -> tuple[float, float]:
        self._happens(self.scope.clock.now())
        return super().now()

    def _known(self, axis) -> float:
        times = self._truth[self.device.axes.index(axis)][0]
        return times[-1] if times else 0.0

    def _watched(self, i, axis, advance):
        inner = super()._watched(i, axis, advance)
        times, places = self._truth[i]

        def advanced(t: float) -> None:
            while times and times[-1] + _STEP_S < t:
                self._note(i, axis, inner, times[-1] + _STEP_S)
            if not times or t > times[-1]:
                self._note(i, axis, inner, t)

        self._places = places
        return advanced

    def _note(self, i, axis, advance, t: float) -> None:
        advance(t)
        self._truth[i][0].append(t)
        self._truth[i][1].append(axis.true_position())

    def true_at(self, i: int, t: float) -> float:
        times, places = self._truth[i]
        k = min(max(bisect.bisect_left(times, t), 1), len(times) - 1)
        part = (t - times[k - 1]) / (times[k] - times[k - 1])
        return places[k - 1] + (places[k] - places[k - 1]) * part

    def _taken(self, reading):
        self._take(reading)
        self.readings += 1
        if reading.unsynchronised:
            self.unsynchronised += 1
            return reading
        self._happens(max(self.scope.clock.now(), reading.time))
        for i, axis in enumerate(reading.axes):
            off = abs(axis.counts - self.true_at(i, reading.time))
            if off > axis.uncertainty_counts + _SLACK_DEG:
                stated = f"stated ±{axis.uncertainty_counts:.6f}°"
                doing = f"{self.scope._session.doing} at {axis.rate:.4f}°/s"
                self.fail(f"axis {i + 1} is {off:.6f}° from what is reported, {stated}; {doing}")
            self.worst = max(self.worst, (off, axis.uncertainty_counts))
        return reading

    def check_dry(self) -> None:
        """Nothing ran dry but on a line that did not carry what would have filled it."""
        for i, axis in enumerate(self.device.axes):
            line = self.lines[min(i, len(self.lines) - 1)]
            for time in axis.record.dry:
                if not line.was_unsound(time - _RECENT_S, time):
                    self.fail(f"axis {i + 1} ran dry at {time - self.t0:.1f} s on a sound line")
            if line.was_unsound(0.0, float("inf")):
                continue
            for time in axis.record.late:
                self.fail(f"axis {i + 1} was given a node too late at {time - self.t0:.1f} s on a sound line")


def seeded_events(
    lines: list[ApoLine], scope: Telescope, chance: random.Random, begin: float, span: float
) -> tuple[list[Event], Counter[str]]:
    """One to four faults within `span` seconds from `begin`, each with its end."""
    events: list[Event] = []
    kinds: Counter[str] = Counter()
    known = (*WIRE, *OUTAGES, *CONTROLLER, *(SDSS if scope.simulator.kind == "sdss" else ()))
    for _ in range(chance.randint(1, 4)):
        kind = chance.choice(known)
        start = begin + chance.uniform(0.0, span)
        kinds[str(kind)] += 1
        events += _fault(kind, start, chance.choice(lines), scope, chance)
    return events, kinds


def _fault(kind, start: float, line: ApoLine, scope: Telescope, chance: random.Random) -> list[Event]:
    axis = chance.choice(scope.simulator.axes)
    length = chance.choice((chance.uniform(0.1, 3.0), chance.uniform(3.0, 40.0)))
    rate = chance.choice((0.05, 0.2, 0.5))

    def begin_wire() -> None:
        line.broken()
        line.go_wrong(kind, rate)

    def begin_outage() -> None:
        line.broken()
        line.state = kind

    if kind in WIRE:
        begin, end = begin_wire, line.be_whole
    elif kind in OUTAGES:
        begin, end = begin_outage, line.be_whole
    else:
        begin, end = _happening(kind, axis, start, chance)
        length = chance.uniform(2.5, 10.0)
    return [Event(start, f"{kind} begins", begin), Event(start + length, f"{kind} ends", end)]


def _happening(kind: str, axis, start: float, chance: random.Random):
    step = {"clock set forward": 0.2, "clock set back": -0.2, "late clock": chance.choice((-0.9, 0.7, -37.0))}
    if kind.startswith("restart"):
        lost = {"loses_position": kind.endswith("position"), "loses_clock": kind.endswith("clock")}
        return lambda: axis.restart(start, **lost), (lambda: axis.clock.set(start)) if lost[
            "loses_clock"
        ] else _nothing
    if kind in step:
        return lambda: _turn(axis, step[kind]), lambda: _turn(axis, -step[kind])
    if kind == "limit switch":
        side = chance.choice((-1, 1))
        return lambda: axis.press_limit(side), axis.release_limits
    bit = {"semaphore": "semaphore_taken", "motion error": _gave_up(axis)}.get(kind, kind.replace(" ", "_"))
    return lambda: axis.fail(bit), lambda: axis.repair(bit)


def _gave_up(axis) -> str:
    return "motion_error" if "motion_error" in StatusWord(1 << 14, axis.kind).names else "out_of_closed_loop"


def _turn(axis, seconds: float) -> None:
    axis.clock.setting += seconds


def _nothing() -> None:
    """End what ends by itself."""
