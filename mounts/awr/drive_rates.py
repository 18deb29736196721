"""The drives below the keys: both axes go on at rates of their registers, which are soft-written for the target.

A write whose answer is lost leaves it open which rate is in force; the words are read again then, and how far the
axis may have gone meanwhile is added to its uncertainty.
"""

from mounts.awr.axis import AwrAxis
from mounts.awr.registers import BY_NAME, Flags
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
    """

    def __init__(self, unit: Unit, words: Words, axes: tuple[AwrAxis, AwrAxis]) -> None:
        self._unit = unit
        self._words = words
        self._axes = axes
        self._doubts: dict[int, tuple[float, list[float]]] = {}  # since when by axis, and rates that may be in force

    @property
    def in_doubt(self) -> bool:
        """Whether nobody knows which rate is in force."""
        return bool(self._doubts)

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
        for index in (0, 1):
            flags = Flags.of(self._words.drive_flags(index))._replace(enable=False)
            counts = self._words.ram[BY_NAME[f"{DRIVES[index]}_counts"].address]
            self._write(index, RateWords(counts, flags))

    def as_the_words_say(self) -> None:
        """The words are others than they were: both axes go on at what they say now."""
        now = self._unit.now()
        for axis, rate in zip(self._axes, self._words.speeds.drives, strict=True):
            axis.drives_at(rate, now)

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
            axis.drives_at(actual, now)
            del self._doubts[index]

    def _write(self, index: int, words: RateWords) -> None:
        axis, asked = self._axes[index], self._unit.now()
        new = self._words.speeds.of(words)
        try:
            for went, since in self._words.drive_at(index, words):
                axis.drives_at(self._words.speeds.of(went), since)
        except (TransportError, DriveError):
            self._doubts.setdefault(index, (asked, []))[1].extend((axis.rate, new))
            raise
