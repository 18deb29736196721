"""The wire as the manual has it, read for the simulator alone: what a unit hears, and the texts that it says.

The driver has a codec and tables of its own (`packets`, `messages`, `commands`, `registers`), and nothing is shared:
a mistake of one reading shows in the other, and a test holds both against the manual's text.
"""

START, STOP, LINE_END = ":", "#", "\r\n"
_BLANKS = frozenset(" \r\n")  # about a body they mean nothing
_BUFFER = 32  # characters of a packet that are kept

# Section 4, text and event of each command -----------------------------------------------------------------------

COMMANDS = {
    "1": "UP_PRESS", "2": "DN_PRESS", "3": "LT_PRESS", "4": "RT_PRESS", "5": "RA_IDLE", "6": "DEC_IDLE",
    "7": "SPEED_30", "8": "SPEED_2x", "9": "SPEED_SLEW", "A": "SPEED_32x", "D": "DISCARD", "E": "COMMIT",
}  # fmt: skip
KEYS = {  # axis, and sense to larger (1) or smaller (−1) angles, or released
    "UP_PRESS": (1, 1), "DN_PRESS": (1, -1), "LT_PRESS": (0, 1), "RT_PRESS": (0, -1), "RA_IDLE": (0, 0),
    "DEC_IDLE": (1, 0),
}  # fmt: skip
SPEEDS = {"SPEED_30": "guide", "SPEED_2x": "centre", "SPEED_SLEW": "slew", "SPEED_32x": "move"}
RELAYS = {f"F{n}{state}": (n, state == "1") for n in (1, 2, 3) for state in "01"}
ALL_WORDS, POLL = "??", "R?"

# Section 5.1 ----------------------------------------------------------------------------------------------------

WORDS = {  # first address of each name; counts are followed by their flags
    "drive_ra": 0x01, "drive_dec": 0x03, "guide_up": 0x05, "guide_right": 0x07, "guide_left": 0x09,
    "centre_up": 0x0B, "centre_right": 0x0D, "centre_left": 0x0F, "move_up": 0x11, "move_right": 0x12,
    "move_left": 0x13, "slew_up": 0x14, "slew_right": 0x15, "max_accel_ra": 0x16, "max_accel_dec": 0x17,
    "ra_backlash": 0x19, "dec_backlash": 0x1A, "CRC": 0x3F, "VERSION (DD.DD)": 0xFF,
}  # fmt: skip
SENSES = {"dir_sw_override": 0x1, "sw_ra_sense": 0x2, "sw_dec_sense": 0x4}  # bits of the word at 00
DIRECTIONS, RESERVED, CRC, VERSION, SOFT = 0x00, 0x18, 0x3F, 0xFF, 0x80
ENABLE, POSITIVE, POSTSCALER_SHIFT = 0x1, 0x2, 8
TOLD = (*range(WORDS["dec_backlash"] + 1), CRC, VERSION)
"""Addresses of all words, in the order in which `??` has them."""

# Sections 4 and 6, what it says ---------------------------------------------------------------------------------

YES, NO = "Y", "N"
ERRORS = {
    "watchdog timeout reset": "e1", "EEPROM CRC error": "e2", "event buffer overflow": "e3",
    "EEPROM verify error": "e4", "EEPROM other error": "e5", "MCLR reset": "e6", "brownout reset": "e7",
    "divide by zero": "e8", "divide overflow": "e9", "receive buffer overflow": "eA", "serial receive error": "eB",
    "protocol syntax error": "eC",
}  # fmt: skip
INDEX_PULSE, FULL_STOP, GO_FROM_ES = "P", "S1", "S0"
RA_REVERSED, RA_NORMAL, DEC_TO_POLE, DEC_FROM_POLE = "V1", "V0", "W1", "W0"
LINES = {"A": 0x0001, "B": 0x0002, "C": 0x0004, "D": 0x0010, "E": 0x0020, "F": 0x0040}


def told(address: int, value: int) -> str:
    """The answer to a read."""
    return f"{address:02X}?{value:04X}"


def written(address: int, *, ok: bool, form: str = "AA?Y") -> str:
    """The answer to a write."""
    return form.replace("AA", f"{address:02X}") if ok else f"{address:02X}N"


def polled(relays: int, *, stopped: bool) -> str:
    """The answer to the poll of relays, bit by bit, and override."""
    return f"R{relays:d}{stopped:d}"


def moving(ra: bool, dec: bool) -> str:
    """The event of axes that begin to move or are at their idle rates."""
    return f"X{ra:d}{dec:d}"


def lines(high: str) -> str:
    """The event of the lines of which these are high."""
    return f"L{sum(LINES[letter] for letter in high):04X}"


def said(text: str, *, with_stop: bool) -> str:
    """A text as a packet."""
    return f"{START}{text}{LINE_END}{STOP if with_stop else ''}"


def asked(body: str) -> tuple[int, int | None] | None:
    """Address of `AA?`, or address and word of `AADDDD`; None for anything else, lower-case digits among it."""
    digits = body.removesuffix("?")
    if (len(digits), len(body)) not in {(2, 3), (6, 6)} or not all(digit in "0123456789ABCDEF" for digit in digits):
        return None
    address, *word = bytes.fromhex(digits)
    return address, int.from_bytes(word, "big") if word else None


class Ear:
    """Takes packets out of what the host sends: what stands between START and STOP, a START begins anew."""

    def __init__(self) -> None:
        self._kept: str | None = None

    def hear(self, data: bytes) -> list[str]:
        """Bodies of the packets that end with these bytes."""
        bodies = []
        for character in data.decode("latin-1"):
            if character == START:
                self._kept = ""
            elif self._kept is None or character in _BLANKS:
                continue
            elif character == STOP:
                bodies.append(self._kept)
                self._kept = None
            else:
                self._kept = self._kept + character if len(self._kept) < _BUFFER else None
        return bodies
