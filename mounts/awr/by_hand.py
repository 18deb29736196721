"""A unit in a person's hands: words in RAM, committed or discarded; relays; a key for a moment.

What else stands in RAM, drive rates, a slower slew and the cookie of the driver, is none of a person's soft writes:
all of RAM is discarded before a commit and what a person wrote is written anew, so that only that is kept for good,
also by a unit that does not tell what its RAM holds.
"""

import math
from collections.abc import Mapping
from typing import cast

from mounts.awr.cascade import Press, Stage
from mounts.awr.commands import Speed
from mounts.awr.errors import AwrError
from mounts.awr.holding import Trial
from mounts.awr.ladder import Ladder
from mounts.awr.parts import Parts
from mounts.awr.presence import Presence
from mounts.awr.registers import BY_ADDRESS, by_name, checked, shown

LONGEST_S = 2.0  # in which nothing else is heard, no stop either
KEYS = {"LEFT": (0, 1), "RIGHT": (0, -1), "UP": (1, 1), "DOWN": (1, -1)}


class ByHand:
    """What a person may do to a unit at rest.

    Parameters
    ----------
    parts : Parts
        The unit.
    presence : Presence
        What it is known again by.
    """

    def __init__(self, parts: Parts, presence: Presence) -> None:
        self._parts = parts
        self._presence = presence
        self._written: dict[int, int] = {}

    @property
    def written(self) -> Mapping[int, int]:
        """What a person wrote since the last commit, by address."""
        return dict(self._written)

    def recall(self, written: Mapping[int, int]) -> None:
        """Take for a person's what an earlier program was told to write, as far as RAM still holds it."""
        ram = self._parts.words.ram
        self._written = {a: v for a, v in written.items() if a in BY_ADDRESS and ram.get(a) == v}

    def forget(self) -> None:
        """RAM was lost."""
        self._written.clear()

    # Words -----------------------------------------------------------------------------------------------------

    def soft_write(self, name: str, value: int) -> str:
        """Write a word in RAM; return what it was, as a person reads it.

        Raises
        ------
        AwrError, DriveRefused, TransportError
            There is no such register, or it is never written so; the unit does not hold it.
        """
        register, parts = by_name(name), self._parts
        if register.name.startswith("drive_ra"):
            raise AwrError(
                f"{register.name}: all rates are reckoned from drive_ra as the factory set it, so it is not written "
                "by hand; `track` and `rates` go at any rate by soft writes of their own"
            )
        before = shown(register, parts.words.ram.get(register.address, 0))
        word = checked(register, value)
        if register.kind == "bits" and word != parts.words.ram.get(register.address):
            self._presence.turned_round()
        parts.drives.put(register, word)
        self._written[register.address] = value
        self._presence.know_again()
        self._words_changed()
        parts.remember()
        return before

    def commit(self) -> tuple[str, ...]:
        """Have what a person wrote kept for good; return the names of those words. Nothing else is written.

        Raises
        ------
        AwrError
            Nothing was written.
        DriveRefused, TransportError
            The unit does not do it, or does not say that it has.
        """
        try:
            return self._commit()
        finally:
            self._parts.pace.forget()
            self._parts.remember()

    def _commit(self) -> tuple[str, ...]:
        words, drives = self._parts.words, self._parts.drives
        wanted = {a: v for a, v in self._written.items() if words.lasting.get(a) != v}
        if not wanted:
            raise AwrError("nothing was soft-written since the last commit: `drive set NAME VALUE` first")
        before = words.changed
        if words.are_turned:  # and are not for a moment, in which the drives may go
            self._presence.turned_round()
        self._presence.discarded = True
        try:
            drives.discard()
            for address, value in wanted.items():
                drives.put(BY_ADDRESS[address], value)
            self._parts.unit.commit()
        finally:
            words.read()
            for address, value in before.items():
                if words.lasting[address] != value or words.ram[address] != value:
                    drives.put(BY_ADDRESS[address], value)
        self._presence.know_again()
        self._presence.discarded = False
        self._written.clear()
        return tuple(BY_ADDRESS[address].name for address in wanted)

    def discard(self) -> None:
        """Have soft writes forgotten, those of the driver too; drives that were off are switched off again at once.

        Raises
        ------
        DriveRefused, TransportError
            The unit does not do it.
        """
        parts = self._parts
        if parts.words.are_turned:
            self._presence.turned_round()
        rested = parts.drives.resting or not any(axis.rate for axis in parts.axes)
        self._presence.discarded = True
        parts.drives.discard()
        self._written.clear()
        self._words_changed()
        if rested:
            parts.drives.rest()
        parts.supervision.rates_are_sound()
        self._presence.bake()
        parts.remember()

    def differing(self) -> dict[str, tuple[int, int]]:
        """Words that RAM holds otherwise than the non-volatile memory: this and that.

        Raises
        ------
        TransportError
            The unit does not answer.
        """
        self._parts.words.read()
        return self._parts.words.differing()

    def _words_changed(self) -> None:
        self._parts.pace.forget()
        self._parts.drives.as_the_words_say()

    def switch_relay(self, number: int, *, on: bool) -> None:
        """Switch a relay.

        Raises
        ------
        AwrError, DriveRefused, TransportError
            There is none; the unit does not do it.
        """
        self._parts.unit.relay(number, on=on)
        supervision, bit = self._parts.supervision, 1 << number - 1
        others = (supervision.relays or 0) & ~bit
        supervision.switched(others | bit if on else others)

    # Keys ------------------------------------------------------------------------------------------------------

    def way_of(self, name: str, speed: str, seconds: float) -> tuple[float, float]:
        """By how many steps a key for a time moves either axis, its drive's way apart.

        Raises
        ------
        AwrError
            As for `press`.
        """
        axis, press = press_of(name, cast("Speed", speed), seconds, self._parts.pace.present)
        steps = press.made(press.duration)
        return (steps, 0.0) if axis == 0 else (0.0, steps)

    def press(self, name: str, speed: str, seconds: float) -> None:
        """Hold a key for a time.

        Raises
        ------
        AwrError
            There is no such key or speed, or not for so long; the unit did not hear it.
        DriveError, TransportError
            It leads farther than keys were seen to lead; there is no dead-man process, or the unit does not obey.
        """
        self._parts.proof.require(self.way_of(name, speed, seconds))
        self._press(name, cast("Speed", speed), seconds, self._parts.pace.present)

    def try_drive(self) -> tuple[float, float, float]:
        """Have the drive of axis 2 go at a postscaler far from the usual one, to find out what that does.

        Returns
        -------
        rate, fraction, time : float
            Steps a second, by which fraction they are others should it be read the other way, and since when.

        Raises
        ------
        DriveRefused, TransportError
            The unit does not take it, or does not answer.
        """
        parts = self._parts
        words = parts.words.speeds.tried_out(1)
        parts.drives.go_by(1, words)
        return parts.words.speeds.of(words), parts.words.speeds.unsure(words), parts.unit.now()

    def end_drive(self) -> float:
        """Switch both drives off; return the POSIX time.

        Raises
        ------
        DriveRefused, TransportError
            As for `try_drive`.
        """
        self._parts.drives.rest()
        return self._parts.unit.now()

    def trial(self, name: str, speed: str, seconds: float, *, tracking: bool = False) -> tuple[Trial, float]:
        """Hold a key to find out what it does, at rest or while axis 1 tracks; return it, and how long it tracked.

        Raises
        ------
        AwrError, DriveError, TransportError
            As for `press`; no motion was told.
        """
        parts = self._parts
        began = parts.unit.now()
        if tracking:
            parts.drives.drive_at(0, math.copysign(parts.settings.sidereal_steps_per_s, parts.words.tracks))
            began = parts.unit.now()
        parts.keys.trials = []
        try:
            self._press(name, cast("Speed", speed), seconds, parts.pace.on_trial())
            if not parts.keys.trials:
                raise AwrError(f"no motion was told of {name} at {speed} speed")
            trial = parts.keys.trials[0]
        finally:
            parts.keys.trials = None
            parts.drives.rest()
        return trial, parts.unit.now() - began if tracking else 0.0

    def _press(self, name: str, speed: Speed, seconds: float, ladder: Ladder) -> None:
        axis, press = press_of(name, speed, seconds, ladder)
        presses, keys = (press, None) if axis == 0 else (None, press), self._parts.keys
        self._parts.remember()
        keys.choose_anew()
        keys.begin(Stage(speed, presses, (0.0, 0.0), seconds, (0.0, 0.0), (0.0, 0.0)))
        while keys.busy:
            keys.look(LONGEST_S + 10.0)
        if keys.unheard is not None:
            raise AwrError(f"the unit did not hear {name}, so nothing was held; check the line, then press it again")


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
        raise AwrError(f"{name} at {speed} speed does not move axis {axis + 1} that way while its drive is as it is")
    return axis, Press(key, seconds)
