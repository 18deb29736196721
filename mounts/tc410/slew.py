"""The TC410's landing law in closed form: how long a slew takes and where the axis is on the way, to the tick.

Every 2 ms tick an axis picks a velocity and moves 40 times as far (position in units of 2⁻²⁴ count, velocity in
units of 20000/2²⁴ counts/s: one step each 50 µs). Towards its target it takes the least of: the last velocity plus
the acceleration, the maximum, and the largest velocity from which it can still stop; never less than the last
velocity minus the deceleration D. From v it stops within

    f(v) = 40 [(n+1) v − D n(n+1)/2],   n = ⌈v/D⌉ − 1,

the sum of the velocities v, v−D, v−2D … above zero. A tick that leaves less than 40 units, with v no more than D,
lands exactly. Moving the wrong way, or too fast to stop, the axis first brakes to rest by D.

Since f(v) − 40 v = f(v − D), a tick spent braking keeps the leftover e = remainder − f(v); so v falls by exactly D a
tick, except for one gain of 1 unit at the tick where e suffices for the n + 1 steps that remain. That, an arithmetic
series for each phase and a square root for the turning point are all there is: no loop over ticks.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from math import isqrt, sqrt
from typing import NamedTuple

from mounts.tc410.registers import COUNTS_PER_SECOND, RegisterError

TICK_S = 0.002
STEPS_PER_TICK = 40  # of 50 µs
FRACTION_BITS = 24
_COUNT = 1 << FRACTION_BITS
_PER_COUNT = 1.0 / _COUNT
_LANDING = STEPS_PER_TICK  # less than this left over: the tick lands


class Phase(NamedTuple):
    """Ticks whose velocities form an arithmetic series; all signed, in register units."""

    first_tick: int  # ticks before this phase
    position: int  # before its first tick
    velocity: int  # of its first tick
    change: int  # of the velocity from tick to tick
    ticks: int


@dataclass(frozen=True, slots=True)
class Move:
    """A move under the landing law; positions have 48 bits, 24 of them fraction."""

    target: int
    ticks: int
    phases: tuple[Phase, ...]

    def position(self, tick: int) -> int:
        """Exact position after `tick` ticks."""
        if tick >= self.ticks:
            return self.target
        for _, position, velocity, change, ticks in self.phases:
            if tick <= ticks:
                return position + STEPS_PER_TICK * (tick * velocity + change * (tick * (tick - 1) // 2))
            tick -= ticks
        return self.target

    def velocity(self, tick: int) -> int:
        """Velocity during tick number `tick`, from 1; zero after landing."""
        for phase in self.phases:
            if phase.first_tick < tick <= phase.first_tick + phase.ticks:
                return phase.velocity + phase.change * (tick - phase.first_tick - 1)
        return 0


class Ramp(NamedTuple):
    """A change of velocity outside a slew."""

    ticks: int  # until the new velocity is reached; the last of them runs at it
    gained: int  # 48-bit distance moved in them


@dataclass(frozen=True, slots=True)
class LandingLaw:
    """What an axis does every tick, in velocity units.

    Attributes
    ----------
    acceleration, deceleration : int
        Velocity gained and lost in a tick: 2⁸ times the registers.
    max_velocity : int
        The largest velocity of a slew.
    """

    acceleration: int
    deceleration: int
    max_velocity: int

    @classmethod
    def from_registers(
        cls,
        acceleration: int,
        deceleration: int,
        max_velocity: int,
        scale: float = 1.0,
    ) -> "LandingLaw":
        """Law of an axis with these registers whose real ramps are `scale` times the nominal ones.

        `max_velocity` is the 24-bit velocity that the maximum-speed register stands for.

        Raises
        ------
        RegisterError
            One of them is zero, so the axis would never arrive.
        """
        if min(acceleration, deceleration, max_velocity) < 1:
            raise RegisterError(
                f"acceleration {acceleration}, deceleration {deceleration}, maximum velocity {max_velocity}: "
                "an axis with one of them below 1 never arrives; set the unit's registers",
            )
        return cls(
            max(2, round(acceleration * 0x100 * scale)),
            max(2, round(deceleration * 0x100 * scale)),
            max_velocity,
        )

    def stopping_distance(self, velocity: int) -> int:
        """f(v): the distance moved from a tick at `velocity` on until rest."""
        n = -(-velocity // self.deceleration) - 1
        return STEPS_PER_TICK * ((n + 1) * velocity - self.deceleration * (n * (n + 1) // 2))

    def fastest(self, remainder: int) -> int:
        """Largest velocity with f(v) ≤ `remainder`.

        f(mD) = 20 D m(m+1), and f is linear with slope 40 (m+1) from there to (m+1)D.
        """
        D = self.deceleration
        m = (isqrt(4 * (remainder // (20 * D)) + 1) - 1) // 2
        return (remainder // STEPS_PER_TICK + D * (m * (m + 1) // 2)) // (m + 1)

    def move(self, start: int, velocity: int, target: int) -> Move:
        """Move from the 48-bit position `start`, at `velocity`, to the 48-bit `target`."""
        builder = _Builder(start, target)
        direction = 1 if target >= start else -1
        forward = velocity * direction
        D = self.deceleration
        left = abs(target - start)
        if forward < 0 or (left == 0 and forward) or (forward > D and self.stopping_distance(forward - D) > left):
            if self._brake(builder, velocity):
                return builder.landed()
            forward = 0
            left = abs(target - builder.position)
            direction = 1 if target >= builder.position else -1
        if left or forward:
            self._approach(builder, direction, forward, left)
        return builder.landed()

    def ramp(self, velocity: int, wanted: int) -> Ramp:
        """Ramp from `velocity` to `wanted`: down by D, through rest if the sign changes, up by A."""
        ticks = gained = 0
        if velocity * wanted < 0 or abs(velocity) > abs(wanted):
            floor = 0 if velocity * wanted <= 0 else wanted
            ticks, gained = _series(velocity, floor, self.deceleration)
            velocity = floor
        up, more = _series(velocity, wanted, self.acceleration)
        return Ramp(ticks + up, gained + more)

    def _brake(self, builder: "_Builder", velocity: int) -> bool:
        """Come to rest from `velocity`; True when that happens to land."""
        D = self.deceleration
        sign = 1 if velocity > 0 else -1
        ticks = -(-abs(velocity) // D)
        builder.add(sign, abs(velocity) - D, -D, ticks - 1)
        if abs(builder.target - builder.position) < _LANDING:
            if ticks == 1:
                builder.add(sign, 0, 0, 1)
            return True
        builder.add(sign, 0, 0, 1)
        return False

    def _approach(self, builder: "_Builder", sign: int, v: int, left: int) -> None:
        """Speed up or slow down to the maximum, cruise, and land; the axis can stop in time."""
        A, D, top = self.acceleration, self.deceleration, self.max_velocity
        if v > top:
            ticks = (v - top) // D
            left -= builder.add(sign, v - D, -D, ticks)
            if left < _LANDING and ticks:
                return
            cruising = True
        else:
            ticks = self._accelerating_ticks(v, left)
            left -= builder.add(sign, v + A, A, ticks)
            cruising = ticks == (top - v) // A
        if cruising:
            spare = left - self.stopping_distance(top + 1)
            if spare >= 0:
                left -= builder.add(sign, top, 0, spare // (STEPS_PER_TICK * top) + 1)
        self._land(builder, sign, left)

    def _accelerating_ticks(self, v: int, left: int) -> int:
        """Ticks of full acceleration from `v`, before the maximum or the braking begins.

        Tick i may run at v + iA while f(v + iA + 1) does not exceed what is left before it. With f taken as the
        parabola 20 v²/D + 20 v that is a quadratic in i; the exact law then corrects its root.
        """
        A, D = self.acceleration, self.deceleration
        most = (self.max_velocity - v) // A
        half = 20 * v * (A + D)
        constant = 20 * v * v - 20 * v * D - left * D
        quadratic = 20 * A * (A + D)
        root = half * half - quadratic * constant
        i = min(max(int((sqrt(root) - half) / quadratic), 0), most) if root > 0 else 0
        while i < most and self._may_run(v, left, i + 1):
            i += 1
        while i > 0 and not self._may_run(v, left, i):
            i -= 1
        return i

    def _may_run(self, v: int, left: int, i: int) -> bool:
        """Whether tick `i` of an acceleration from `v` is not yet bound by the stopping distance."""
        A, D = self.acceleration, self.deceleration
        w = v + i * A + 1
        n = -(-w // D) - 1
        before = (i - 1) * v + A * (i * (i - 1) // 2)
        return STEPS_PER_TICK * ((n + 1) * w - D * (n * (n + 1) // 2) + before) <= left

    def _land(self, builder: "_Builder", sign: int, left: int) -> None:
        """Brake by D a tick from the fastest velocity that can stop, with the one gain of a unit."""
        D = self.deceleration
        fastest = self.fastest(left)
        steps = fastest // D
        gain = (left - self.stopping_distance(fastest)) // STEPS_PER_TICK
        if not gain:
            builder.add(sign, fastest, -D, max(1, -(-fastest // D)))
            return
        plain = steps + 1 - gain
        builder.add(sign, fastest, -D, plain)
        builder.add(sign, fastest - plain * D + 1, -D, gain)


class _Builder:
    """Collects the phases of one move."""

    def __init__(self, start: int, target: int) -> None:
        self.position = start
        self.target = target
        self.ticks = 0
        self.phases: list[Phase] = []

    def add(self, sign: int, velocity: int, change: int, ticks: int) -> int:
        """Append a phase of `ticks` ticks moving in the direction `sign`; return its length."""
        if ticks <= 0:
            return 0
        length = STEPS_PER_TICK * (ticks * velocity + change * (ticks * (ticks - 1) // 2))
        self.phases.append(Phase(self.ticks, self.position, sign * velocity, sign * change, ticks))
        self.ticks += ticks
        self.position += sign * length
        return length

    def landed(self) -> Move:
        return Move(self.target, self.ticks, tuple(self.phases))


def _series(velocity: int, wanted: int, step: int) -> tuple[int, int]:
    """Ticks and distance while the velocity goes to `wanted` by `step` a tick, the last tick at `wanted`."""
    if velocity == wanted:
        return 0, 0
    change = step if wanted > velocity else -step
    ticks = -(-abs(wanted - velocity) // step)
    whole = ticks - 1
    return ticks, STEPS_PER_TICK * (whole * velocity + change * (whole * (whole + 1) // 2) + wanted)


class Tc410Travel(NamedTuple):
    """One axis of a TC410 on its way; keeps `pointing.slew.Travel`."""

    move: Move
    duration: float
    landed: float

    def position(self, elapsed: float) -> float:
        """Position in counts `elapsed` seconds after the start, between ticks to 0.02 count."""
        tick = elapsed * (1.0 / TICK_S)
        if tick >= self.move.ticks:
            return self.landed
        tick = max(tick, 0.0)
        for _, position, velocity, change, ticks in self.move.phases:
            if tick <= ticks:
                return (position + STEPS_PER_TICK * tick * (velocity + change * (tick - 1.0) * 0.5)) * _PER_COUNT
            tick -= ticks
        return self.landed


@dataclass(frozen=True)
class Tc410SlewModel:
    """How an axis of the TC410 slews; keeps `pointing.slew.SlewModel`.

    Attributes
    ----------
    acceleration, deceleration : int
        The registers, 1 to 255.
    max_velocity : int
        The 24-bit velocity that the maximum-speed register stands for.
    acceleration_scale : float
        Learnt: true over nominal acceleration, of both ramps.
    landing_s : float
        Learnt: seconds a real landing takes longer than the law.
    """

    acceleration: int
    deceleration: int
    max_velocity: int
    acceleration_scale: float = 1.0
    landing_s: float = 0.0

    @cached_property
    def law(self) -> LandingLaw:
        """The law with the learnt acceleration."""
        return LandingLaw.from_registers(
            self.acceleration,
            self.deceleration,
            self.max_velocity,
            self.acceleration_scale,
        )

    @property
    def max_rate(self) -> float:
        """The largest speed during a slew, counts per second."""
        return self.max_velocity * COUNTS_PER_SECOND

    def travel(self, start: float, end: float, start_rate: float, end_rate: float) -> Tc410Travel:  # noqa: ARG002
        """Travel from `start` to the whole count nearest `end`, from `start_rate` (counts/s); it lands at rest."""
        target = round(end)
        move = self.law.move(
            round(start * _COUNT),
            round(start_rate / COUNTS_PER_SECOND),
            target << FRACTION_BITS,
        )
        duration = move.ticks * TICK_S + self.landing_s if move.ticks else 0.0
        return Tc410Travel(move, duration, float(target))

    def limited(self, max_rate: float) -> "Tc410SlewModel":
        """Return the law of the same axis with its maximum speed register lowered to at most `max_rate`."""
        return replace(self, max_velocity=max(0x100, int(max_rate / COUNTS_PER_SECOND) & ~0xFF))
