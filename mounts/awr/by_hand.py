"""A unit in a person's hands: words in RAM, committed or discarded; relays; a key for a moment.

What else stands in RAM, drive rates, a slower slew and the cookie of the driver, is none of a person's soft writes:
all of RAM is discarded before a commit and what a person wrote is written anew, so that only that is kept for good,
also by a unit that does not tell what its RAM holds.
"""

from collections.abc import Callable, Mapping

from mounts.awr.cascade import Press, Stage
from mounts.awr.commands import Speed
from mounts.awr.drive_rates import DriveRates
from mounts.awr.errors import AwrError
from mounts.awr.holding import Holding, Trial
from mounts.awr.ladder import Ladder
from mounts.awr.registers import BY_ADDRESS, Register, checked
from mounts.awr.unit import Unit
from mounts.awr.words import Words

LONGEST_S = 2.0  # in which nothing else is heard, no stop either
KEYS = {"LEFT": (0, 1), "RIGHT": (0, -1), "UP": (1, 1), "DOWN": (1, -1)}


class ByHand:
    """What a person may do to a unit at rest.

    Parameters
    ----------
    unit : Unit
        The unit.
    words : Words
        Its words.
    keys : Holding
        Its keys.
    drives : DriveRates
        Its drives, which any word of theirs moves otherwise.
    """

    def __init__(self, unit: Unit, words: Words, keys: Holding, drives: DriveRates) -> None:
        self._unit = unit
        self._words = words
        self._keys = keys
        self._drives = drives
        self._written: dict[int, int] = {}

    @property
    def written(self) -> Mapping[int, int]:
        """What a person wrote since the last commit, by address."""
        return dict(self._written)

    def recall(self, written: Mapping[int, int]) -> None:
        """Take for a person's what an earlier program was told to write, as far as RAM still holds it."""
        self._written = {a: v for a, v in written.items() if a in BY_ADDRESS and self._words.ram.get(a) == v}

    def forget(self) -> None:
        """RAM was lost."""
        self._written.clear()

    def set_word(self, register: Register, value: int) -> None:
        """Write a word in RAM.

        Raises
        ------
        AwrError, DriveRefused, TransportError
            This register is never written, or not so; the unit does not hold it.
        """
        if register.name.startswith("drive_ra"):
            raise AwrError(
                f"{register.name}: all rates are reckoned from drive_ra as the factory set it, so it is not written "
                "by hand; `track` and `rates` go at any rate by soft writes of their own"
            )
        self._drives.put(register, checked(register, value))
        self._written[register.address] = value

    def commit(self) -> tuple[str, ...]:
        """Have what a person wrote kept for good; return the names of those words. Nothing else is written.

        Raises
        ------
        AwrError
            Nothing was written.
        DriveRefused, TransportError
            The unit does not do it, or does not say that it has.
        """
        wanted = {a: v for a, v in self._written.items() if self._words.lasting.get(a) != v}
        if not wanted:
            raise AwrError("nothing was soft-written since the last commit: `drive set NAME VALUE` first")
        before = self._words.changed
        try:
            self._drives.discard()
            for address, value in wanted.items():
                self._drives.put(BY_ADDRESS[address], value)
            self._unit.commit()
        finally:
            self._words.read()
            for address, value in before.items():
                if self._words.lasting[address] != value or self._words.ram[address] != value:
                    self._drives.put(BY_ADDRESS[address], value)
        self._written.clear()
        return tuple(BY_ADDRESS[address].name for address in wanted)

    def discard(self) -> None:
        """Have all soft writes forgotten, those of the driver too.

        Raises
        ------
        DriveRefused, TransportError
            The unit does not do it.
        """
        self._drives.discard()
        self._written.clear()

    def relay(self, number: int, *, on: bool) -> None:
        """Switch a relay.

        Raises
        ------
        AwrError, DriveRefused, TransportError
            There is none; the unit does not do it.
        """
        self._unit.relay(number, on=on)

    def trial(self, name: str, speed: Speed, seconds: float, ladder: Ladder, begin: Callable[[], None]) -> Trial:
        """Hold a key whose speed or ramps are to be found out; return how long it was held and the motion lasted.

        Raises
        ------
        AwrError, DriveError, TransportError
            As for `press`; no motion was told.
        """
        self._keys.trials = []
        try:
            self.press(name, speed, seconds, ladder, begin)
            if not self._keys.trials:
                raise AwrError(f"no motion was told of {name} at {speed} speed")
            return self._keys.trials[0]
        finally:
            self._keys.trials = None

    def press(self, name: str, speed: Speed, seconds: float, ladder: Ladder, begin: Callable[[], None]) -> None:
        """Hold a key for a time.

        Raises
        ------
        AwrError
            There is no such key or speed, or not for so long; the unit did not hear it.
        DriveError, TransportError
            There is no dead-man process, or the unit does not obey.
        """
        axis, press = self.press_of(name, speed, seconds, ladder)
        presses = (press, None) if axis == 0 else (None, press)
        begin()
        self._keys.begin(Stage(speed, presses, (0.0, 0.0), seconds, (0.0, 0.0), (0.0, 0.0)))
        while self._keys.busy:
            self._keys.look(LONGEST_S + 10.0)
        if self._keys.unheard is not None:
            raise AwrError(f"the unit did not hear {name}, so nothing was held; check the line, then press it again")

    @staticmethod
    def press_of(name: str, speed: Speed, seconds: float, ladder: Ladder) -> tuple[int, Press]:
        """The axis of a key, 0 or 1, and the press of it for a time.

        Raises
        ------
        AwrError
            There is no such key or speed, or not for so long.
        """
        if name not in KEYS:
            raise AwrError(f"no key {name}: there are {', '.join(KEYS)}")
        if not 0.0 < seconds <= LONGEST_S:
            raise AwrError(f"a key for {seconds:g} s: above 0, at most {LONGEST_S:g} s by hand; `jog` moves farther")
        axis, sense = KEYS[name]
        rungs = {rung.speed: rung for rung in ladder.rungs}
        if speed not in rungs:
            raise AwrError(f"no speed {speed}: there are {', '.join(rungs)}")
        key = rungs[speed].key(axis, sense)
        if key is None:
            raise AwrError(
                f"{name} at {speed} speed does not move axis {axis + 1} that way while its drive is as it is"
            )
        return axis, Press(key, seconds)
