"""The words of a unit as its driver keeps them: the non-volatile ones, those in RAM, and who wrote which last.

Only RAM is written, and what was written is read back where the unit tells it. A word in RAM that no use is made of
else, one unit of the acceleration of axis 2, is the cookie: it is lost with the power.
"""

import math
from collections.abc import Mapping
from dataclasses import replace

from mounts.awr.play import Play
from mounts.awr.registers import BY_ADDRESS, BY_NAME, RAM, REGISTERS, WITH_BACKLASH, Flags, Register, shown
from mounts.awr.settings import AwrSettings
from mounts.awr.speeds import DRIVES, RateWords, Speeds
from mounts.awr.unit import Unit
from mounts.errors import DriveRefused

_COOKIE = BY_NAME["max_accel_dec"]
_TRIES = 3
BACKLASHES = ("ra_backlash", "dec_backlash")
_DIRECTIONS = BY_NAME["directions"].address
_DRIVES, _SLEWS = (0x01, 0x02, 0x03, 0x04), (0x14, 0x15)


class Words:
    """All words of one unit.

    Parameters
    ----------
    unit : Unit
        The unit.
    settings : AwrSettings
        The factory's calibration.
    """

    def __init__(self, unit: Unit, settings: AwrSettings) -> None:
        self._unit = unit
        self._settings = settings
        self.lasting: dict[int, int] = {}
        self.ram: dict[int, int] = {}
        self.tells_ram = True
        """Whether the unit tells what its RAM holds."""
        self.overwritten: dict[str, tuple[int, int]] = {}
        """Non-volatile words that a damaged command wrote, by name: what they are, and what they were."""
        self.last_rate: Register | None = None
        """The rate register that was written last."""

    def read(self) -> None:
        """Read all words, the non-volatile ones and those in RAM.

        Raises
        ------
        NoAnswer, LinkError
            The unit does not answer.
        """
        lasting = self._unit.read_all()
        ram, self.tells_ram = dict(lasting), self._settings.reads_ram
        if not self.tells_ram:
            ram |= self._known_in_ram()
        for address in (register.address for register in REGISTERS if register.writable and self.tells_ram):
            value = self._in_ram(address, self.ram.get(address, lasting.get(address)))
            if value is None:
                self.tells_ram = False
                ram |= self._known_in_ram()
                break
            ram[address] = value
        self.lasting, self.ram = lasting, ram

    def _known_in_ram(self) -> dict[int, int]:
        """What was written there last, as far as a program remembers."""
        return {a: v for a, v in self.ram.items() if a in BY_ADDRESS and BY_ADDRESS[a].writable}

    def _in_ram(self, address: int, expected: int | None) -> int | None:
        """A word in RAM; one that is not as expected is believed once it was told twice running."""
        value, before = self._unit.read(address | RAM), expected
        for _ in range(_TRIES):
            if value is None or value == before:
                break
            before, value = value, self._unit.read(address | RAM)
        return value

    def insist(self) -> None:
        """Write all words anew that a program may have left in RAM, where the unit does not tell whether it has.

        Raises
        ------
        DriveRefused, NoAnswer, LinkError
            As for `soft_write`.
        """
        if not self.tells_ram:
            for address in sorted({*_DRIVES, *_SLEWS, *self.changed}):
                self.soft_write(BY_ADDRESS[address], self.ram[address])

    @property
    def undivided(self) -> Register | None:
        """The rate register that the unit cannot divide by: one below the least, else the one written last."""
        rates = (register for register in REGISTERS if register.is_counts and register.address in self.ram)
        return next((each for each in rates if self.ram[each.address] < each.lowest), self.last_rate)

    @property
    def changed(self) -> dict[int, int]:
        """The words that RAM holds otherwise than the non-volatile memory, by address."""
        return {a: v for a, v in self.ram.items() if self.lasting.get(a) != v}

    @property
    def speeds(self) -> Speeds:
        """What they mean.

        Raises
        ------
        AwrError
            The sidereal rate stands nowhere.
        """
        return Speeds(self._settings, self.lasting, self.ram)

    @property
    def plays(self) -> tuple[Play, Play]:
        """What is left of the play of each axis besides the blips by which the unit takes it up."""
        settings = self._settings
        one, two = (
            Play(0.0 if play is None else play - blip, sigma, blip)
            for play, blip, sigma in zip(settings.plays, self.taken_up, settings.play_sigmas, strict=True)
        )
        return one, two

    @property
    def taken_up(self) -> tuple[int, int]:
        """Steps of play of each axis that the unit takes up by blips."""
        takes = self._unit.version >= WITH_BACKLASH
        one, two = (self.ram.get(BY_NAME[name].address, 0) if takes else 0 for name in BACKLASHES)
        return one, two

    def take_up(self) -> bool:
        """Have the unit take up as much play as is configured, where it takes up any; return whether that is new.

        Raises
        ------
        DriveRefused, NoAnswer, LinkError
            As for `soft_write`.
        """
        new = False
        for name, play in zip(BACKLASHES, self._settings.plays, strict=True):
            register, steps = BY_NAME[name], math.floor(play or 0.0)
            if play is not None and self._unit.version >= WITH_BACKLASH and self.ram.get(register.address) != steps:
                self.soft_write(register, steps)
                new = True
        return new

    @property
    def sidereal(self) -> tuple[int, int]:
        """Counts and postscaler of the sidereal rate."""
        return self.lasting[_DRIVES[0]], Flags.of(self.lasting[_DRIVES[1]]).postscaler

    @property
    def tracks(self) -> int:
        """The sense in which axis 1 tracks without a program."""
        return 1 if Flags.of(self.lasting[_DRIVES[1]]).positive else -1

    @property
    def centre_rate(self) -> float:
        """Steps a second of CENTRE in the sense in which axis 1 tracks, by its words alone."""
        return self.speeds.rate("centre_left" if self.tracks > 0 else "centre_right")

    @property
    def usual(self) -> Speeds:
        """The same with the drives as they are without a program, so that axis 1 tracks."""
        return self._speeds_with(*_DRIVES, *_SLEWS)

    @property
    def resting(self) -> Speeds:
        """The same with both drives off."""
        usual = self.usual
        flags = [BY_NAME[f"{name}_flags"].address for name in DRIVES]
        return replace(usual, ram={**usual.ram, **{each: usual.ram[each] & ~1 for each in flags}})

    @property
    def full(self) -> Speeds:
        """The same with the drives in force, and the slew as fast as it is without a program."""
        return self._speeds_with(*_SLEWS)

    def _speeds_with(self, *lasting: int) -> Speeds:
        return Speeds(self._settings, self.lasting, self.ram | {each: self.lasting[each] for each in lasting})

    # Writing ---------------------------------------------------------------------------------------------------

    def soft_write(self, register: Register, value: int) -> float:
        """Write a word in RAM and read it back; return when it was heard.

        Raises
        ------
        AwrError, DriveRefused
            This register is never written, or not so; the unit does not hold what was written.
        NoAnswer, LinkError
            It does not answer.
        """
        if register.is_rate:
            self.last_rate = register
        for _ in range(_TRIES):
            heard = self._unit.soft_write(register, value)
            if self._unit.written_for_good:
                self._see_overwritten(register)
            self.ram[register.address] = value
            if not self.tells_ram or self._unit.read(register.address | RAM) == value:
                return heard
        if self._unit.read(register.address | RAM) == self.lasting.get(register.address):
            raise DriveRefused(
                f"{register.name} was written {value} in RAM, and a read with bit 7 tells the non-volatile word "
                f"{self.lasting[register.address]}: where it never tells another, set [drive] reads_ram = false"
            )
        raise DriveRefused(
            f"{register.name} was written {value} and reads otherwise; check the line, then `drive reload`"
        )

    def _see_overwritten(self, register: Register) -> None:
        """A bit that fell over on the line may have made a write for good of a soft write."""
        now, was = self._unit.read(register.address), self.lasting.get(register.address)
        if now is not None and was is not None and now != was:
            self.overwritten[register.name] = (now, was)

    def drive_at(self, axis: int, words: RateWords) -> list[tuple[RateWords, float]]:
        """Have a drive go by other words; return those that were in force one after the other, and since when."""
        went = list[tuple[RateWords, float]]()
        for part, value in (("counts", words.counts), ("flags", words.flags.word)):
            register = BY_NAME[f"{DRIVES[axis]}_{part}"]
            if self.ram.get(register.address) != value:
                heard = self.soft_write(register, value)
                went.append((self.speeds.drive_words(axis), heard))
        return went or [(words, self._unit.now())]

    def read_drive(self, axis: int) -> None:
        """Read the words of a drive that are in force, as far as the unit tells them."""
        for address in _DRIVES[2 * axis : 2 * axis + 2]:
            value = self._unit.read(address | RAM) if self.tells_ram else None
            if value is not None:
                self.ram[address] = value

    def drive_flags(self, axis: int) -> int:
        """The flags in force of a drive."""
        return self.ram.get(BY_NAME[f"{DRIVES[axis]}_flags"].address, 0)

    # The cookie ------------------------------------------------------------------------------------------------

    def bake(self) -> int:
        """See that RAM holds a cookie, what a person wrote in its place as well; return its value.

        Raises
        ------
        DriveRefused, NoAnswer, LinkError
            As for `soft_write`.
        """
        plain = self.lasting[_COOKIE.address]
        if self.ram[_COOKIE.address] == plain:
            self.soft_write(_COOKIE, plain + 1 if plain < _COOKIE.highest else plain - 1)
        return self.ram[_COOKIE.address]

    def is_there(self, cookie: int) -> bool:
        """Whether the unit still has the cookie, so that it was not switched off; True where it does not tell."""
        value = self._in_ram(_COOKIE.address, cookie) if self.tells_ram else None
        return value is None or value == cookie

    def has_cookie(self) -> bool:
        """Whether the unit has the cookie that it was given last; True where it does not tell.

        Raises
        ------
        NoAnswer, LinkError
            It does not answer.
        """
        return self.is_there(self.ram[_COOKIE.address])

    def was_committed(self) -> bool:
        """Whether the non-volatile memory has the cookie, which no commit of ours leaves there."""
        plain = self.lasting[_COOKIE.address]
        value = self._unit.read(_COOKIE.address)
        return value not in {None, plain} and value == self.ram.get(_COOKIE.address)

    @property
    def calibration(self) -> int | None:
        """The non-volatile words of `drive_ra`, from which all rates are reckoned; None before they were read."""
        counts, flags = (self.lasting.get(address) for address in _DRIVES[:2])
        return None if counts is None or flags is None else counts << 16 | flags

    @property
    def directions(self) -> int | None:
        """The non-volatile senses, and above them by what those in RAM differ; None before they were read."""
        lasting = self.lasting.get(_DIRECTIONS)
        return None if lasting is None else lasting | (self.ram.get(_DIRECTIONS, lasting) ^ lasting) << 8

    @property
    def are_turned(self) -> bool:
        """Whether the senses in RAM are others than the non-volatile ones."""
        return _DIRECTIONS in self.changed

    # For a person ----------------------------------------------------------------------------------------------

    def differing(self) -> dict[str, tuple[int, int]]:
        """Words that RAM holds otherwise than the non-volatile memory: by name both, this one first."""
        return {
            register.name: (self.ram[register.address], self.lasting[register.address])
            for register in REGISTERS
            if register.address in self.lasting and self.ram[register.address] != self.lasting[register.address]
        }

    def shown(self) -> Mapping[str, str]:
        """All words by name, as a person reads them."""
        rows = {}
        for register in REGISTERS:
            if register.address in self.lasting:
                value, here = self.lasting[register.address], self.ram.get(register.address)
                rows[register.name] = shown(register, value)
                if here is not None and here != value:
                    rows[register.name] += f"; in RAM {shown(register, here)}"
        return rows
