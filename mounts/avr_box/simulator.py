"""The box simulated on the wire, in whole cycles of its crystal.

Between two bytes the timers run: TIMER1 moves the PEC pointer and counts guiding down, TIMER2 tracks with axis 1
unless a slew has it, TIMER0 moves axis 2. Bytes are taken as they come; a command that is not whole waits for the
rest for ever, and letters that are none are passed over.
"""

import math
import random
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from mounts.avr_box.simulator_motor import Motor, Slew
from mounts.avr_box.simulator_settings import SimulatorSettings
from mounts.avr_box.simulator_wire import (
    ARGUMENTS,
    BINS,
    CRYSTAL_HZ,
    DEC_GUIDING,
    DEFAULT_COMPARE,
    FIVE_ARCMIN,
    PEC,
    PRESCALERS,
    RA_GUIDING,
    TICK_CYCLES,
    answer,
    fine_cycles,
    tracking_cycles,
)

_FLAGS_AT_BOOT = PEC
_QUARTER = 4
_AT_ONCE = 64  # ticks


class SimulatedAvrBox:
    """A stepper box with two motors; keeps `transports.memory.Device`.

    Parameters
    ----------
    settings : SimulatorSettings
        How this unit differs from the ideal.
    t0 : float
        POSIX time at which it is switched on.
    steps_per_turn : tuple of float
        Microsteps of each motor for a turn of its axis.
    worm_steps : float
        Microsteps of axis 1 for a turn of its worm.
    positions : tuple of int
        Microsteps at which the motors stand, rising with the angles of the axes: the firmware's own way to count.
    signs : tuple of int
        -1 where whoever asks for a true position counts the other way.
    """

    def __init__(
        self,
        settings: SimulatorSettings,
        t0: float,
        steps_per_turn: tuple[float, float] = (23_877_818.18, 11_938_909.09),
        worm_steps: float = 66_327.2727,
        positions: tuple[int, int] = (0, 0),
        signs: tuple[int, int] = (1, 1),
    ) -> None:
        self.settings = settings
        self.steps_per_turn = steps_per_turn
        more = 1 if settings.table_clocks == "byte+1" else 0
        self.motors = tuple(
            Motor(settings.slew_table, low, high, here, more)
            for (low, high), here in zip(PRESCALERS, positions, strict=True)
        )
        self._worm_steps = worm_steps
        self._signs = signs
        self._t0 = t0
        self._now = 0  # crystal cycles
        self._chance = random.Random(settings.seed)  # noqa: S311 - nothing secret
        self._pressed_at = self._next_press()
        self.flags = _FLAGS_AT_BOOT
        self.bin = self.zero = 0
        self._held = bytearray()  # of a command that is not whole
        self._tick_in = TICK_CYCLES
        self._guiding = (0, 0)  # ticks left, and the sign of the change of rate
        self._guided_until = math.inf  # crystal cycles at which guiding ends that lasts whole ticks
        self._tracked = 0  # cycles since the last microstep of tracking
        self._fine = (0, 0, 0)  # microsteps of axis 2 left of < or >, direction, cycles run of the present one
        self._missed = [0.0, 0.0]  # microsteps that the motors did not make, or a hand undid
        self._encoder_zero = tuple(float(here) for here in positions)

    # The wire --------------------------------------------------------------------------------------------------

    @property
    def lines(self) -> "tuple[SimulatedAvrBox]":
        """The one line, at whose far end this unit is."""
        return (self,)

    def receive(self, data: bytes, t: float) -> bytes:
        """Take bytes that arrived at POSIX `t`; return the answers."""
        self.advance(t)
        return self._carried(b"".join(self._byte(byte) for byte in self._carried(data)))

    def _carried(self, data: bytes) -> bytes:
        """What comes of bytes at the other end of a worn line."""
        lost, doubled = self.settings.byte_loss, self.settings.byte_doubling
        if not (lost or doubled):
            return data
        chances = [self._chance.random() for _ in data]
        return b"".join(
            bytes((byte,)) * (0 if chance < lost else 2 if chance < lost + doubled else 1)
            for byte, chance in zip(data, chances, strict=True)
        )

    def _byte(self, byte: int) -> bytes:
        self._held.append(byte)
        letter = chr(self._held[0])
        if letter not in ARGUMENTS:
            self._held.clear()
            return b""
        if len(self._held) <= ARGUMENTS[letter]:
            return b""
        arguments = bytes(self._held[1:])
        self._held.clear()
        return self._obey(letter, arguments)

    def _obey(self, letter: str, arguments: bytes) -> bytes:
        number = int.from_bytes(arguments, "little")
        if letter in "PQ":
            return answer(self.bin, self.zero) if letter == "P" else answer(*self.encoders())
        if letter in "BCZ":
            self._set(letter, number)
        elif letter in "+-<>D":
            self._guide(letter, number)
        elif letter == "M":
            self._move(arguments)
        else:
            axis = 0 if letter in "EW" else 1
            up = (letter in "WNn") is not (axis == 1 and self.settings.north_reversed)
            self._begin(axis, FIVE_ARCMIN[axis], 1 if up else -1, _QUARTER if letter in "ns" else 1)
        return b""

    def _set(self, letter: str, number: int) -> None:
        if letter == "C":
            self.flags = number
        elif letter == "B":
            self.bin = number % BINS
        else:
            self.zero = number % BINS

    def _guide(self, letter: str, number: int) -> None:
        north = -1 if self.settings.north_reversed else 1
        if letter == "D":
            self._fine = (1, north, 0)
        elif letter in "+-" and self.flags & RA_GUIDING:
            self._guiding = (number, 1 if letter == "+" else -1)
            whole = number and self.settings.guide_ends == "whole"
            self._guided_until = self._now + number * TICK_CYCLES if whole else math.inf
        elif letter in "<>" and self.flags & DEC_GUIDING:
            self._fine = (number, north if letter == ">" else -north, 0)

    def _move(self, arguments: bytes) -> None:
        count, last = int.from_bytes(arguments[:4], "little"), arguments[4]
        axis = 1 if (last >> 1 & 1) == self.settings.axis_bit else 0
        up = not last & 0x80
        turned = (self.settings.reversed1, self.settings.reversed2)[axis]
        half = count if self.settings.move_count == "half" else count // 2
        self._begin(axis, half, 1 if up != turned else -1, 1)

    def _begin(self, axis: int, step_max: int, direction: int, slowed: int) -> None:
        if self.motors[axis].slew is not None and self.settings.busy == "ignore":
            return
        self.motors[axis].begin(step_max, direction, slowed)

    # Time ------------------------------------------------------------------------------------------------------

    def advance(self, t: float) -> None:
        """Let the timers run until POSIX `t`; a time already passed changes nothing."""
        until = int((t - self._t0) * CRYSTAL_HZ * (1.0 + self.settings.clock_drift_ppm * 1e-6))
        while self._now < until:
            due = min(until, self._pressed_at, self._guided_until)
            cycles = int(min(due - self._now, self._quiet()))
            self._run(cycles)
            self._now += cycles
            self._tick_in -= cycles
            if self._tick_in <= 0:
                self._ticks()
            if self._now >= self._guided_until:
                self._guiding, self._guided_until = (0, 0), math.inf
            if self._now >= self._pressed_at:
                self._press()

    def _next_press(self) -> float:
        """When the next key of the hand controller is pressed, crystal cycles."""
        every = self.settings.hand_every_s
        return self._now + math.ceil(every * CRYSTAL_HZ * self._chance.uniform(0.5, 1.5)) if every else math.inf

    def _press(self) -> None:
        """Somebody presses a key of the hand controller: 5′ of either axis."""
        axis = self._chance.choice((0, 1))
        self._begin(axis, FIVE_ARCMIN[axis], self._chance.choice((-1, 1)), 1)
        self._pressed_at = self._next_press()

    def _quiet(self) -> int:
        """Cycles until a tick of TIMER1 changes what moves; ticks that change nothing are run through together."""
        if self._guiding[0] or self.flags & PEC or self._index_is_near():
            return self._tick_in
        return self._tick_in + _AT_ONCE * TICK_CYCLES

    def _index_is_near(self) -> bool:
        """Whether the index pulse may come within the ticks that are run through together."""
        motor = self.motors[0]
        left = self._worm_steps - motor.position % self._worm_steps
        fastest = (_AT_ONCE + 1) * TICK_CYCLES / tracking_cycles(DEFAULT_COMPARE)
        return self.settings.index_pulse and (motor.slew is not None or left < fastest + 1)

    def _ticks(self) -> None:
        passed = -self._tick_in // TICK_CYCLES + 1
        self._tick_in += passed * TICK_CYCLES
        self.bin = (self.bin + passed) % BINS
        left, sign = self._guiding
        if self._guided_until == math.inf:
            self._guiding = (max(0, left - passed), sign)

    def _run(self, cycles: int) -> None:
        self._run_axis1(cycles)
        left = self.motors[1].run(cycles)
        steps, direction, run = self._fine
        if steps:
            each = fine_cycles(self.settings.fine_compare)
            made = min((run + left) // each, steps)
            self.motors[1].position += direction * made
            self._fine = (steps - made, direction, run + left - made * each if steps > made else 0)

    def _run_axis1(self, cycles: int) -> None:
        motor = self.motors[0]
        left = motor.run(cycles)
        if left < cycles and self.settings.interrupted == "lost":
            self._tracked = 0
        each = tracking_cycles(self._compare())
        before = motor.position
        made, self._tracked = divmod(self._tracked + left, each)
        motor.position += made
        if self.settings.index_pulse and before // self._worm_steps != motor.position // self._worm_steps:
            self.bin = self.zero

    def _compare(self) -> int:
        compare = self.settings.pec_table[self.bin] if self.flags & PEC else DEFAULT_COMPARE
        left, sign = self._guiding
        return compare - sign * self.settings.guide_counts if left else compare

    # What is true ----------------------------------------------------------------------------------------------

    def true_position(self, axis: int) -> float:
        """Where axis 1 or 2 truly is, microsteps, without the steps that its motor did not make."""
        return self._signs[axis - 1] * self._stands(axis)

    def _stands(self, axis: int) -> float:
        motor = self.motors[axis - 1]
        return motor.position - self._missed[axis - 1] - self.settings.lost_steps * motor.made_at_speed

    def push(self, axis: int, microsteps: float) -> None:
        """Turn axis 1 or 2 by hand to larger angles, or let its motor miss as many steps."""
        self._missed[axis - 1] -= microsteps

    def encoders(self) -> tuple[int, int]:
        """What both encoders count since it was switched on."""
        turned = (self.settings.encoder_reversed1, self.settings.encoder_reversed2)
        stills = (self.settings.encoder_still1, self.settings.encoder_still2)
        senses = (0 if still else -1 if back else 1 for still, back in zip(stills, turned, strict=True))
        one, two = (
            round((self._stands(axis) - zero) / steps * self.settings.encoder_counts_per_turn * sense)
            for axis, zero, steps, sense in zip((1, 2), self._encoder_zero, self.steps_per_turn, senses, strict=True)
        )
        return one, two

    @property
    def moving(self) -> tuple[bool, bool]:
        """Whether each axis slews."""
        return self.motors[0].slew is not None, self.motors[1].slew is not None

    def snapshot(self) -> Mapping[str, object]:
        """All of it, for `restore`."""
        return {
            "t0": self._t0,
            "now": self._now,
            "flags": self.flags,
            "bin": self.bin,
            "zero": self.zero,
            "held": self._held.hex(),
            "tick_in": self._tick_in,
            "guiding": list(self._guiding),
            "guided_until": None if self._guided_until == math.inf else self._guided_until,
            "tracked": self._tracked,
            "fine": list(self._fine),
            "missed": list(self._missed),
            "encoder_zero": list(self._encoder_zero),
            "motors": [
                {
                    "position": motor.position,
                    "made_at_speed": motor.made_at_speed,
                    "slew": None if motor.slew is None else asdict(motor.slew),
                }
                for motor in self.motors
            ],
        }

    def restore(self, kept: Mapping[str, Any]) -> None:
        """Go on from a snapshot."""
        self._t0, self._now, self.flags = kept["t0"], kept["now"], kept["flags"]
        self._pressed_at = self._next_press()
        self.bin, self.zero, self._held = kept["bin"], kept["zero"], bytearray.fromhex(kept["held"])
        self._tick_in, self._tracked = kept["tick_in"], kept["tracked"]
        self._guiding = (kept["guiding"][0], kept["guiding"][1])
        self._guided_until = math.inf if kept["guided_until"] is None else kept["guided_until"]
        self._fine = (kept["fine"][0], kept["fine"][1], kept["fine"][2])
        self._missed, self._encoder_zero = list(kept["missed"]), tuple(kept["encoder_zero"])
        for motor, state in zip(self.motors, kept["motors"], strict=True):
            motor.position, motor.made_at_speed = state["position"], state["made_at_speed"]
            motor.slew = None if state["slew"] is None else Slew(**state["slew"])
