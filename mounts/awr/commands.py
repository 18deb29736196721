"""What is said to an AWR Microstep: one table of its commands, and the packets made of them."""

from dataclasses import dataclass
from typing import Literal

from mounts.awr.errors import AwrError
from mounts.awr.registers import BY_ADDRESS, EARLIEST, RAM, WITH_STATUS, Register, Version, checked

Speed = Literal["guide", "centre", "move", "slew"]
RELAYS = (1, 2, 3)


@dataclass(frozen=True)
class Command:
    """One body, and what it does; `n` stands for a relay, AA for an address, DDDD for a word."""

    text: str
    event: str
    meaning: str
    since: Version = EARLIEST


COMMANDS = (
    Command("1", "UP_PRESS", "presses and holds UP"),
    Command("2", "DN_PRESS", "presses and holds DOWN"),
    Command("3", "LT_PRESS", "presses and holds LEFT"),
    Command("4", "RT_PRESS", "presses and holds RIGHT"),
    Command("5", "RA_IDLE", "releases RIGHT and LEFT"),
    Command("6", "DEC_IDLE", "releases UP and DOWN"),
    Command("7", "SPEED_30", "keys move at GUIDE speed"),
    Command("8", "SPEED_2x", "keys move at CENTRE speed"),
    Command("9", "SPEED_SLEW", "keys move at SLEW speed"),
    Command("A", "SPEED_32x", "keys move at MOVE speed"),
    Command("Fn1", "", "switches relay n on"),
    Command("Fn0", "", "switches relay n off"),
    Command("D", "DISCARD", "discards all soft writes"),
    Command("E", "COMMIT", "commits all soft writes to the non-volatile memory"),
    Command("AA?", "", "reads a word"),
    Command("??", "", "reads all words"),
    Command("AADDDD", "", "writes a word; in RAM only where bit 7 of the address is set"),
    Command("R?", "", "tells relays and override", WITH_STATUS),
)
SPEEDS: dict[Speed, str] = {"guide": "7", "centre": "8", "slew": "9", "move": "A"}
PRESSES = {(0, 1): "3", (0, -1): "4", (1, 1): "1", (1, -1): "2"}
"""Body that presses the key of an axis, 0 or 1, to larger or smaller angles: LEFT and UP increase them."""
RELEASES = ("5", "6")
DISCARD, COMMIT, READ_ALL, ASK_STATUS = "D", "E", "??", "R?"


def packet(body: str) -> bytes:
    """A body on the wire."""
    return f":{body}#".encode("ascii")


def relay(number: int, *, on: bool) -> str:
    """Body that switches a relay.

    Raises
    ------
    AwrError
        There is no such relay.
    """
    if number not in RELAYS:
        raise AwrError(f"relay {number}: there are {', '.join(map(str, RELAYS))}")
    return f"F{number}{1 if on else 0}"


def read(address: int) -> str:
    """Body that reads a word.

    Raises
    ------
    AwrError
        There is no such register.
    """
    if address not in BY_ADDRESS and address & ~RAM not in BY_ADDRESS:
        raise AwrError(f"no register at {address:02X}; there are 00 to 1A, 3F and FF")
    return f"{address:02X}?"


def soft_write(register: Register, value: int) -> str:
    """Body that writes a word in RAM.

    Raises
    ------
    AwrError
        This register is never written, or never so.
    """
    return f"{register.address | RAM:02X}{checked(register, value):04X}"
