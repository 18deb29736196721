"""Axis controllers to which things happen, and a witness who knows at every moment where the axes truly are."""

import bisect
import random
from collections import Counter

from apo_bench import ApoWitness
from apo_dry import Exchange, could_have_been_given
from fault_bench import OUTAGES, WIRE, Event, FaultyLine

from clockdrive import Telescope
from mounts.apo.simulator_path import Piece
from mounts.apo.status_word import StatusWord
from transports.errors import LinkError

CLOCK_STEPS = {
    "clock set forward": 0.2,
    "clock set back": -0.2,
    "clock a second slow": -0.9,
    "clock five seconds fast": 5.0,
    "clock five seconds slow": -5.0,
    "clock in UTC": -37.0,
    "clock in GPS time": -19.0,
}
CONTROLLER = (
    *("restart", "restart that loses the position", "restart that loses the clock"),
    *("stop button", "motion error", "limit switch"),
    *CLOCK_STEPS,
)
SDSS = ("semaphore", "out of closed loop")
_SLACK_DEG = 1e-6
_LATE_S = 5.0  # after an answer that was lost, or a step of the clock, in which what was on its way may be too late
ADDRESSES = ("AZ", "ALT", "ROT")


class ApoLine(FaultyLine):
    """A line between driver and controllers that goes wrong, and a record of what was said and what was eaten."""

    def __init__(self, line, seed: int) -> None:
        line.advance = lambda _: None  # its controllers are asked one by one
        super().__init__(line, seed)
        self.exchanges: dict[str, list[Exchange]] = {}  # by the word of the axis; empty on a line of its own
        self.answered: bytes | None = None  # by the controller, lately
        self._controllers = line._controllers
        inner = line.receive

        def receive(data: bytes, t: float) -> bytes:
            self.answered = inner(data, t)
            return self.answered

        line.receive = receive

    def receive(self, data: bytes, t: float) -> bytes:
        word, command = self._addressed(data)
        said, self.answered = self.exchanges.setdefault(word, []), None
        try:
            come = super().receive(data, t)
        except LinkError:
            said.append(Exchange(t, command, eaten=True))
            raise
        taken_away = self.answered is None or come != self.answered
        said.append(Exchange(t, command, eaten=taken_away or not self._can_obey(word, t)))
        return come

    def _addressed(self, data: bytes) -> tuple[str, str]:
        """The word of an axis and the command of a line; a word is there on a shared line only."""
        words = [*data.decode("latin-1").split(), "", ""]
        return (words[0], words[1]) if words[0] in ADDRESSES else ("", words[0])

    def _can_obey(self, word: str, t: float) -> bool:
        """Whether a controller is there, and no other host has it."""
        axis = self._controllers.get(word)
        return axis is None or (t >= axis.silent_until and "semaphore_taken" not in axis.conditions)


class FaultWitness(ApoWitness):
    """Watches; collects every broken promise."""

    def __init__(self, scope: Telescope, lines: list[ApoLine]) -> None:
        self.broken: list[str] = []
        self.worst = (0.0, 0.0)  # |reported − true| and the uncertainty stated, degrees
        self.readings = self.unsynchronised = self.excused = 0
        self.turned: dict[int, list[float]] = {}  # by axis: the steps in which its clock has been set wrong
        self.stepped: dict[int, list[float]] = {}  # by axis: when somebody set its clock
        self._events: list[Event] = []
        self._truth: list[tuple[list[float], list[tuple[Piece, float]]]] = [([], []) for _ in scope.simulator.axes]
        super().__init__(scope)
        for axis, kept in zip(self.device.axes, self._truth, strict=True):
            axis.servo._crossed = self._kept(axis, axis.servo._crossed, *kept)
        self.lines = lines
        session = scope._session
        self._take, session.taken = session.taken, self._taken
        for line in lines:
            line.before = self._happens

    def plan(self, events: list[Event]) -> None:
        self._events = sorted(events)

    @property
    def last_event(self) -> float:
        return self._events[-1].time if self._events else self.scope.clock.now()

    def fail(self, text: str) -> None:
        self.broken.append(f"{self.scope.clock.now() - self.t0:.1f} s: {text}")

    t0 = 0.0

    @staticmethod
    def _kept(axis, crossed, begins, motions):
        """Keep every motion of an axis with its slip, as the servo ends it."""

        def crossing(motion: Piece) -> bool:
            begins.append(motion.start)
            motions.append((motion, axis.slip))
            return crossed(motion)

        return crossing

    def _happens(self, t: float) -> None:
        while self._events and self._events[0].time <= t:
            event = self._events.pop(0)
            for axis in self.device.axes:
                axis.advance(event.time)
            event.action()
        for axis in self.device.axes:
            axis.advance(t)

    def now(self) -> tuple[float, float]:
        self._happens(self.scope.clock.now())
        return super().now()

    def true_at(self, i: int, t: float) -> float:
        """Where an axis truly was at a time, by the motions of its servo."""
        axis = self.device.axes[i]
        begins, motions = self._truth[i]
        count = axis.clock.count(t)
        motion, slip = motions[max(bisect.bisect_right(begins, count) - 1, 0)]
        return motion.at(min(count, motion.end))[0] + slip

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
            if axis.uncertainty_counts < 1.0:
                self.worst = max(self.worst, (off, axis.uncertainty_counts))
        return reading

    # What ran dry ----------------------------------------------------------------------------------------------

    def check_dry(self) -> None:
        """Nothing ran dry where a node could have come, and none came too late where nothing was in its way."""
        for i, axis in enumerate(self.device.axes):
            said = self._said(i)
            for time in axis.record.dry:
                if could_have_been_given(said, time):
                    self.fail(f"axis {i + 1} ran dry at {time - self.t0:.1f} s")
                else:
                    self.excused += 1
            for time in axis.record.late:
                lost = any(each.eaten for each in said if time - _LATE_S < each.time <= time)
                if not lost and not any(0.0 <= time - at < _LATE_S for at in self.stepped.get(i, ())):
                    self.fail(f"axis {i + 1} was given a node too late at {time - self.t0:.1f} s on a sound line")

    def _said(self, i: int) -> list[Exchange]:
        shared = len(self.lines) == 1
        return self.lines[0 if shared else i].exchanges.get(ADDRESSES[i] if shared else "", [])


def seeded_events(
    witness: FaultWitness, chance: random.Random, begin: float, span: float
) -> tuple[list[Event], Counter[str]]:
    """One to four faults within `span` seconds from `begin`, each with its end."""
    events: list[Event] = []
    kinds: Counter[str] = Counter()
    known = (*WIRE, *OUTAGES, *CONTROLLER, *(SDSS if witness.scope.simulator.kind == "sdss" else ()))
    for _ in range(chance.randint(1, 4)):
        kind = chance.choice(known)
        start = begin + chance.uniform(0.0, span)
        kinds[str(kind)] += 1
        events += _fault(kind, start, witness, chance)
    return events, kinds


def _fault(kind, start: float, witness: FaultWitness, chance: random.Random) -> list[Event]:
    line, i = chance.choice(witness.lines), chance.randrange(len(witness.scope.simulator.axes))
    length = chance.choice((chance.uniform(0.1, 3.0), chance.uniform(3.0, 40.0)))
    rate = chance.choice((0.05, 0.2, 0.5))

    def begin_outage() -> None:
        line.state = kind

    if kind in WIRE:
        begin, end = (lambda: line.go_wrong(kind, rate)), line.be_whole
    elif kind in OUTAGES:
        begin, end = begin_outage, line.be_whole
    else:
        begin, end = _happening(kind, i, start, witness, chance)
        length = chance.uniform(2.5, 10.0)
    return [Event(start, f"{kind} begins", begin), Event(start + length, f"{kind} ends", end)]


def _happening(kind: str, i: int, start: float, witness: FaultWitness, chance: random.Random):
    axis = witness.scope.simulator.axes[i]

    def turn(seconds: float) -> None:
        axis.clock.setting += seconds
        witness.turned.setdefault(i, []).append(seconds)
        witness.stepped.setdefault(i, []).append(axis.clock.posix(axis.count))

    def turn_back(seconds: float) -> None:
        if seconds in witness.turned.get(i, ()):  # and nobody has set it right meanwhile
            turn(-seconds)
            for each in (seconds, -seconds):
                witness.turned[i].remove(each)

    def set_right() -> None:
        axis.clock.set(start, axis.settings.clock_offset_s)
        witness.turned[i] = []

    if kind.startswith("restart"):
        lost = {"loses_position": kind.endswith("position"), "loses_clock": kind.endswith("clock")}
        begin = lambda: axis.restart(start, **lost)  # noqa: E731 - it is one of a pair
        return begin, set_right if lost["loses_clock"] else _nothing
    if kind in CLOCK_STEPS:
        return (lambda: turn(CLOCK_STEPS[kind])), lambda: turn_back(CLOCK_STEPS[kind])
    if kind == "limit switch":
        side = chance.choice((-1, 1))
        return lambda: axis.press_limit(side), axis.release_limits
    bit = {"semaphore": "semaphore_taken", "motion error": _gave_up(axis)}.get(kind, kind.replace(" ", "_"))
    return lambda: axis.fail(bit), lambda: axis.repair(bit)


def _gave_up(axis) -> str:
    return "motion_error" if "motion_error" in StatusWord(1 << 14, axis.kind).names else "out_of_closed_loop"


def _nothing() -> None:
    """End what ends by itself."""
