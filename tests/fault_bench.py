"""A telescope to which things happen, and a witness who asks the simulated unit at every request what is true.

What is reported is compared with the unit's own 48-bit positions, wherever they went unseen; what is forbidden is
asked of the true position, whatever the session believes.
"""

import bisect
import math
import random
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field

from faults import ALL_FAULTS, Fault, FaultMachine, by_chance

from clockdrive import Telescope
from mounts.tc410.registers import by_name
from mounts.tc410.simulator import SimulatedTC410
from transports.errors import LinkError

WIRE = ALL_FAULTS
OUTAGES = ("torn", "silent", "deaf")
UNIT = ("power-cycle", "alarm", "supply cut", "hard limit", "soft limit", "joystick", "autoguider", "standby")
KINDS = (*WIRE, *OUTAGES, *UNIT)
ALARMS = ("supply_over_current", "supply_over_voltage", "supply_under_voltage")
_HOST = {"slewing", "remote_control", "tracking"}
_REACTION_S = 6.0  # from the first request of a sound line to a telescope at rest
_GRAZE_S = 1.0  # that a slew, whose path was proven clear, may seem to graze a limit
_SEEN_S = 3.0  # by which a change has been seen
_CLOSE_S = 0.0002
_SHORTEST_S = 2.5  # of what people and supplies do; nobody sees what comes and goes between two looks
_AT_REST = {"idle", "parked"}


@dataclass(order=True)
class Event:
    """Something that happens to the unit or its line at a moment."""

    time: float
    name: str
    action: Callable[[], object] = field(compare=False)


class FaultyLine:
    """Between driver and unit: whole, faulty by chance, torn, silent, or deaf to answers."""

    def __init__(self, unit: SimulatedTC410, seed: int) -> None:
        self.unit = unit
        self.seed = seed
        self.state = "whole"
        self.machine: FaultMachine | None = None
        self.happened: Counter[str] = Counter()
        self.before: Callable[[float], object] = lambda _: None
        self._held = b""

    def receive(self, data: bytes, t: float) -> bytes:
        self.unit.advance(t)
        self.before(t)
        if self.state == "torn":
            raise LinkError("the cable is out, as planned; check it")
        if self.state == "silent":
            return b""
        answer = self.unit.receive(data, t)
        if self.state == "deaf" or not answer:
            return b""
        if self.machine is None:
            answer, self._held = self._held + answer, b""
            return answer
        try:
            pieces = self.machine.pieces(data, answer)
        except LinkError as error:
            raise LinkError(f"{error}; open it again") from error
        come = self._held + b"".join(piece.data for piece in pieces if piece.late_s == 0.0)
        self._held = b"".join(piece.data for piece in pieces if piece.late_s > 0.0)
        return come

    def go_wrong(self, fault: Fault, rate: float) -> None:
        self.machine = FaultMachine(by_chance(self.seed, rate, (fault,)), self.seed)

    def be_whole(self) -> None:
        if self.machine is not None:
            self.happened.update(fault.value for fault in self.machine.happened.elements())
        self.machine, self.state, self._held = None, "whole", b""

    @property
    def sound(self) -> bool:
        return self.machine is None and self.state == "whole"


@dataclass(frozen=True)
class Sample:
    """What was true at one moment."""

    time: float
    counts: tuple[float, float]
    sources: frozenset[str]
    moving: bool


class Witness:
    """Watches a telescope to which `events` happen; collects every broken promise."""

    def __init__(self, scope: Telescope, line: FaultyLine) -> None:
        self.scope, self.line, self.unit = scope, line, scope.simulator
        self.broken: list[str] = []
        self.worst = (0.0, 0.0, 0.0)  # |reported − true| over the uncertainty stated, and both
        self.readings = self.unsynchronised = 0
        self.slack = 0.02
        self._events: list[Event] = []
        self._history: list[Sample] = []
        self._times: list[float] = []
        self._sources: frozenset[str] = frozenset()
        self._sources_since = 0.0
        self._led_in = False
        self._outside_since: float | None = None
        self._session = scope._session
        self._advance, self._taken = self.unit.advance, self._session.taken
        self.unit.advance, self._session.taken = self._advanced, self._seen
        line.before = self._sampled

    # What happens ----------------------------------------------------------------------------------------------

    def plan(self, events: list[Event]) -> None:
        self._events = sorted(events)

    @property
    def ended(self) -> bool:
        return not self._events

    @property
    def last_event(self) -> float:
        return self._events[-1].time if self._events else self.scope.clock.now()

    def _advanced(self, t: float) -> None:
        while self._events and self._events[0].time <= t:
            event = self._events.pop(0)
            self._advance(event.time)
            event.action()
            self._sampled(event.time)
        self._advance(t)

    # What is true ----------------------------------------------------------------------------------------------

    def now(self) -> Sample:
        self.unit.advance(self.scope.clock.now())
        return self._sampled(self.scope.clock.now())

    def _sampled(self, t: float) -> Sample:
        sample = Sample(
            t,
            (self.unit.true_position(1), self.unit.true_position(2)),
            frozenset(self.unit.moving),
            any(axis.moved for axis in self.unit.axes),
        )
        if sample.sources != self._sources:
            self._sources, self._sources_since = sample.sources, t
        if not self._times or t > self._times[-1]:
            self._history.append(sample)
            self._times.append(t)
            self._check_where(sample)
        return sample

    def true_at(self, t: float) -> list[tuple[float, float]]:
        """Where the axes were at a past moment: between the requests next to it, and at those that are close."""
        i = bisect.bisect_left(self._times, t)
        if i == 0 or i == len(self._times):
            return [self._history[min(i, len(self._times) - 1)].counts]
        a, b = self._history[i - 1], self._history[i]
        part = (t - a.time) / (b.time - a.time)
        one, two = (x + (y - x) * part for x, y in zip(a.counts, b.counts, strict=True))
        return [(one, two), *(each.counts for each in (a, b) if abs(each.time - t) < _CLOSE_S)]

    # What is promised ------------------------------------------------------------------------------------------

    def fail(self, text: str) -> None:
        self.broken.append(f"{self.scope.clock.now() - self.t0:.2f} s: {text}")

    t0 = 0.0

    def _seen(self, reading):
        self._taken(reading)
        self.readings += 1
        if reading.unsynchronised:
            self.unsynchronised += 1
            return reading
        true = self.true_at(reading.time)
        for i, axis in enumerate(reading.axes, 1):
            off = min(abs(axis.counts - counts[i - 1]) for counts in true)
            self.worst = max(self.worst, (off / axis.uncertainty_counts, off, axis.uncertainty_counts))
            if off > axis.uncertainty_counts + self.slack:
                self.fail(
                    f"axis {i} is {off:.2f} counts from what is reported, stated ±{axis.uncertainty_counts:.2f}; "
                    f"doing {self._session.doing}, moved by {', '.join(reading.motion) or 'nothing'}, "
                    f"rate {axis.rate:.1f}, line {self.line.state}"
                )
        return reading

    def _check_where(self, sample: Sample) -> None:
        planner = self._session.planner
        angles = planner.angles(sample.counts)
        broken = [check.detail for check in planner.standing(angles, sample.time) if not check.ok]
        driven = sample.moving and sample.sources & _HOST
        slews = "slewing" in sample.sources
        if not broken:
            self._led_in = slews  # if the next sample is outside
        elif not driven:
            self._led_in = False
        if not broken or not driven or not (self.line.sound or slews):
            self._outside_since = None
            return
        if self._outside_since is None:
            self._outside_since = sample.time
        allowed = _GRAZE_S if slews and self._led_in else math.inf if slews else _REACTION_S
        if sample.time - self._outside_since > allowed:
            self.fail(f"moved by {', '.join(sample.sources)} where it must not be: {'; '.join(broken)}")
            self._outside_since = sample.time

    def check_status(self) -> dict:
        """Ask for the status and compare what it says of motion, age and line with what is true."""
        status = self.scope.status().json
        sample, silent = self.now(), status["link_silent_s"]
        if "internal error" in status["trouble"]:
            self.fail(status["trouble"])
        if "axes" not in status:
            return status
        if silent is None and status["position_age_s"] > 8.0:
            self.fail(f"a position {status['position_age_s']:.1f} s old is shown as if it were new")
        if silent is not None or not self.line.sound or sample.time - self._sources_since < _SEEN_S:
            return status
        tracks, slews = "tracking" in sample.sources, "slewing" in sample.sources
        hands = sample.sources - _HOST
        if status["doing"] == "tracking" and status["synchronised"] and not hands and not tracks:
            self.fail(f"status says tracking, but the drive is moved by {', '.join(sample.sources) or 'nothing'}")
        if self._session.doing in _AT_REST and (tracks or slews) and not self._session._must_stop:
            self.fail(f"status says {status['doing']}, but the drive is {', '.join(sample.sources)}")
        return status


def seeded_events(
    line: FaultyLine, unit: SimulatedTC410, chance: random.Random, begin: float, span: float
) -> tuple[list[Event], list[str]]:
    """One to five faults within `span` seconds from `begin`, each with its end."""
    events: list[Event] = []
    kinds: list[str] = []
    for _ in range(chance.randint(1, 5)):
        kind = chance.choice(KINDS)
        start = begin + chance.uniform(0.0, span)
        kinds.append(str(kind))
        events += _fault(kind, start, line, unit, chance)
    return events, kinds


def _fault(kind, start: float, line: FaultyLine, unit: SimulatedTC410, chance: random.Random) -> list[Event]:
    if kind in WIRE:
        rate = chance.choice((0.05, 0.2, 0.5))
        length = chance.uniform(1.0, 20.0)
        begin, end = (lambda: line.go_wrong(kind, rate)), line.be_whole
    elif kind in OUTAGES:
        length = chance.choice((chance.uniform(0.1, 3.0), chance.uniform(3.0, 60.0)))
        begin, end = (lambda: setattr(line, "state", kind)), line.be_whole
    else:
        length = chance.uniform(_SHORTEST_S, 10.0)
        begin, end = _happening(kind, unit, chance)
    return [Event(start, f"{kind} begins", begin), Event(start + length, f"{kind} ends", end)]


Pair = tuple[Callable[[], object], Callable[[], object]]


def _happening(kind: str, unit: SimulatedTC410, chance: random.Random) -> Pair:
    """What begins and what ends it."""
    axis, direction = chance.choice((1, 2)), chance.choice((-1, 1))
    alarm, stick = chance.choice(ALARMS), (chance.randint(0, 255), chance.randint(0, 255))
    way = chance.choice((("north",), ("south", "east"), ("west",)))
    hardware = unit.hardware
    happenings: dict[str, Pair] = {
        "power-cycle": (unit.power_cycle, _nothing),
        "alarm": _alarm(unit, alarm),
        "supply cut": _alarm(unit, "supply_shut_down"),
        "hard limit": (lambda: unit.press_limit(axis, direction), lambda: _release(unit, hardware)),
        "soft limit": _soft_limit(unit, axis, direction),
        "joystick": (lambda: unit.joystick(*stick), lambda: unit.disturb(joystick=None)),
        "autoguider": (lambda: unit.disturb(directions=way), lambda: unit.disturb(directions=())),
        "standby": (lambda: unit.write_coils(0, [False]), _nothing),
    }
    return happenings[kind]


def _alarm(unit: SimulatedTC410, alarm: str) -> Pair:
    """One alarm among those that stand already."""

    def standing() -> list[str]:
        return list(unit.surroundings.alarms)

    def end() -> None:
        left = standing()
        left.remove(alarm)
        unit.disturb(alarms=tuple(left))

    return (lambda: unit.disturb(alarms=(*standing(), alarm))), end


def _nothing() -> None:
    """End what ends by itself."""


def _release(unit: SimulatedTC410, hardware) -> None:
    unit.hardware = hardware
    unit._apply()


def _soft_limit(unit: SimulatedTC410, axis: int, direction: int):
    """Somebody else writes a soft limit right where the axis is; and what was there before, afterwards."""
    name = f"axis{axis}_{'positive' if direction > 0 else 'negative'}_limit"
    before: list[tuple[int, ...]] = []

    def press() -> None:
        before.append(unit.memory.words(by_name(name)))
        unit._write(by_name(name), (int(unit.counted_position(axis)) >> unit.settings.limit_shift,))

    def release() -> None:
        unit._write(by_name(name), before[-1])

    return press, release
