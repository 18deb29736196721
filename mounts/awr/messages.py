"""What an AWR Microstep says: answers and events, told apart by their form alone, on any bodies.

Events come at any time, between a command and its answer too. `AAN` with an address is a write that failed, a bare
`N` anything else; so one command is outstanding at a time.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass

ERRORS = {
    "1": "watchdog reset",
    "2": "EEPROM CRC error",
    "3": "event buffer overflow",
    "4": "EEPROM verify error",
    "5": "EEPROM error",
    "6": "reset at its reset pin",
    "7": "brownout reset",
    "8": "divide by zero",
    "9": "divide overflow",
    "A": "receive buffer overflow",
    "B": "serial receive error",
    "C": "protocol syntax error",
}
_RESETS, _DIVISIONS = frozenset("167"), frozenset("89")


# Answers -------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Done:
    """`Y` or `N`."""

    ok: bool

    @property
    def text(self) -> str:
        """As its body has it."""
        return "Y" if self.ok else "N"


@dataclass(frozen=True)
class Word:
    """`AA?DDDD`."""

    address: int
    value: int

    @property
    def text(self) -> str:
        """As its body has it."""
        return f"{self.address:02X}?{self.value:04X}"


@dataclass(frozen=True)
class Written:
    """`AA?Y`, `AAY` or `AAN`."""

    address: int
    ok: bool

    @property
    def text(self) -> str:
        """As its body has it."""
        return f"{self.address:02X}?Y" if self.ok else f"{self.address:02X}N"


@dataclass(frozen=True)
class Status:
    """`Rab`: relays bit by bit, and the override."""

    relays: int
    override: bool

    @property
    def text(self) -> str:
        """As its body has it."""
        return f"R{self.relays:X}{self.override:d}"


# Events --------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Error:
    """`e…`; the unit carries on."""

    code: str

    @property
    def meaning(self) -> str:
        """What the manual says of it."""
        return ERRORS[self.code]

    @property
    def is_reset(self) -> bool:
        """Whether the unit began anew: soft writes and position are lost."""
        return self.code in _RESETS

    @property
    def is_division(self) -> bool:
        """Whether a rate register holds what it cannot divide by."""
        return self.code in _DIVISIONS

    @property
    def text(self) -> str:
        """As its body has it."""
        return f"e{self.code}"


@dataclass(frozen=True)
class IndexPulse:
    """`P`: the worm of axis 1 passed its index."""

    @property
    def text(self) -> str:
        """As its body has it."""
        return "P"


@dataclass(frozen=True)
class Override:
    """`S1`: everything stopped at once; `S0`: the override is gone."""

    stopped: bool

    @property
    def text(self) -> str:
        """As its body has it."""
        return f"S{self.stopped:d}"


@dataclass(frozen=True)
class Moving:
    """`Xab`: which axes move otherwise than at their idle rate."""

    axes: tuple[bool, bool]

    @property
    def text(self) -> str:
        """As its body has it."""
        return "X{:d}{:d}".format(*self.axes)


@dataclass(frozen=True)
class Backlash:
    """`V…` of axis 1, `W…` of axis 2: a blip took up the play, in this sense."""

    axis: int
    on: bool

    @property
    def text(self) -> str:
        """As its body has it."""
        return f"{'VW'[self.axis]}{self.on:d}"


@dataclass(frozen=True)
class Lines:
    """`L00xy`: levels of the lines A to F; D, E, F in the x nibble, as the manual's example has it."""

    levels: tuple[bool, bool, bool, bool, bool, bool]

    @property
    def said(self) -> str:
        """As a person reads it."""
        states = (
            f"{letter} {'high' if level else 'low'}" for letter, level in zip("ABCDEF", self.levels, strict=True)
        )
        return f"input lines: {', '.join(states)}"

    @property
    def text(self) -> str:
        """As its body has it."""
        low, high = (sum(level << i for i, level in enumerate(part)) for part in (self.levels[:3], self.levels[3:]))
        return f"L00{high}{low}"


@dataclass(frozen=True)
class Strange:
    """A packet that is none of these; it is passed over."""

    text: str

    @property
    def why(self) -> str:
        """What is wrong with it, for a person."""
        if any(digit in "abcdf" for digit in self.text) and _decoded(self.text.upper()) is not None:
            return f"{self.text!r} has hexadecimal digits in lower case, which no AWR Microstep sends: check the link"
        return f"{self.text!r} is nothing that an AWR Microstep says: check the link, 9600 baud, 8N1"


Response = Done | Word | Written | Status
Event = Error | IndexPulse | Override | Moving | Backlash | Lines
Message = Response | Event | Strange

_HEX = "[0-9A-F]"


def _lines(found: "re.Match[str]") -> Lines:
    upper, lower = int(found[1]), int(found[2])
    a, b, c = (bool(lower & bit) for bit in (1, 2, 4))
    d, e, f = (bool(upper & bit) for bit in (1, 2, 4))
    return Lines((a, b, c, d, e, f))


_FORMS: tuple[tuple["re.Pattern[str]", Callable[["re.Match[str]"], Response | Event]], ...] = tuple(
    (re.compile(form), make)
    for form, make in (
        ("([YN])", lambda found: Done(found[1] == "Y")),
        (f"({_HEX}{{2}})\\?({_HEX}{{4}})", lambda found: Word(int(found[1], 16), int(found[2], 16))),
        (f"({_HEX}{{2}})\\??([YN])", lambda found: Written(int(found[1], 16), found[2] == "Y")),
        ("R([0-7])([01])", lambda found: Status(int(found[1]), found[2] == "1")),
        ("e([1-9ABC])", lambda found: Error(found[1])),
        ("P", lambda _: IndexPulse()),
        ("S([01])", lambda found: Override(found[1] == "1")),
        ("X([01])([01])", lambda found: Moving((found[1] == "1", found[2] == "1"))),
        ("([VW])([01])", lambda found: Backlash("VW".index(found[1]), found[2] == "1")),
        ("L00([0-7])([0-7])", _lines),
    )
)


def decoded(text: str) -> Message:
    """What a body says."""
    found = _decoded(text)
    return Strange(text) if found is None else found


def _decoded(text: str) -> Response | Event | None:
    for form, make in _FORMS:
        if found := form.fullmatch(text):
            return make(found)
    return None
