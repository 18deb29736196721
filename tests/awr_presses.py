"""A telescope moved by keys, as it truly goes: speeds change evenly, commands come late or early, events are stamped.

Independent of the planner: no closed form of a press, the speed is followed from one change of it to the next.
"""

import math
import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from mounts.awr.cascade import Stage
from mounts.awr.commands import Speed
from mounts.awr.ladder import Ladder, Rung
from mounts.awr.uncertainty import Jitter

SIDEREAL = 120.0  # motor steps a second
STEP_ARCSEC = 15.041 / SIDEREAL
TIMES = {"guide": 0.3, "centre": 2.0, "move": 32.0}  # sidereal; with the RA drive absolute on the motor
ACCELERATIONS = (20000.0, 16000.0)


def motor_rates(slew: float) -> dict[Speed, tuple[tuple[float, float], tuple[float, float]]]:
    """Of each speed and axis the rate of the motor with either key, steps a second; the slew in times sidereal."""
    rates: dict[Speed, tuple[tuple[float, float], tuple[float, float]]] = {
        "guide": ((1.3 * SIDEREAL, 0.7 * SIDEREAL), (0.3 * SIDEREAL, -0.3 * SIDEREAL))
    }
    rates["centre"] = (3.0 * SIDEREAL, -SIDEREAL), (2.0 * SIDEREAL, -2.0 * SIDEREAL)
    for speed, times in (("move", 32.0), ("slew", slew)):
        rate = times * SIDEREAL
        rates[speed] = (rate, -rate), (rate, -rate)
    return rates


def ladder(
    slew: float = 400.0,
    jitter: Jitter | None = None,
    accelerations: tuple[float, float] = ACCELERATIONS,
    drives: tuple[float, float] = (SIDEREAL, 0.0),
) -> Ladder:
    """A unit as it comes from the factory, slewing so many times sidereal."""
    return Ladder(
        tuple(
            Rung.of(speed, motor, drives, accelerations) for speed, motor in motor_rates(slew).items()
        ),
        jitter or Jitter(),
    )  # fmt: skip


@dataclass
class TrueAxis:
    """One axis: where its motor is, how fast it runs, and what it is told to run at from when on."""

    acceleration: float
    drive: float
    steps: float = 0.0
    rate: float = field(init=False)
    time: float = 0.0
    moved: list[float] = field(default_factory=list)  # when it left its idle rate or came back to it

    def __post_init__(self) -> None:
        self.rate = self.drive

    def run(self, wanted: float, until: float) -> None:
        """Go to a rate, then on at it."""
        change = abs(wanted - self.rate) / self.acceleration
        ramp = min(change, until - self.time)
        if self.rate == self.drive and wanted != self.drive and ramp > 0.0:
            self.moved.append(self.time)
        after = self.rate + math.copysign(self.acceleration * ramp, wanted - self.rate)
        if ramp == change:
            after = wanted
            if wanted == self.drive and self.rate != self.drive:
                self.moved.append(self.time + ramp)
        self.steps += (self.rate + after) / 2.0 * ramp + after * (until - self.time - ramp)
        self.rate, self.time = after, until

    def pressed(self, wanted: float, begin: float, end: float) -> tuple[float, float]:
        """Run at a rate from one time to another, then with the drive; return when it moved, first and last."""
        self.moved.clear()
        self.run(self.drive, begin)
        self.run(wanted, end)
        self.run(self.drive, end + abs(self.rate - self.drive) / self.acceleration + 1e-9)
        return self.moved[0], self.moved[-1]


@dataclass
class TrueUnit:
    """Both axes, and jitter of their own."""

    jitter: Jitter
    seed: int
    drives: tuple[float, float] = (SIDEREAL, 0.0)
    accelerations: tuple[float, float] = ACCELERATIONS

    def __post_init__(self) -> None:
        self.rng = random.Random(self.seed)  # noqa: S311
        self.axes = tuple(TrueAxis(a, d) for a, d in zip(self.accelerations, self.drives, strict=True))

    def press(self, axis: int, motor_rate: float, begin: float, hold: float) -> float:
        """Press a key and release it, both late or early; return for how long its events say that it moved."""
        true = self.axes[axis]
        begun = max(true.time, begin + self.rng.gauss(0.0, self.jitter.press_s))
        ended = max(begun + 1e-6, begin + hold + self.rng.gauss(0.0, self.jitter.press_s))
        first, last = true.pressed(motor_rate, begun, ended)
        return last - first + self.rng.gauss(0.0, self.jitter.stamp_s) - self.rng.gauss(0.0, self.jitter.stamp_s)

    def at(self, axis: int, time: float) -> float:
        """Where an axis is at a time at which it goes with its drive."""
        true = self.axes[axis]
        return true.steps + true.drive * (time - true.time)


Next = Callable[[tuple[float, float], Speed | None], Stage | None]


@dataclass
class Goto:
    """A goto as it truly went.

    Attributes
    ----------
    seconds : float
        Until it was known that the target is reached.
    stages : list of Stage
        As they were planned.
    left : tuple of float
        Steps that each axis still has to go by what is known.
    sigmas : tuple of float
        RMS of what is unknown of that, as stated.
    true : tuple of float
        Steps that each axis truly has to go.
    """

    seconds: float
    stages: list[Stage]
    left: tuple[float, float]
    sigmas: tuple[float, float]
    true: tuple[float, float]

    def worst(self, steps: tuple[float, float]) -> float:
        """Both axes' error together, in guide steps."""
        return math.hypot(self.true[0] / steps[0], self.true[1] / steps[1])


def went(
    ladder: Ladder, plan: Next, unit: TrueUnit, ways: tuple[float, float], drifts: tuple[float, float] = (0.0, 0.0)
) -> Goto:
    """Carry out what `plan` says for what is left, stage by stage, until it says nothing."""
    time, speed, stages = 0.0, None, list[Stage]()
    made, variance = [0.0, 0.0], [0.0, 0.0]

    def left(now: float, known: Sequence[float]) -> tuple[float, float]:
        one, two = (way + drift * now - here for way, drift, here in zip(ways, drifts, known, strict=True))
        return one, two

    while stage := plan(left(time, made), speed):
        begin = time + (0.0 if stage.speed == speed else ladder.exchange_s)
        speed, ends = stage.speed, []
        for axis, press in enumerate(stage.presses):
            if press is None:
                continue
            rate = unit.drives[axis] + press.key.rate
            moved = unit.press(axis, rate, begin + press.begin, press.hold)
            way = press.measured(ladder.jitter, moved)
            made[axis] += way.steps
            variance[axis] += way.sigma**2
            ends.append(unit.axes[axis].time)
        time = max(ends) + ladder.notice_s
        stages.append(stage)
    true = [unit.at(axis, time) - unit.drives[axis] * time for axis in range(2)]
    return Goto(
        time, stages, left(time, made), (math.sqrt(variance[0]), math.sqrt(variance[1])), left(time, true)
    )  # fmt: skip


def random_ways(rng: random.Random, least_deg: float = 0.01, most_deg: float = 120.0) -> tuple[float, float]:
    """Ways of both axes, motor steps, evenly spread in their logarithm."""
    spread = math.log(least_deg), math.log(most_deg)
    one, two = (
        rng.choice((-1.0, 1.0)) * math.exp(rng.uniform(*spread)) * 3600.0 / STEP_ARCSEC for _ in range(2)
    )  # fmt: skip
    return one, two
