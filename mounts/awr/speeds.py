"""What the words of a unit mean in steps a second, by the one number of the factory's sheet.

The drive rate of axis 1, as it stands in the non-volatile memory, is the sidereal rate. All other rates follow by the
ratio of counts times postscaler (A); frequencies and accelerations have units of their own.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

from mounts.awr.commands import Speed
from mounts.awr.errors import AwrError
from mounts.awr.ladder import GUIDE_STEP_S, Ladder, Rung
from mounts.awr.registers import BY_NAME, Flags
from mounts.awr.settings import AwrSettings

_MOST_COUNTS, _LEAST_COUNTS, _MOST_POSTSCALER, _HALF_POSTSCALER = 0xFFFF, 256, 0xFF, 0x40
_RATES = {
    ("guide", 0): ("guide_left", "guide_right"),
    ("guide", 1): ("guide_up", "guide_up"),
    ("centre", 0): ("centre_left", "centre_right"),
    ("centre", 1): ("centre_up", "centre_up"),
}
_FREQUENCIES = {
    ("move", 0): ("move_left", "move_right"),
    ("move", 1): ("move_up", "move_up"),
    ("slew", 0): ("slew_right", "slew_right"),
    ("slew", 1): ("slew_up", "slew_up"),
}
DRIVES = ("drive_ra", "drive_dec")
ORDER: tuple[Speed, ...] = ("guide", "centre", "move", "slew")


class RateWords(NamedTuple):
    """Counts and flags of a rate."""

    counts: int
    flags: Flags


@dataclass(frozen=True)
class Speeds:
    """All speeds of one unit.

    Parameters
    ----------
    settings : AwrSettings
        The factory's calibration.
    lasting : mapping
        The non-volatile words by address.
    ram : mapping
        The words in force.

    Raises
    ------
    AwrError
        The sidereal rate stands nowhere, as its register is zero.
    """

    settings: AwrSettings
    lasting: Mapping[int, int]
    ram: Mapping[int, int]

    def __post_init__(self) -> None:
        if not self.lasting.get(BY_NAME["drive_ra_counts"].address):
            raise AwrError(
                "drive_ra (01) holds no counts, and all rates are reckoned from it: write those of the factory sheet"
            )

    @property
    def per_count(self) -> float:
        """Steps a second times counts times postscaler, the same for all rates."""
        counts, flags = self._words("drive_ra", self.lasting)
        return self.settings.sidereal_steps_per_s * counts * self.settings.divides_by(flags.postscaler)

    def rate(self, name: str) -> float:
        """Steps a second of a rate's words in force, signed; 0 where it is off.

        Raises
        ------
        AwrError
            Its counts are none.
        """
        counts, flags = self._words(name, self.ram)
        if not flags.enable:
            return 0.0
        if not counts:
            raise AwrError(f"{name} holds no counts: the unit cannot divide by them; `drive set {name}_counts`")
        return (
            self.per_count / (counts * self.settings.divides_by(flags.postscaler)) * (1.0 if flags.positive else -1.0)
        )

    def words_for(self, rate: float, postscaler: int) -> RateWords:
        """The words whose rate is nearest to one, steps a second, at a postscaler where it can be had.

        A rate slower than any is none: the axis is switched off.
        """
        flags, divides_by = Flags(enable=True, positive=rate > 0.0, postscaler=postscaler), self.settings.divides_by
        wanted = self.per_count / abs(rate) if rate else math.inf
        if wanted > _MOST_COUNTS * divides_by(_MOST_POSTSCALER):
            return RateWords(_MOST_COUNTS, flags._replace(enable=False))
        usual = scale = divides_by(postscaler)
        if not _LEAST_COUNTS <= wanted / scale <= _MOST_COUNTS:
            scale = min(divides_by(_MOST_POSTSCALER), max(1, math.ceil(wanted / _MOST_COUNTS)))
        counts = min(_MOST_COUNTS, max(_LEAST_COUNTS, round(wanted / scale)))
        other = scale if self.settings.postscaler == "times" else scale - 1
        return RateWords(counts, flags._replace(postscaler=postscaler if scale == usual else other))

    def tried_out(self, axis: int) -> RateWords:
        """Words of a drive that make about the sidereal rate at a postscaler far from the usual one."""
        usual = self._words(DRIVES[axis], self.lasting).flags.postscaler
        flags = Flags(enable=True, positive=True, postscaler=_MOST_POSTSCALER if usual < _HALF_POSTSCALER else 1)
        counts = self.per_count / self.settings.sidereal_steps_per_s / self.settings.divides_by(flags.postscaler)
        return RateWords(min(_MOST_COUNTS, max(_LEAST_COUNTS, round(counts))), flags)

    def unsure(self, words: RateWords) -> float:
        """Fraction by which the rate of such words is another, should the postscaler be read the other way."""
        rate = self.of(words)
        return abs(replace(self, settings=self.settings.otherwise).of(words) / rate - 1.0) if rate else 0.0

    def of(self, words: RateWords) -> float:
        """Steps a second of such words."""
        if not words.flags.enable:
            return 0.0
        rate = self.per_count / (words.counts * self.settings.divides_by(words.flags.postscaler))
        return rate if words.flags.positive else -rate

    def apart(self, words: RateWords) -> float:
        """Steps a second from the rate of such words to the next faster one: what a host dithers between."""
        rate = abs(self.of(words._replace(flags=words.flags._replace(enable=True))))
        return rate / (words.counts - 1) if words.counts > 1 else rate

    def drive_words(self, axis: int) -> RateWords:
        """The words in force of a drive."""
        return self._words(DRIVES[axis], self.ram)

    @property
    def drives(self) -> tuple[float, float]:
        """Steps a second with which both axes go when no key is pressed."""
        return self.rate("drive_ra"), self.rate("drive_dec")

    @property
    def accelerations(self) -> tuple[float, float]:
        """Steps a second squared of both axes."""
        one, two = (self._word(f"max_accel_{axis}") * self.settings.acceleration_unit for axis in ("ra", "dec"))
        return one, two

    def motor(self, speed: Speed, axis: int) -> tuple[float, float]:
        """Steps a second of a motor with the key to larger and with that to smaller counts."""
        if (speed, axis) in _FREQUENCIES:
            up, down = (self._word(name) * self.settings.frequency_unit for name in _FREQUENCIES[speed, axis])
            return up, -down
        up, down = (self.rate(name) for name in _RATES[speed, axis])
        if axis == 1:
            return up, -down
        below = self.rate("drive_ra") if self.settings.rate_reference == "sky" else 0.0
        return up + below, down + below

    def contradiction(self) -> str:
        """What the words of GUIDE say against the configured reference of rates; empty where they agree with it.

        LEFT must lead axis 1 to larger counts than its drive does, RIGHT to smaller ones: counted from the motor at
        more and at less than the drive's rate, on the sky one way and the other.
        """
        left, right = (self.rate(name) for name in _RATES["guide", 0])
        drive, configured = self.rate("drive_ra"), self.settings.rate_reference
        fits = {"motor": left > drive > right, "sky": left > 0.0 > right}
        if fits[configured] or not (left and right and drive):
            return ""
        other = "sky" if configured == "motor" else "motor"
        remedy = (
            f'set [drive] rate_reference = "{other}"' if fits[other] else "see `drive show` and the factory sheet"
        )
        return (
            f"LEFT at GUIDE speed goes {left:+.4g} steps/s and RIGHT {right:+.4g}, the drive {drive:+.4g}: with "
            f'rate_reference = "{configured}" they would not move axis 1 both ways; {remedy}'
        )

    def ladder(self, exchange_s: float) -> Ladder:
        """The speeds as steps from slew to target.

        Raises
        ------
        AwrError
            No key moves an axis at GUIDE speed, or a register is zero.
        """
        drives, accelerations = self.drives, self.accelerations
        if not all(accelerations):
            raise AwrError("max_accel_ra or max_accel_dec (16, 17) is 0: no key moves; write the factory's words")
        rungs = [
            Rung.of(speed, [self.motor(speed, axis) for axis in (0, 1)], drives, accelerations) for speed in ORDER
        ]
        usual = Speeds(self.settings, self.lasting, self.lasting)
        guide = Rung.of("guide", [usual.motor("guide", axis) for axis in (0, 1)], usual.drives, accelerations)
        steps = guide.slowest(0) * GUIDE_STEP_S, guide.slowest(1) * GUIDE_STEP_S
        return Ladder(tuple(rungs), self.settings.jitter, exchange_s, guide=steps)

    def _words(self, name: str, words: Mapping[int, int]) -> RateWords:
        counts, flags = (words.get(BY_NAME[f"{name}_{part}"].address, 0) for part in ("counts", "flags"))
        return RateWords(counts, Flags.of(flags))

    def _word(self, name: str) -> int:
        return self.ram.get(BY_NAME[name].address, 0)
