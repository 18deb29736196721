"""How fast the keys of a unit go, and how fast its slew may be: the words of the slew, and the ladders of speeds.

The slew leaves nearly all that nobody will know of a goto, so its words in RAM are made as slow as its jitter asks.
"""

from collections.abc import Sequence
from dataclasses import replace

from mounts.awr.ladder import Ladder, exchange_s
from mounts.awr.registers import BY_NAME
from mounts.awr.settings import AwrSettings
from mounts.awr.speeds import Speeds
from mounts.awr.unit import Unit
from mounts.awr.words import Words

_TRIAL_SLEW = 4  # times MOVE, at which a slew is tried out
_SLEWS = (BY_NAME["slew_right"], BY_NAME["slew_up"])  # of axis 1, of axis 2


class Pace:
    """The speeds of one unit.

    Parameters
    ----------
    unit : Unit
        The unit.
    words : Words
        Its words.
    settings : AwrSettings
        The factory's calibration, and how punctual its keys and events are.
    """

    def __init__(self, unit: Unit, words: Words, settings: AwrSettings) -> None:
        self._unit = unit
        self._words = words
        self._settings = settings
        self._ladder: Ladder | None = None
        self._resting: Ladder | None = None

    @property
    def exchange_s(self) -> float:
        """Seconds from one key to the next, by the line as it is known."""
        return exchange_s(self._settings.jitter, self._unit.byte_s, self._unit.delay_s)

    @property
    def ladder(self) -> Ladder:
        """The speeds as steps from slew to a target that is tracked, with a slew as fast as its jitter allows."""
        if self._ladder is None:
            self._ladder = self._careful(self._words.usual)[0]
        return self._ladder

    @property
    def resting_ladder(self) -> Ladder:
        """The same while both drives are off."""
        if self._resting is None:
            self._resting = self._careful(self._words.resting)[0]
        return self._resting

    @property
    def present(self) -> Ladder:
        """The speeds by the words in force."""
        return self._words.speeds.ladder(self.exchange_s)

    def forget(self) -> None:
        """The words are others than they were."""
        self._ladder = self._resting = None

    def as_usual(self) -> None:
        """Have a slew in RAM as fast as its jitter allows while axis 1 tracks."""
        self._slow_down(self._careful(self._words.usual)[1])

    def no_faster(self, rates: Sequence[float | None]) -> Ladder:
        """Have a slew in RAM as fast as its jitter allows, and no faster than `rates` beyond the drives in force."""
        full = self._words.full
        careful = full.ladder(self.exchange_s).careful_rates
        ladder, slews = self._slowed(
            full, [most if rate is None else min(most, rate) for most, rate in zip(careful, rates, strict=True)]
        )
        self._slow_down(slews)
        return ladder

    def on_trial(self) -> Ladder:
        """Have a slew in RAM that is safe to be tried out; return the speeds."""
        most = _TRIAL_SLEW * self._words.lasting[BY_NAME["move_right"].address]
        self._slow_down({each.address: min(self._words.lasting[each.address], most) for each in _SLEWS})
        return self.present

    def _careful(self, speeds: Speeds) -> tuple[Ladder, dict[int, int]]:
        return self._slowed(speeds, speeds.ladder(self.exchange_s).careful_rates)

    def _slowed(self, speeds: Speeds, rates: Sequence[float]) -> tuple[Ladder, dict[int, int]]:
        """Speeds whose slew goes no faster than `rates` beyond the drives, steps a second, and the words for it."""
        full, words = speeds.ladder(self.exchange_s), {}
        for register, rate, fastest, drive in zip(_SLEWS, rates, full.slew_rates, speeds.drives, strict=True):
            value = lasting = self._words.lasting[register.address]
            if rate < fastest:
                value = max(1, min(lasting, round((rate - abs(drive)) / self._settings.frequency_unit)))
            words[register.address] = value
        names = {rung.speed for rung in full.slewing_at(rates).rungs}
        there = replace(speeds, ram={**speeds.ram, **words}).ladder(self.exchange_s)
        return replace(there, rungs=tuple(rung for rung in there.rungs if rung.speed in names)), words

    def _slow_down(self, slews: dict[int, int]) -> None:
        for register in _SLEWS:
            if self._words.ram.get(register.address) != slews[register.address]:
                self._words.soft_write(register, slews[register.address])
