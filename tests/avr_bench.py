"""A stepper box on the test bench: driver and simulated box joined in memory under a virtual clock.

The box's own motors, stepped cycle by cycle of its crystal, are the oracle for whatever the driver says.
"""

import random
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

from clockdrive.clock import VirtualClock
from mounts.avr_box.box import Box
from mounts.avr_box.drive import AvrBoxDrive
from mounts.avr_box.memory import at_park
from mounts.avr_box.settings import AvrSettings
from mounts.avr_box.simulator import SimulatedAvrBox
from mounts.avr_box.simulator_settings import SimulatorSettings
from mounts.avr_box.slew_table import standard
from mounts.drive import AxisSlew, Reading
from transports.memory import Device, MemoryLink

T0 = 1_800_000_000.0
STEPS_PER_TURN = (200 * 64 * 57 / 11 * 360, 200 * 64 * 57 / 11 * 180)
RA_ARCSEC, DEC_ARCSEC = (360.0 * 3600.0 / steps for steps in STEPS_PER_TURN)
SIDEREAL = STEPS_PER_TURN[0] / 86164.0905  # microsteps a second
COUNT = (STEPS_PER_TURN[0] / 20000, STEPS_PER_TURN[1] / 20000)  # microsteps of an encoder count
SETTINGS = AvrSettings(STEPS_PER_TURN, (1, 1), standard())


def coarser_table() -> tuple[int, ...]:
    """A slew table that no formula gives: it falls in uneven stairs, and nowhere as for a constant acceleration."""
    rng, table, byte = random.Random(3), [], 250  # noqa: S311
    for _ in range(1024):
        byte = max(17, byte - rng.choice((0, 0, 0, 0, 0, 0, 1, 3)))
        table.append(byte)
    return tuple(table)


@dataclass
class Line:
    """A path on which both axes go evenly."""

    counts: tuple[float, float]
    rates: tuple[float, float]
    since: float
    led: bool = False
    axes: int = 2

    def at(self, time: float) -> tuple[tuple[float, float], tuple[float, float]]:
        (x, y), (u, v), t = self.counts, self.rates, time - self.since
        return (x + u * t, u), (y + v * t, v)


def _whole(device: Device) -> Device:
    return device


def _as_assumed(unit: SimulatorSettings, settings: AvrSettings) -> bool:
    """Whether moves of a box last as its driver takes them to."""
    ideal = replace(SimulatorSettings(), slew_table=settings.slew_table)
    told = "slew_table", "table_clocks", "interrupted", "busy"
    alike = all(getattr(unit, name) == getattr(ideal, name) for name in told)
    return alike and (unit.move_count, unit.axis_bit) == (settings.move_count, settings.axis_bit)


class Bench:
    """Driver, link, clock and box."""

    def __init__(
        self,
        settings: AvrSettings = SETTINGS,
        unit: SimulatorSettings | None = None,
        memory: Mapping[str, object] | None = None,
        line: Callable[[Device], Device] = _whole,
        baud: int | None = 9600,
        box: SimulatedAvrBox | None = None,
        clock: VirtualClock | None = None,
    ) -> None:
        self.clock = clock or VirtualClock(T0)
        given = unit or SimulatorSettings(encoder_counts_per_turn=settings.encoder_counts_per_turn)
        self.box = box or SimulatedAvrBox(given, self.clock.now(), STEPS_PER_TURN, signs=settings.signs)
        far, clock_ = line(self.box), self.clock
        self.kept: Mapping[str, object] = memory if memory is not None else at_park((0, 0), T0, "")
        self.drive = AvrBoxDrive(
            Box(lambda: MemoryLink(far, clock_, baud=baud), self.clock, baud), settings, self.kept, self._keep
        )
        if line is _whole and _as_assumed(given, settings):
            self.drive._box.send = self._apart(self.drive._box.send, clock_)  # type: ignore[method-assign]

    def _apart(self, send: Callable[[bytes], float], clock: VirtualClock) -> Callable[[bytes], float]:
        """No move is sent to an axis that still makes one."""

        def sent(command: bytes) -> float:
            if command[:1] == b"M":
                self.box.advance(clock.now())
                index = int((command[5] >> 1 & 1) == self.box.settings.axis_bit)
                assert self.box.motors[index].slew is None, f"{command.hex()} to axis {index + 1}, which moves"
            return send(command)

        return sent

    def _keep(self, memory: Mapping[str, object]) -> None:
        self.kept = memory

    def connect(self, *, make_safe: bool = False) -> Reading:
        return self.drive.connect(self.clock.now(), make_safe=make_safe)

    def slew(self, *targets: float, rates: tuple[float, float] = (SIDEREAL, 0.0)) -> float:
        """Slew and poll as the session does; return when the last axis said that it landed."""
        slews = [AxisSlew(target, rate) for target, rate in zip(targets, rates, strict=True)]
        self.drive.start(slews, self.clock.now())
        while any(axis.slewing for axis in self.read().axes):
            self.clock.sleep(0.25)
        return max(axis.slew_ends for axis in self.drive.axes)

    def read(self) -> Reading:
        return self.drive.read(self.clock.now())

    def true(self) -> tuple[float, float]:
        """Where both axes truly are, now."""
        self.box.advance(self.clock.now())
        return self.box.true_position(1), self.box.true_position(2)

    def off(self) -> tuple[float, float]:
        """By how many microsteps the reckoning is ahead of the truth, now."""
        now, true = self.clock.now(), self.true()
        one, two = (axis.at(now).counts - here for axis, here in zip(self.drive.axes, true, strict=True))
        return one, two

    def follow(self, path: Line, seconds: float, look: Callable[[float], None] = lambda _: None) -> None:
        """Read and follow as the session does: at least once a second."""
        end = self.clock.now() + seconds
        while (now := self.clock.now()) < end:
            self.read()
            due = self.drive.follow(path, self.clock.now())
            look(self.clock.now())
            self.clock.sleep(min(due, 1.0, max(0.0, end - now)))


def like(unit: SimulatorSettings | None = None, **changes: object) -> SimulatorSettings:
    """Make a unit that differs in what is named."""
    return replace(unit or SimulatorSettings(), **changes)
