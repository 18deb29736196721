"""The speeds that a unit has, from GUIDE to SLEW, and what its keys do to both axes at each of them.

One speed is in force for both axes. Everything is counted from the drives below, in steps of the motors.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

from mounts.awr.commands import Speed
from mounts.awr.errors import AwrError
from mounts.awr.ramps import Key
from mounts.awr.uncertainty import Jitter

GUIDE_STEP_S = 0.1  # of a press at GUIDE speed, whose angle is the guide step
_SPREAD = 4.0  # standard deviations of a hold by which the shortest press is longer than none
_SLEW_SIGMA = 0.6
"""Guide steps, RMS, that a slew may leave unknown in each axis.

With the 0.47 that a last press at CENTRE speed leaves (5 ms, 2x against 30 %) both axes together are within two guide
steps in 95 of 100 cases: √5.99 · √(0.6² + 0.47²) = 1.9.
"""
_HARDLY_FASTER = 2.0  # times the next slower speed, below which a slew is not worth its name
_SPARE_S = 0.002  # between two commands, beside the line
_BYTES = 10  # of a key and its answer
_EVENT_BYTES = 7
_APART = 4.0  # standard deviations of what lies between two events, so that hardly ever one tells of both axes


def exchange_s(jitter: Jitter, byte_s: float, delay_s: float = 0.0) -> float:
    """Seconds from one key to the next: their answers, and events that they make, do not wait for one another.

    Parameters
    ----------
    jitter : Jitter
        By how much presses and events are off their times.
    byte_s, delay_s : float
        Seconds that a byte takes on the line, and that the line takes each way.
    """
    return (_BYTES + _EVENT_BYTES) * byte_s + 2.0 * delay_s + _SPARE_S + _APART * jitter.hold_s


@dataclass(frozen=True)
class Rung:
    """One speed.

    Parameters
    ----------
    speed : str
        Its name.
    keys : tuple
        Of each axis the keys to larger and to smaller counts; None for one that does not move it there, as its rate
        is no faster than the drive's.
    """

    speed: Speed
    keys: tuple[tuple[Key | None, Key | None], tuple[Key | None, Key | None]]

    def key(self, axis: int, way: float) -> Key | None:
        """The key that moves an axis, 0 or 1, in the direction of a way."""
        return self.keys[axis][0 if way >= 0.0 else 1]

    def slowest(self, axis: int) -> float:
        """Steps a second of the slower of an axis's two keys."""
        return min((abs(key.rate) for key in self.keys[axis] if key), default=math.inf)

    def at_most(self, rates: Sequence[float]) -> "Rung":
        """The same with keys no faster than so many steps a second."""
        one, two = (_capped(keys, rate) for keys, rate in zip(self.keys, rates, strict=True))
        return replace(self, keys=(one, two))

    @classmethod
    def of(
        cls,
        speed: Speed,
        motor: Sequence[tuple[float, float]],
        drives: Sequence[float],
        accelerations: Sequence[float],
    ) -> "Rung":
        """From the rates of the motors, steps a second, signed.

        Parameters
        ----------
        motor : sequence of tuple
            Of each axis its rate with the key to larger and with that to smaller counts.
        drives, accelerations : sequence of float
            Of each axis the rate of its drive, and its acceleration.
        """
        one, two = (
            (_key(up - drive, 1.0, acceleration), _key(down - drive, -1.0, acceleration))
            for (up, down), drive, acceleration in zip(motor, drives, accelerations, strict=True)
        )
        return cls(speed, (one, two))


def _key(rate: float, sign: float, acceleration: float) -> Key | None:
    return Key(rate, acceleration) if rate * sign > 0.0 else None


def _capped(keys: tuple[Key | None, Key | None], rate: float) -> tuple[Key | None, Key | None]:
    one, two = (key and replace(key, rate=math.copysign(min(abs(key.rate), rate), key.rate)) for key in keys)
    return one, two


@dataclass(frozen=True)
class Ladder:
    """All speeds, and what it costs to use them.

    Parameters
    ----------
    rungs : tuple of Rung
        From GUIDE to SLEW.
    jitter : Jitter
        By how much presses and events are off their times.
    exchange_s : float
        Seconds from one command to the next: both ways on the line.
    notice_s : float
        Seconds from the end of a motion until the next stage can begin: its event is there, and is read.
    guide : tuple of float, optional
        Motor steps of a guide step of each axis, where its keys do not tell, as the drives go otherwise than usual.

    Raises
    ------
    AwrError
        A unit without GUIDE speed.
    """

    rungs: tuple[Rung, ...]
    jitter: Jitter = field(default_factory=Jitter)
    exchange_s: float = 0.012
    notice_s: float = 0.02
    guide: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        if not self.rungs or not all(map(math.isfinite, self.guide_steps)) or not all(self.guide_steps):
            raise AwrError(
                "no key moves the axes at GUIDE speed: see that the guide rates differ from the drive's, "
                "`clockdrive drive show`"
            )

    def __hash__(self) -> int:
        """That of its parts, found once: tables of times are kept by the ladder, and looked up for every duration."""
        return self._hash

    @cached_property
    def _hash(self) -> int:
        return hash((self.rungs, self.jitter, self.exchange_s, self.notice_s, self.guide))

    @cached_property
    def guide_steps(self) -> tuple[float, float]:
        """Motor steps of a press of 0.1 s at GUIDE speed, of each axis."""
        if self.guide is not None:
            return self.guide
        one, two = (self.rungs[0].slowest(axis) * GUIDE_STEP_S for axis in range(2))
        return one, two

    @property
    def shortest_s(self) -> float:
        """Seconds of the shortest press: its events do not meet the answers of its keys, for all jitter."""
        return max(2.0 * self.exchange_s, _SPREAD * self.jitter.hold_s)

    def lowest(self, axis: int, way: float) -> Rung | None:
        """The slowest speed that moves an axis in the direction of a way."""
        return next((rung for rung in self.rungs if rung.key(axis, way)), None)

    @property
    def top(self) -> Rung:
        """The fastest speed."""
        return self.rungs[-1]

    @property
    def slew_rates(self) -> tuple[float, float]:
        """Steps a second of each axis at the fastest speed, its slower key."""
        return self.top.slowest(0), self.top.slowest(1)

    @property
    def careful_rates(self) -> tuple[float, float]:
        """Steps a second of a slew whose jitter still lets both axes end within two guide steps in 95 of 100 cases.

        Where that is hardly faster than the speed below, the fastest there is: the slew would take far longer, and
        its uncertainty is told.
        """
        one, two = (self._careful(axis) for axis in range(2))
        return one, two

    def _careful(self, axis: int) -> float:
        known, fastest = self.jitter.known_s, self.top.slowest(axis)
        if not known or len(self.rungs) < 2:
            return fastest
        careful = _SLEW_SIGMA * self.guide_steps[axis] / known
        return min(careful, fastest) if careful > _HARDLY_FASTER * self.rungs[-2].slowest(axis) else fastest

    def slewing_at(self, rates: Sequence[float]) -> "Ladder":
        """The same with a slower slew, steps a second of each axis, and without speeds that are faster than it."""
        *lower, top = self.rungs
        kept = [rung for rung in lower if all(rung.slowest(axis) < rates[axis] for axis in range(2))]
        return replace(self, rungs=(*(kept or lower[:1]), top.at_most(rates)))
