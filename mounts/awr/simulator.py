"""The AWR Microstep simulated on the wire: keys that act a moment after their command, ramps, events, and a memory.

Time goes on from one thing that happens to the next: a command acts, a motor comes to its speed or turns round, the
worm passes its index. Answers come at once; what happens is said by itself, at its time.
"""

import heapq
import math
import random
from collections import Counter, deque
from collections.abc import Mapping
from typing import Any

from mounts.awr.messages import (
    Backlash,
    Done,
    Error,
    Event,
    IndexPulse,
    Lines,
    Moving,
    Override,
    Response,
    Status,
    Word,
    Written,
)
from mounts.awr.packets import Packets
from mounts.awr.simulator_axis import MovingAxis
from mounts.awr.simulator_settings import SimulatorSettings

_RAM, _CRC, _VERSION = 0x80, 0x3F, 0xFF
_LAST = 0x1A
_HEX = frozenset("0123456789ABCDEF")
_KEYS = {"1": (1, 1), "2": (1, -1), "3": (0, 1), "4": (0, -1), "5": (0, 0), "6": (1, 0)}
_SPEEDS = {"7": "guide", "8": "centre", "9": "slew", "A": "move"}
_RATES = {  # address of the counts by speed, axis and sense
    ("guide", 0, 1): 0x09, ("guide", 0, -1): 0x07, ("guide", 1, 1): 0x05, ("guide", 1, -1): 0x05,
    ("centre", 0, 1): 0x0F, ("centre", 0, -1): 0x0D, ("centre", 1, 1): 0x0B, ("centre", 1, -1): 0x0B,
}  # fmt: skip
_FREQUENCIES = {
    ("move", 0, 1): 0x13, ("move", 0, -1): 0x12, ("move", 1, 1): 0x11, ("move", 1, -1): 0x11,
    ("slew", 0, 1): 0x15, ("slew", 0, -1): 0x15, ("slew", 1, 1): 0x14, ("slew", 1, -1): 0x14,
}  # fmt: skip
_LEAST_COUNTS = 16  # below which the division overflows
_RESETS = {"watchdog": "1", "MCLR": "6", "brownout": "7"}


class SimulatedAwr:
    """A unit with two motors; keeps `transports.memory.Talking`.

    Parameters
    ----------
    settings : SimulatorSettings
        How this unit differs from the ideal.
    t0 : float
        POSIX time at which it is switched on.
    positions : tuple of float
        Steps at which the motors stand, LEFT and UP leading to larger ones.
    """

    def __init__(self, settings: SimulatorSettings, t0: float, positions: tuple[float, float] = (0.0, 0.0)) -> None:
        self.settings = settings
        self._now = t0
        self._rng = random.Random(settings.seed)  # noqa: S311 - nothing secret
        self._packets = Packets()
        self.lasting = dict(settings.words)
        """The non-volatile words by address."""
        self.ram = dict(self.lasting)
        self.wear: Counter[int] = Counter()
        """How often each non-volatile word was written."""
        self.relays = 0
        self.stopped = False
        self.speed = "guide"
        self.keys = [0, 0]
        self.axes = (MovingAxis(float(positions[0])), MovingAxis(float(positions[1])))
        self._missed = [0.0, 0.0]  # steps by which an axis is off its motor's, wired this way or that
        self._senses = [1, 1]
        self._due: list[tuple[float, int, str]] = []  # commands that were heard and have not acted
        self._order = 0
        self._queue: deque[tuple[float, bytes]] = deque()  # what is to be said unasked
        self._moving = (False, False)
        self._per_count = settings.sidereal_steps_per_s * settings.words[0x01] * max(1, settings.words[0x02] >> 8)
        self._aim()
        for axis in self.axes:
            axis.velocity = axis.target
            axis.direction = -1 if axis.target < 0.0 else 1

    # The wire --------------------------------------------------------------------------------------------------

    @property
    def lines(self) -> "tuple[SimulatedAwr]":
        """The one line, at whose far end this unit is."""
        return (self,)

    @property
    def version(self) -> int:
        """The VERSION word."""
        return int(f"{round(self.settings.firmware * 100):04d}", 16)

    def receive(self, data: bytes, t: float) -> bytes:
        """Take bytes that arrived at POSIX `t`; return the answers."""
        self.advance(t)
        packets = self._packets.feed(self._worn(data), t)
        return b"".join(self._answer(packet.text) for packet in packets)

    def says(self, until: float) -> tuple[float, bytes] | None:
        """The next event up to POSIX `until`, and when."""
        while not self._queue and self._step(until):
            pass
        return self._queue.popleft() if self._queue and self._queue[0][0] <= until else None

    def _worn(self, data: bytes) -> bytes:
        """Bytes as the line leaves them."""
        lost, doubled = self.settings.byte_loss, self.settings.byte_doubling
        if not lost and not doubled:
            return data
        come = bytearray()
        for byte in data:
            chance = self._rng.random()
            come += b"" if chance < lost else bytes((byte, byte)) if chance < lost + doubled else bytes((byte,))
        return bytes(come)

    def _packet(self, message: Response | Event) -> bytes:
        stop = "#" if self.version >= 0x0072 else ""
        debug = f"dbg {self._rng.randrange(999)}\r\n" if self._rng.random() < self.settings.debug else ""
        return self._worn(f":{message.text}\r\n{stop}{debug}".encode("ascii"))

    def _say(self, event: Event, late_s: float = 0.0) -> None:
        self._queue.append((self._now + late_s, self._packet(event)))

    def _answer(self, body: str) -> bytes:
        if body == "??":
            return b"".join(self._packet(self._read(address)) for address in (*range(_LAST + 1), _CRC, _VERSION))
        answer = self._obeyed(body)
        if answer is None:
            self._say(Error("C"))
            return b""
        return self._packet(answer)

    def _obeyed(self, body: str) -> Response | None:
        if body in _KEYS or body in _SPEEDS:
            if self.stopped and body in "1234":
                return Done(ok=False)
            self._later(body)
            return Done(ok=True)
        if body in {"D", "E"}:
            return self._kept(commit=body == "E")
        if body == "R?" and self.version >= 0x0072:
            return Status(self.relays, self.stopped)
        if len(body) == 3 and body[0] == "F" and body[1] in "123" and body[2] in "01":
            return self._switched(1 << int(body[1]) - 1, on=body[2] == "1")
        return self._words(body)

    def _words(self, body: str) -> Response | None:
        """Read or write a word."""
        digits = body.removesuffix("?")
        if not set(digits) <= _HEX or (len(digits), len(body)) not in {(2, 3), (6, 6)}:
            return None
        address, *value = bytes.fromhex(digits)
        return self._write(address, value[0] << 8 | value[1]) if value else self._read(address)

    def _switched(self, bit: int, *, on: bool) -> Response:
        self.relays = self.relays | bit if on else self.relays & ~bit
        return Done(ok=True)

    # Its memory ------------------------------------------------------------------------------------------------

    def _read(self, address: int) -> Response:
        if address == _VERSION:
            return Word(address, self.version)
        if address in self.lasting:
            return Word(address, self.lasting[address])
        if self.settings.reads_ram and address & ~_RAM in self.ram:
            return Word(address, self.ram[address & ~_RAM])
        return Done(ok=False)

    def _write(self, address: int, value: int) -> Response:
        plain = address & ~_RAM
        if address == _VERSION or plain not in self.lasting or plain == 0x18:
            return Written(address, ok=False)
        if not address & _RAM:
            self._burn(plain, value)
        self.ram[plain] = value
        if plain in range(0x01, 0x11, 2) and value < _LEAST_COUNTS:
            self._say(Error("9" if value else "8"))
        self._aim()
        return Written(address, ok=True)

    def _kept(self, *, commit: bool) -> Response:
        """Commit all soft writes, or discard them."""
        if commit:
            for address, value in self.ram.items():
                if self.lasting[address] != value:
                    self._burn(address, value)
        self.ram = dict(self.lasting)
        self._aim()
        return Done(ok=True)

    def _burn(self, address: int, value: int) -> None:
        self.lasting[address] = value
        self.wear[address] += 1

    # Speeds ----------------------------------------------------------------------------------------------------

    def _rate(self, address: int) -> float:
        """Steps a second of counts and flags, signed; of counts that cannot be divided by, none."""
        counts, flags = self.ram[address], self.ram[address + 1]
        if not flags & 1 or counts < _LEAST_COUNTS:
            return 0.0
        rate = self._per_count / (counts * max(1, flags >> 8))
        return rate if flags & 2 else -rate

    def _idle(self, axis: int) -> float:
        return self._rate(0x01 + 2 * axis)

    def _wanted(self, axis: int) -> float:
        key = self.keys[axis]
        if not key:
            return self._idle(axis)
        asked = (self.speed, axis, key)
        if asked in _FREQUENCIES:
            return key * self.ram[_FREQUENCIES[asked]] * self.settings.frequency_unit
        rate = self._rate(_RATES[asked])
        if axis == 1:
            return key * rate
        return rate if self.settings.rate_reference == "motor" else self._idle(0) + rate

    def _aim(self) -> None:
        """Let both motors ramp to the speeds that the keys and words ask for now."""
        self._wire()
        fast = 1.0 + self.settings.clock_drift_ppm * 1e-6
        for i, axis in enumerate(self.axes):
            axis.target = 0.0 if self.stopped else self._wanted(i) * fast
            axis.acceleration = self.ram[0x16 + i] * self.settings.acceleration_unit
            axis.acceleration *= 1.0 + self.settings.acceleration_error
            axis.blip_rate = self.ram[0x14 + (i == 0)] * self.settings.frequency_unit
            self._blip(i)

    def _wire(self) -> None:
        """An axis whose direction sense is changed goes on from where it stands."""
        for i, axis in enumerate(self.axes):
            sense = self._sense(i)
            self._missed[i] += (self._senses[i] - sense) * axis.position
            self._senses[i] = sense

    def _blip(self, index: int) -> None:
        """Take up the play where a motor turns round."""
        axis, play = self.axes[index], self.ram[0x19 + index]
        sense = axis.turned()
        if sense and play:
            axis.blip += sense * play
            if self.version >= 0x0059:
                self._say(Backlash(index, sense < 0 if index == 0 else sense > 0))

    # Time ------------------------------------------------------------------------------------------------------

    def advance(self, t: float) -> None:
        """Let time go on to POSIX `t`; a time already passed changes nothing."""
        while self._step(t):
            pass

    def _step(self, until: float) -> bool:
        """Go on to the next thing that happens, at most to `until`; return whether there was one."""
        change = min(axis.change_in for axis in self.axes)
        index = self._index_in()
        due = self._due[0][0] - self._now if self._due else math.inf
        seconds = max(0.0, min(change, due, index))
        if self._now + seconds > until:
            self._run(max(0.0, until - self._now))
            self._now = max(self._now, until)
            return False
        self._run(seconds)
        self._now += seconds
        if due <= min(change, index):
            self._act(heapq.heappop(self._due)[2])
        elif index < change:
            self.axes[0].position += 1e-6  # beyond it, so that it is not met again
            self._say(IndexPulse())
        for i in (0, 1):
            self._blip(i)
        self._tell_motion()
        return True

    def _run(self, seconds: float) -> None:
        for axis in self.axes:
            axis.run(seconds)

    def _index_in(self) -> float:
        """Seconds until the worm passes its index; it is only looked for while axis 1 goes evenly forward."""
        axis, turn = self.axes[0], self.settings.worm_steps
        if not turn or axis.velocity <= 0.0 or not axis.steady:
            return math.inf
        return (turn - axis.position % turn) / axis.velocity

    def _later(self, body: str) -> None:
        """A key or speed acts after a moment, never before one that was heard earlier."""
        delay = max(0.0, self._rng.gauss(self.settings.execution_s, self.settings.execution_jitter_s))
        last = max((due for due, _, _ in self._due), default=self._now)
        self._order += 1
        heapq.heappush(self._due, (max(self._now + delay, last), self._order, body))

    def _act(self, body: str) -> None:
        if body in _SPEEDS:
            self.speed = _SPEEDS[body]
        elif not self.stopped:
            axis, sense = _KEYS[body]
            self.keys[axis] = sense
        self._aim()

    def _tell_motion(self) -> None:
        """Say so when an axis leaves its idle rate or is back at it."""
        one, two = (
            bool(key) or (before and not axis.steady)
            for key, before, axis in zip(self.keys, self._moving, self.axes, strict=True)
        )
        if (one, two) != self._moving:
            self._moving = (one, two)
            self._say(Moving(self._moving), self._rng.gauss(0.0, self.settings.stamp_jitter_s))

    # What happens to it ----------------------------------------------------------------------------------------

    def press(self, axis: int, sense: int) -> None:
        """The hand box's key of axis 1 or 2 is pressed to larger or smaller angles, or released: 1, −1, 0."""
        self.keys[axis - 1] = sense
        self._aim()
        self._tell_motion()

    def override(self, *, stopped: bool) -> None:
        """The override input stops everything at once, or lets it go on at its idle rates."""
        self.stopped = stopped
        self.keys = [0, 0]
        if stopped:
            for axis in self.axes:
                axis.halt()
        self._aim()
        self._moving = (False, False)
        self._say(Override(stopped))

    def reset(self, cause: str = "watchdog") -> None:
        """Begin anew, by `watchdog`, `MCLR` or `brownout`: the motors stand, and soft writes are lost."""
        self.ram, self.keys, self.speed, self.relays = dict(self.lasting), [0, 0], "guide", 0
        self._due.clear()
        self._packets = Packets()
        for axis in self.axes:
            axis.halt()
        self._moving = (False, False)
        self._say(Error(_RESETS[cause]))
        self._aim()

    def levels(self, high: str) -> None:
        """The lines named are high, the others low."""
        a, b, c, d, e, f = (letter in high for letter in "ABCDEF")
        if self.version >= 0x0077:
            self._say(Lines((a, b, c, d, e, f)))

    def stand(self) -> None:
        """Its drives are off, as a program has left them that parked it."""
        for flags in (0x02, 0x04):
            self.ram[flags] &= ~1
        self._aim()
        for axis in self.axes:
            axis.halt()

    def push(self, axis: int, steps: float) -> None:
        """Turn axis 1 or 2 by hand, or let its motor miss as many steps."""
        self._missed[axis - 1] += steps

    # What is true ----------------------------------------------------------------------------------------------

    def true_position(self, axis: int) -> float:
        """Where the motor of axis 1 or 2 has brought it, steps, as LEFT and UP should lead to larger ones."""
        i = axis - 1
        return self._senses[i] * self.axes[i].position + self._missed[i]

    def _sense(self, index: int) -> int:
        directions = self.ram[0x00]
        if directions & 1:
            return -1 if directions & (2 << index) else 1
        return (self.settings.sense1, self.settings.sense2)[index]

    def snapshot(self) -> Mapping[str, object]:
        """All of it, for `restore`."""
        version, state, gauss = self._rng.getstate()
        return {
            "t0": self._now,
            "lasting": list(self.lasting.items()),
            "ram": list(self.ram.items()),
            "wear": list(self.wear.items()),
            "relays": self.relays,
            "stopped": self.stopped,
            "speed": self.speed,
            "keys": list(self.keys),
            "axes": [axis.snapshot() for axis in self.axes],
            "missed": list(self._missed),
            "senses": list(self._senses),
            "due": [[due - self._now, order, body] for due, order, body in self._due],
            "moving": list(self._moving),
            "random": [version, list(state), gauss],
        }

    def restore(self, kept: Mapping[str, Any]) -> None:
        """Go on from a snapshot; what nobody listened to meanwhile is lost."""
        self._now, self.relays, self.stopped, self.speed = kept["t0"], kept["relays"], kept["stopped"], kept["speed"]
        self.lasting, self.ram = dict(map(tuple, kept["lasting"])), dict(map(tuple, kept["ram"]))
        self.wear, self.keys = Counter(dict(map(tuple, kept["wear"]))), list(kept["keys"])
        self.axes = (MovingAxis(**kept["axes"][0]), MovingAxis(**kept["axes"][1]))
        self._missed, self._moving = list(kept["missed"]), (kept["moving"][0], kept["moving"][1])
        self._senses = list(kept["senses"])
        self._due = [(self._now + due, order, body) for due, order, body in kept["due"]]
        self._order = max((order for _, order, _ in self._due), default=0)
        version, state, gauss = kept["random"]
        self._rng.setstate((version, tuple(state), gauss))
