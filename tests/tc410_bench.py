"""A TC410 on the test bench: driver and simulated unit joined in memory under a virtual clock.

The unit's own 48-bit position is the oracle: what the driver says is compared with where the simulator really is.
"""

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from clockdrive.assembly import planner
from clockdrive.clock import VirtualClock
from clockdrive.configuration import load
from clockdrive.drives.tc410 import kind as tc410
from clockdrive.drives.tc410.settings import settings as settings_of
from mounts.deadman import DeadManError
from mounts.drive import AxisPath, AxisSlew, Reading
from mounts.tc410.drive import TC410
from mounts.tc410.registers import COUNTS_PER_SECOND
from pointing.instant import Instant
from pointing.plan import Plan, Start, Timing
from pointing.planner import Planner
from pointing.targets import FixedHaDec, Star, Target
from transports.errors import LinkError
from transports.memory import Device, MemoryLink
from transports.modbus_ascii import ModbusAscii

if TYPE_CHECKING:
    from mounts.tc410.simulator import SimulatedTC410

T0 = 1_800_000_000.0
STEP_ARCSEC = 0.9094736842105263  # of the manual's gearing


@dataclass
class Line:
    """Between driver and unit; cuts, delays and counts what passes."""

    unit: Device
    clock: VirtualClock
    dead: bool = False  # nothing passes
    deaf_to_answers: bool = False  # requests arrive, answers do not
    requests: list[bytes] = field(default_factory=list)
    delay_s: Callable[[], float] = lambda: 0.0  # of each request and each answer beyond the link's latency
    before: Callable[[bytes], None] | None = None

    def receive(self, data: bytes, t: float) -> bytes:
        if self.before is not None:
            self.before(data)
        self.requests.append(data)
        if self.dead:
            return b""
        late = self.delay_s()
        answer = self.unit.receive(data, t + late)
        self.clock.sleep(late + self.delay_s())
        return b"" if self.deaf_to_answers else answer


@dataclass
class Straight:
    """Axes that move evenly."""

    counts: tuple[float, float]
    rates: tuple[float, float]
    since: float
    led: bool = False

    def at(self, time: float) -> tuple[tuple[float, float], tuple[float, float]]:
        (x, y), (u, v), t = self.counts, self.rates, time - self.since
        return (x + u * t, u), (y + v * t, v)


@dataclass
class OnSky:
    """Axes that follow a target from where a plan ends."""

    planner: Planner
    target: Target
    plan: Plan
    led: bool = False

    def at(self, time: float) -> tuple[tuple[float, float], tuple[float, float]]:
        near = self.plan.axes[0].angle, self.plan.axes[1].angle
        states = self.planner.track(self.target, time, self.plan.posture, near)
        one, two = (
            (axis.gearing.counts(angle), rate * axis.gearing.counts_per_radian)
            for axis, (angle, rate) in zip(self.planner.axes, states, strict=True)
        )
        return one, two


class Bench:
    """A unit, and a driver that can be made again as often as a process starts."""

    def __init__(self, *, synchronised: bool = True, clock_start: float = T0, **overrides: Any) -> None:
        dotted = {name.replace("__", "."): value for name, value in overrides.items()}
        self.configuration = load(None, {}, dotted)
        self.clock = VirtualClock(clock_start)
        self.unit: SimulatedTC410 = tc410.simulated(self.configuration, clock_start, None)
        self.line = Line(self.unit, self.clock)
        self.planner = planner(self.configuration)
        self.kept: dict[str, Any] = {}
        self.drive = self.made()
        if synchronised:
            self.drive.connect(self.now, make_safe=False)
            self.drive.sync([self.true(0), self.true(1)], self.now)

    @property
    def now(self) -> float:
        return self.clock.now()

    def made(self, memory: Mapping[str, object] | None = None, **settings: Any) -> TC410:
        """Make a driver as a new process would, from what was kept."""
        simulator = self.configuration.simulator
        modbus = ModbusAscii(
            lambda: MemoryLink(self.line, self.clock, latency_s=simulator.latency_s, baud=simulator.baud or None),
            self.clock,
        )
        chosen = replace(settings_of(self.configuration), **settings)
        return TC410(modbus, chosen, self.kept if memory is None else memory, self.keep)

    def keep(self, memory: Mapping[str, object]) -> None:
        """Keep a memory as the state store does: as JSON."""
        self.kept = json.loads(json.dumps(memory))

    def restarted(self, *, make_safe: bool = False, **settings: Any) -> Reading:
        """Let the process die and another begin."""
        self.drive = self.made(**settings)
        return self.drive.connect(self.now, make_safe=make_safe)

    def true(self, axis: int) -> float:
        """Where the unit counts axis 0 or 1, with all its fraction."""
        self.unit.advance(self.now)
        return self.unit.counted_position(axis + 1)

    def velocity(self, axis: int) -> float:
        """Counts per second of axis 0 or 1 in the present tick."""
        self.unit.advance(self.now)
        return self.unit.axes[axis].moved * COUNTS_PER_SECOND

    @property
    def control(self) -> int:
        return self.unit.memory.raw("velocity_control")

    def timing(self) -> Timing:
        return Timing(self.drive.slew_models, self.drive.start_latency, self.drive.axes_land_together)

    def star(self, hour_angle_deg: float, declination_deg: float) -> Star:
        """Make a star that stands there now."""
        place = FixedHaDec(math.radians(hour_angle_deg), math.radians(declination_deg))
        frame = self.planner.sky.at(Instant.from_posix(self.now))
        x, y, z = frame.astrometric(place.observed(frame))
        ra_deg, dec_deg = math.degrees(math.atan2(y, x)), math.degrees(math.asin(z))
        return Star.from_degrees(ra_deg, dec_deg, epoch=2027.0)

    def plan(self, target: Target) -> Plan:
        reading = self.drive.read(self.now)
        one, two = (axis.counts + axis.rate * (self.now - reading.time) for axis in reading.axes)
        rates = reading.axes[0].rate, reading.axes[1].rate
        return self.planner.plan(target, Start(self.now, (one, two), rates), self.timing())

    def gone_to(self, target: Target) -> Plan:
        """Plan and begin a slew that ends on a target."""
        plan = self.plan(target)
        self.slew(*(AxisSlew(axis.target_counts, axis.rate_counts) for axis in plan.axes))
        return plan

    def tracked(self, path: AxisPath, seconds: float, beat_s: float = 1.0) -> list[tuple[float, float]]:
        """Poll and follow; return by how many counts each axis is off the path half-way between the beats."""
        errors = []
        for _ in range(round(seconds / beat_s)):
            due = self.now + beat_s
            self.drive.read(self.now)
            self.drive.follow(path, self.now)
            self.wait((due - self.now) / 2.0)
            errors.append(self.errors(path))
            self.wait(due - self.now)
        return errors

    def errors(self, path: AxisPath) -> tuple[float, float]:
        """By how many counts each axis is truly off the path now."""
        (one, _), (two, _) = path.at(self.now)
        return self.true(0) - one, self.true(1) - two

    def slew(self, *axes: AxisSlew) -> float:
        return self.drive.start(axes, self.now)

    def wait(self, seconds: float) -> None:
        self.clock.sleep(seconds)

    def polled_until_landed(self, poll_s: float = 0.1, at_most_s: float = 200.0) -> Reading:
        """Read until neither axis slews."""
        end = self.now + at_most_s
        while True:
            reading = self.drive.read(self.now)
            if not any(axis.slewing for axis in reading.axes):
                return reading
            assert self.now < end, "the slew never ended"
            self.wait(poll_s)


class Beside:
    """A guardian that keeps a diary, and counts the beats; it says the motion's end by its `fate`."""

    def __init__(self, *, starts: bool = True) -> None:
        self.diary: list[str] = []
        self.beats, self.fate, self.starts = 0, "", starts

    def start(self) -> None:
        if not self.starts:
            raise DeadManError("the dead-man process did not start")
        self.diary.append("start")

    def arm(self) -> None:
        self.diary.append("arm")

    def hasten(self) -> None:
        self.diary.append("hasten")

    def ease(self) -> None:
        self.diary.append("ease")

    def beat(self) -> bool:
        self.beats += 1
        return not self.fate

    def disarm(self) -> None:
        self.diary.append("disarm")

    def close(self) -> None:
        self.diary.append("close")


def bench_beside(guardian: Beside | None, **overrides: Any) -> Bench:
    """Make a bench whose driver has this guardian beside it for direct speed control, or none."""
    bench = Bench(**overrides)
    bench.drive = bench.made()
    bench.drive._direct._guardian = guardian
    bench.drive.connect(bench.now, make_safe=False)
    return bench


__all__ = ["STEP_ARCSEC", "T0", "Bench", "Beside", "FixedHaDec", "LinkError", "OnSky", "Straight", "bench_beside"]
