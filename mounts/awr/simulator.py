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

from mounts.awr import simulator_wire as wire
from mounts.awr.simulator_axis import MovingAxis
from mounts.awr.simulator_line import WornLine
from mounts.awr.simulator_settings import SimulatorSettings
from mounts.awr.simulator_wire import WORDS

_RATES = {  # whose counts hold by speed, axis and sense
    ("guide", 0, 1): "guide_left", ("guide", 0, -1): "guide_right", ("guide", 1, 1): "guide_up",
    ("guide", 1, -1): "guide_up", ("centre", 0, 1): "centre_left", ("centre", 0, -1): "centre_right",
    ("centre", 1, 1): "centre_up", ("centre", 1, -1): "centre_up",
}  # fmt: skip
_FREQUENCIES = {
    ("move", 0, 1): "move_left", ("move", 0, -1): "move_right", ("move", 1, 1): "move_up", ("move", 1, -1): "move_up",
    ("slew", 0, 1): "slew_right", ("slew", 0, -1): "slew_right", ("slew", 1, 1): "slew_up",
    ("slew", 1, -1): "slew_up",
}  # fmt: skip
_DRIVES, _SLEWS = ("drive_ra", "drive_dec"), ("slew_right", "slew_up")
_ACCELERATIONS, _PLAYS = ("max_accel_ra", "max_accel_dec"), ("ra_backlash", "dec_backlash")
_COUNTS = frozenset(range(WORDS["drive_ra"], WORDS["centre_left"] + 1, 2))
_LEAST_COUNTS = 16  # below which the division overflows
_BLIPS = ({-1: wire.RA_REVERSED, 1: wire.RA_NORMAL}, {1: wire.DEC_TO_POLE, -1: wire.DEC_FROM_POLE})
_RESETS = {"watchdog": "watchdog timeout reset", "MCLR": "MCLR reset", "brownout": "brownout reset"}
_WITH_BLIPS, _WITH_POLL, _WITH_LINES = 0x0059, 0x0072, 0x0077  # the firmware of the manual's revisions


class SimulatedAwr:
    """A unit with two motors; keeps `transports.memory.Talking`.

    Parameters
    ----------
    settings : SimulatorSettings
        How this unit differs from the ideal.
    t0 : float
        POSIX time at which it is switched on.
    positions : tuple of float
        Steps at which the axes stand, LEFT and UP leading to larger ones.
    """

    def __init__(self, settings: SimulatorSettings, t0: float, positions: tuple[float, float] = (0.0, 0.0)) -> None:
        self.settings = settings
        self._now = t0
        self._rng = random.Random(settings.seed)  # noqa: S311 - nothing secret
        self._ear = wire.Ear()
        self._inward, self._outward = (WornLine(settings, self._rng) for _ in range(2))
        self._coming: deque[tuple[float, bytes]] = deque()  # bytes of the host that are late
        self.lasting = dict(settings.words)
        """The non-volatile words by address."""
        self.ram = dict(self.lasting)
        self.wear: Counter[int] = Counter()
        """How often each non-volatile word was written."""
        self.relays = 0
        self.stopped = False
        self.speed = "guide"
        self.keys = [0, 0]
        one, two = (MovingAxis.at(float(place), play) for place, play in zip(positions, settings.plays, strict=True))
        self.axes = (one, two)
        self._missed = [0.0, 0.0]  # steps by which an axis is off its motor's, wired this way or that
        self._senses = [1, 1]
        self._due: list[tuple[float, int, str]] = []  # commands that were heard and have not acted
        self._order = 0
        self._queue: deque[tuple[float, bytes]] = deque()  # what is to be said unasked
        self._moving = (False, False)
        counts, flags = self._rate_words(settings.words, "drive_ra")
        self._per_count = settings.sidereal_steps_per_s * counts * self._divisor(flags)
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
    def plays(self) -> tuple[float, float]:
        """Play of each axis, motor steps."""
        return self.axes[0].play, self.axes[1].play

    @property
    def version(self) -> int:
        """The VERSION word."""
        return int(f"{round(self.settings.firmware * 100):04d}", 16)

    @property
    def _stops(self) -> bool:
        stop = self.settings.stop
        return self.version >= _WITH_POLL if stop == "by firmware" else stop == "always"

    def receive(self, data: bytes, t: float) -> bytes:
        """Take bytes that arrived at POSIX `t`; return the answers."""
        self.advance(t)
        answers = []
        for at, piece in self._inward.carried(data, t):
            if at > t:
                self._coming.append((at, piece))
            else:
                answers += self._heard(piece)
        self._queue.extend(each for each in answers if each[0] > self._now)
        return b"".join(piece for at, piece in answers if at <= self._now)

    def says(self, until: float) -> tuple[float, bytes] | None:
        """The next thing that is said unasked or late up to POSIX `until`, and when."""
        while not self._queue and self._step(until):
            pass
        return self._queue.popleft() if self._queue and self._queue[0][0] <= until else None

    def _heard(self, data: bytes) -> list[tuple[float, bytes]]:
        """Obey what the host said; return what is answered, and when."""
        texts = [text for body in self._ear.hear(data) for text in self._answers(body)]
        return [piece for text in texts for piece in self._outward.carried(self._packet(text), self._now)]

    def _packet(self, text: str) -> bytes:
        debug = f"dbg {self._rng.randrange(999)}\r\n" if self._rng.random() < self.settings.debug else ""
        return f"{wire.said(text, with_stop=self._stops)}{debug}".encode("ascii")

    def _say(self, text: str, late_s: float = 0.0) -> None:
        self._queue.extend(self._outward.carried(self._packet(text), self._now + late_s))

    def _answers(self, body: str) -> list[str]:
        if body == wire.ALL_WORDS:
            return [self._read(address) for address in wire.TOLD]
        answer = self._obeyed(body)
        if answer is None:
            self._say(wire.ERRORS["protocol syntax error"])
            return []
        return [answer]

    def _obeyed(self, body: str) -> str | None:
        """What is answered to a command; None to what is none."""
        command = wire.COMMANDS.get(body, "")
        if command in wire.KEYS or command in wire.SPEEDS:
            if self.stopped and command in wire.KEYS and wire.KEYS[command][1]:
                return wire.NO
            self._later(command)
            return wire.YES
        if command:
            return self._kept(commit=command == "COMMIT")
        if body == wire.POLL and self.version >= _WITH_POLL:
            return wire.polled(self.relays, stopped=self.stopped)
        if body in wire.RELAYS:
            number, on = wire.RELAYS[body]
            return self._switched(1 << number - 1, on=on)
        return None if (asked := wire.asked(body)) is None else self._word(*asked)

    def _switched(self, bit: int, *, on: bool) -> str:
        self.relays = self.relays | bit if on else self.relays & ~bit
        return wire.YES

    # Its memory ------------------------------------------------------------------------------------------------

    def _word(self, address: int, value: int | None) -> str:
        return self._read(address) if value is None else self._write(address, value)

    def _read(self, address: int) -> str:
        if address == wire.VERSION:
            return wire.told(address, self.version)
        if address in self.lasting:
            return wire.told(address, self.lasting[address])
        if self.settings.reads_plain and address & ~wire.SOFT in self.lasting:
            return wire.told(address, self.lasting[address & ~wire.SOFT])
        if self.settings.reads_ram and address & ~wire.SOFT in self.ram:
            return wire.told(address, self.ram[address & ~wire.SOFT])
        return wire.NO

    def _write(self, address: int, value: int) -> str:
        plain = address & ~wire.SOFT
        if address == wire.VERSION or plain not in self.lasting or plain == wire.RESERVED:
            return wire.written(address, ok=False)
        if not address & wire.SOFT:
            self._burn(plain, value)
        self.ram[plain] = value
        if plain in _COUNTS and value < _LEAST_COUNTS:
            self._say(wire.ERRORS["divide overflow" if value else "divide by zero"])
        self._aim()
        return wire.written(address, ok=True, form=self.settings.write_answer)

    def _kept(self, *, commit: bool) -> str:
        """Commit all soft writes, or discard them."""
        if commit:
            for address, value in self.ram.items():
                if self.lasting[address] != value:
                    self._burn(address, value)
        self.ram = dict(self.lasting)
        self._aim()
        return wire.YES

    def _burn(self, address: int, value: int) -> None:
        self.lasting[address] = value
        self.wear[address] += 1

    # Speeds ----------------------------------------------------------------------------------------------------

    @staticmethod
    def _rate_words(words: Mapping[int, int], name: str) -> tuple[int, int]:
        """Counts and flags of a rate."""
        return words[WORDS[name]], words[WORDS[name] + 1]

    def _divisor(self, flags: int) -> int:
        postscaler = flags >> wire.POSTSCALER_SHIFT
        return postscaler + 1 if self.settings.postscaler == "plus-one" else max(1, postscaler)

    def _rate(self, name: str) -> float:
        """Steps a second of a rate, signed; of counts that cannot be divided by, none."""
        counts, flags = self._rate_words(self.ram, name)
        if not flags & wire.ENABLE or counts < _LEAST_COUNTS:
            return 0.0
        rate = self._per_count / (counts * self._divisor(flags))
        return rate if flags & wire.POSITIVE else -rate

    def _idle(self, axis: int) -> float:
        return self._rate(_DRIVES[axis])

    def _wanted(self, axis: int) -> float:
        key = self.keys[axis]
        if not key:
            return self._idle(axis)
        asked = (self.speed, axis, key)
        if asked in _FREQUENCIES:
            return key * self.ram[WORDS[_FREQUENCIES[asked]]] * self.settings.frequency_unit
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
            axis.acceleration = self.ram[WORDS[_ACCELERATIONS[i]]] * self.settings.acceleration_unit
            axis.acceleration *= 1.0 + self.settings.acceleration_error
            axis.blip_rate = self.ram[WORDS[_SLEWS[i]]] * self.settings.frequency_unit
            self._blip(i)

    def _wire(self) -> None:
        """An axis whose direction sense is changed goes on from where it stands."""
        for i, axis in enumerate(self.axes):
            sense = self._sense(i)
            self._missed[i] += (self._senses[i] - sense) * axis.place
            self._senses[i] = sense

    def _blip(self, index: int) -> None:
        """Take up the play where a motor turns round."""
        axis, play = self.axes[index], self.ram[WORDS[_PLAYS[index]]]
        sense = axis.turned()
        if sense and play:
            axis.blip += sense * play
            if self.version >= _WITH_BLIPS:
                self._say(_BLIPS[index][sense])

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
        coming = self._coming[0][0] - self._now if self._coming else math.inf
        seconds = max(0.0, min(change, due, coming, index))
        if self._now + seconds > until:
            self._run(max(0.0, until - self._now))
            self._now = max(self._now, until)
            return False
        self._run(seconds)
        self._now += seconds
        if coming <= min(change, due, index):
            self._queue.extend(self._heard(self._coming.popleft()[1]))
        elif due <= min(change, index):
            self._act(heapq.heappop(self._due)[2])
        elif index < change:
            self.axes[0].position += 1e-6  # beyond it, so that it is not met again
            self._say(wire.INDEX_PULSE)
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

    def _later(self, command: str) -> None:
        """A key or speed acts after a moment, never before one that was heard earlier."""
        delay = max(0.0, self._rng.gauss(self.settings.execution_s, self.settings.execution_jitter_s))
        last = max((due for due, _, _ in self._due), default=self._now)
        self._order += 1
        heapq.heappush(self._due, (max(self._now + delay, last), self._order, command))

    def _act(self, command: str) -> None:
        if command in wire.SPEEDS:
            self.speed = wire.SPEEDS[command]
        elif not self.stopped:
            axis, sense = wire.KEYS[command]
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
            self._say(wire.moving(*self._moving), self._rng.gauss(0.0, self.settings.stamp_jitter_s))

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
        self._say(wire.FULL_STOP if stopped else wire.GO_FROM_ES)

    def reset(self, cause: str = "watchdog") -> None:
        """Begin anew, by `watchdog`, `MCLR` or `brownout`: the motors stand, and soft writes are lost."""
        self.switched_on()
        self._say(wire.ERRORS[_RESETS[cause]])

    def overflow(self) -> None:
        """Its event buffer overflows."""
        self._say(wire.ERRORS["event buffer overflow"])

    def switched_on(self) -> None:
        """Begin anew after its power was cut: the same, and nothing is told."""
        self.ram, self.keys, self.speed, self.relays = dict(self.lasting), [0, 0], "guide", 0
        self._due.clear()
        self._coming.clear()
        self._ear = wire.Ear()
        for axis in self.axes:
            axis.halt()
        self._moving = (False, False)
        self._aim()

    def levels(self, high: str) -> None:
        """The lines named are high, the others low."""
        if self.version >= _WITH_LINES:
            self._say(wire.lines(high))

    def stand(self) -> None:
        """Its drives are off, as a program has left them that parked it."""
        for drive in _DRIVES:
            self.ram[WORDS[drive] + 1] &= ~wire.ENABLE
        self._aim()
        for axis in self.axes:
            axis.halt()

    def push(self, axis: int, steps: float) -> None:
        """Turn axis 1 or 2 by hand, or let its motor miss as many steps."""
        self._missed[axis - 1] += steps

    # What is true ----------------------------------------------------------------------------------------------

    def true_position(self, axis: int) -> float:
        """Where axis 1 or 2 is, steps of its motor, as LEFT and UP should lead to larger ones."""
        i = axis - 1
        return self._senses[i] * self.axes[i].place + self._missed[i]

    def _sense(self, index: int) -> int:
        directions = self.ram[wire.DIRECTIONS]
        if directions & wire.SENSES["dir_sw_override"]:
            return -1 if directions & wire.SENSES[("sw_ra_sense", "sw_dec_sense")[index]] else 1
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
