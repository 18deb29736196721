"""The drives below the keys: both axes go on at rates of their registers, which are soft-written for the target.

A write whose answer is lost leaves it open which rate is in force; the words are read again then, and how far the
axis may have gone meanwhile is added to its uncertainty.
"""

import math
from collections.abc import Sequence

from mounts.awr.axis import AwrAxis
from mounts.awr.beside import Attended
from mounts.awr.proof import Proof
from mounts.awr.registers import BY_NAME, Flags, Register
from mounts.awr.speeds import DRIVES, RateWords
from mounts.awr.unit import Unit
from mounts.awr.words import Words
from mounts.errors import DriveError
from transports.errors import TransportError


class DriveRates:
    """The drives of both axes.

    Parameters
    ----------
    unit : Unit
        The unit.
    words : Words
        Its words.
    axes : tuple of AwrAxis
        What the drives move.
    beside : Attended
        Who stands beside a drive that goes at a rate of ours.
    proof : Proof
        Whether rates are known at any postscaler.
    """

    def __init__(
        self, unit: Unit, words: Words, axes: tuple[AwrAxis, AwrAxis], beside: Attended, proof: Proof
    ) -> None:
        self._unit = unit
        self._words = words
        self._axes = axes
        self._beside = beside
        self._proof = proof
        self._doubts: dict[int, tuple[float, list[float]]] = {}  # since when by axis, and rates that may be in force
        self._held = False  # by the override: neither goes, whatever the words say
        self.resting = False
        """Whether they are to be off, not only slow."""

    @property
    def in_doubt(self) -> bool:
        """Whether nobody knows which rate is in force."""
        return bool(self._doubts)

    def go(self, rates: Sequence[float], *, resting: bool = False) -> None:
        """Have both drives go at the rates nearest to some, steps a second; `resting`: they are none.

        Raises
        ------
        DriveRefused, TransportError
            As for `drive_at`.
        """
        self.resting = resting
        for index, rate in enumerate(rates):
            self.drive_at(index, rate)

    def drive_at(self, index: int, rate: float) -> None:
        """Have a drive go at the rate nearest to one, steps a second, that its words can make.

        Raises
        ------
        DriveRefused, TransportError
            The unit does not take it, or does not answer.
        """
        flags = Flags.of(self._words.lasting[BY_NAME[f"{DRIVES[index]}_flags"].address])
        self._write(index, self._words.speeds.words_for(rate, flags.postscaler))

    def rest(self) -> None:
        """Switch both drives off.

        Raises
        ------
        DriveRefused, TransportError
            As for `drive_at`.
        """
        self.resting = True
        for index in (0, 1):
            flags = Flags.of(self._words.drive_flags(index))._replace(enable=False)
            counts = self._words.ram[BY_NAME[f"{DRIVES[index]}_counts"].address]
            self._write(index, RateWords(counts, flags))

    def as_the_words_say(self, time: float | None = None) -> None:
        """The words are others than they were: both axes go on at what they say from a time on, else from now."""
        since = self._unit.now() if time is None else time
        for axis, play, rate in zip(self._axes, self._words.plays, self._words.speeds.drives, strict=True):
            axis.has(play, since)
            self._goes(axis, rate, since)

    def held(self, time: float, *, stopped: bool) -> None:
        """The override stops both axes, or lets them go on as the words say."""
        if stopped != self._held:
            self._held = stopped
            self.as_the_words_say(time)

    def put(self, register: Register, value: int) -> None:
        """Write any word in RAM; where it is one of a drive, its axis goes on at what it says then.

        Raises
        ------
        AwrError, DriveRefused, TransportError
            As for `Words.soft_write`.
        """
        name = next((drive for drive in DRIVES if register.name.startswith(f"{drive}_")), None)
        if name is None:
            self._words.soft_write(register, value)
            return
        index, asked = DRIVES.index(name), self._unit.now()
        counts, flags = self._words.speeds.drive_words(index)
        new = self._words.speeds.of(
            RateWords(value, flags) if register.is_counts else RateWords(counts, Flags.of(value))
        )
        self._before(new)
        try:
            heard = self._words.soft_write(register, value)
        except (TransportError, DriveError):
            self._doubt(index, asked, new)
            raise
        self._goes(self._axes[index], self._words.speeds.drives[index], heard, asked)
        self._after()

    def discard(self) -> None:
        """Have all soft writes forgotten: both axes go on at what the non-volatile words say.

        Raises
        ------
        DriveRefused, TransportError
            The unit does not do it, or does not answer.
        """
        asked = self._unit.now()
        try:
            heard = self._unit.discard()
        except (TransportError, DriveError):
            for index, rate in enumerate(self._words.usual.drives):
                self._doubt(index, asked, rate)
            raise
        self._words.ram = dict(self._words.lasting)
        for axis, rate in zip(self._axes, self._words.speeds.drives, strict=True):
            self._goes(axis, rate, heard, asked)

    def resolve(self) -> None:
        """Read the words of drives that are in doubt.

        Raises
        ------
        TransportError
            The unit does not answer.
        """
        for index, (since, rates) in list(self._doubts.items()):
            axis = self._axes[index]
            self._words.read_drive(index)
            actual, now = self._words.speeds.drives[index], self._unit.now()
            spread = (max(*rates, actual) - min(*rates, actual)) * (now - since)
            here = axis.at(now)
            axis.known(here.counts, now, here.uncertainty + spread)
            self._goes(axis, actual, now)
            del self._doubts[index]
        self._after()

    def _write(self, index: int, words: RateWords) -> None:
        axis, asked = self._axes[index], self._unit.now()
        new = self._words.speeds.of(words)
        self._before(new)
        try:
            for went, since in self._words.drive_at(index, words):
                self._goes(axis, self._words.speeds.of(went), since, asked)
                asked = since
        except (TransportError, DriveError):
            self._doubt(index, asked, new)
            raise
        self._after()

    def _before(self, rate: float) -> None:
        """Nothing ends a drive when this program is gone but who stands beside it."""
        if rate:
            self._beside.drives_go()

    def _after(self) -> None:
        if not self._doubts and not any(self._words.speeds.drives):
            self._beside.drives_rest()

    def _doubt(self, index: int, since: float, new: float) -> None:
        self._doubts.setdefault(index, (since, []))[1].extend((self._axes[index].rate, new))

    def _goes(self, axis: AwrAxis, rate: float, time: float, asked: float = math.inf) -> None:
        """An axis goes at a rate from a time on; where that was asked for more than once, maybe since the first."""
        going = 0.0 if self._held else rate
        late = time - asked
        if late > self._unit.timeout_s + 2.0 * self._unit.delay_s and going != axis.rate:
            here = axis.at(time)
            axis.known(here.counts, time, here.uncertainty + abs(going - axis.rate) * late)
        unsure = 0.0 if self._proof.scaled else self._words.speeds.unsure(self._words.speeds.drive_words(axis.index))
        axis.drives_at(going, time, unsure if going else 0.0)
