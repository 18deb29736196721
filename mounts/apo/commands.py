"""Every command of the axis controllers, in one table, and its encoding.

A command is one line of at most 256 characters, its CR included; words stand apart by one blank. Numbers have 12
decimals: half of the last one is 1.8e-9 arcseconds, and a decimal point is always there, which some controllers
require. Driver, simulator, help and tests read the same table.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import isfinite
from types import MappingProxyType
from typing import Literal

from mounts.apo.errors import ImpossibleCommand

Kind = Literal["apo", "sdss"]
"""The 3.5 m controllers, or the SDSS ones."""

Argument = float | int | str
MAX_LINE = 256  # characters, CR included
DECIMALS = 12

_Form = tuple[str, ...]


@dataclass(frozen=True)
class CommandRow:
    """A command as the manual has it.

    Attributes
    ----------
    name : str
        How it is sent.
    aliases : tuple of str
        What the controller takes for the same.
    forms : tuple of tuple of str
        The arguments it can be given, by meaning; see `MEANINGS`.
    effect : str
        What it does, one sentence.
    flushes : bool
        Whether it supersedes an interpolated path and empties the buffer, in all forms but that of a node.
    ends_corrections : bool
        Whether the controller is in MS.OFF afterwards.
    repeatable : bool
        Whether carrying it out twice is the same as once, so that it may be sent again when its answer was lost.
    answer_bytes : int
        The longest answer to expect beyond the echo.
    sdss_only : bool
        Whether the 3.5 m controllers ignore it.
    risky : str
        Why a person must confirm it; empty where nothing happens that the next command could not repair.
    assumed : str
        What of it is not in the manual; empty where all of it is.
    """

    name: str
    aliases: tuple[str, ...]
    forms: tuple[_Form, ...]
    effect: str
    flushes: bool = False
    ends_corrections: bool = False
    repeatable: bool = True
    answer_bytes: int = 128
    sdss_only: bool = False
    risky: str = ""
    assumed: str = ""


MEANINGS: Mapping[str, str] = MappingProxyType(
    {
        "position": "degrees",
        "velocity": "degrees per second",
        "time": "TAI seconds of the day",
        "size": "degrees",
        "count": "steps, a whole number",
        "percent": "a whole number from 0 to 100",
        "state": "on or off",
        "command": "the name of a command",
        "text": "printable ASCII",
    }
)

_REALS = ("position", "velocity", "time", "size")
_NONE: _Form = ()
_POSITION: _Form = ("position",)
_LINE: _Form = ("position", "velocity")
_NODE: _Form = ("position", "velocity", "time")
_MOVES = (_NONE, _POSITION, _LINE, _NODE)

TABLE: tuple[CommandRow, ...] = (
    CommandRow("+", (), (_NONE, ("count",)), "step the position up, once or `count` times", repeatable=False),
    CommandRow("-", (), (_NONE, ("count",)), "step the position down, once or `count` times", repeatable=False),
    CommandRow("STEP", (), (("size",),), "set the step of + and -"),
    CommandRow("DEBUG", (), (("state",),), "turn the controller's debug messages on or off", assumed="name"),
    CommandRow(
        "DRIFT",
        (),
        (_NONE,),
        "go on at the present velocity; answers position, velocity and time",
        flushes=True,
        ends_corrections=True,
    ),
    CommandRow("HELP", ("H", "?"), (_NONE, ("command",)), "list the commands, or explain one", answer_bytes=8192),
    CommandRow("ID", (), (_NONE,), "tell the versions of code and axis.ini"),
    CommandRow(
        "INIT",
        ("I",),
        (_NONE,),
        "halt, clear the sticky status bits, be ready",
        flushes=True,
        ends_corrections=True,
    ),
    CommandRow("LOG", (), (("text",),), "put a message into the controller's log", repeatable=False, assumed="name"),
    CommandRow(
        "MAXV",
        (),
        (_NONE, ("velocity",)),
        "set the largest velocity; alone, tell it",
        assumed="that it answers without an argument",
        risky="the controller clips the velocity of nodes silently",
    ),
    CommandRow(
        "MOVE",
        ("M",),
        _MOVES,
        "stop here; go to a position; follow a line from now; or the next node of an interpolated path",
        flushes=True,
        ends_corrections=True,
        repeatable=False,
    ),
    CommandRow(
        "+MOVE",
        (),
        _MOVES,
        "offset all moves already received, those in the buffer too, but none that comes later",
        repeatable=False,
    ),
    CommandRow(
        "MS.DUMP",
        (),
        (_NONE,),
        "tell the last twenty passages of fiducial edges",
        answer_bytes=2400,
    ),
    CommandRow("MS.OFF", (), (_NONE, ("time",)), "end corrections by fiducials, now or at a time"),
    CommandRow("MS.ON", (), (_NONE,), "correct the position when a fiducial is passed", repeatable=False),
    CommandRow(
        "CORRECT",
        (),
        (_NONE,),
        "correct the position by the error of the fiducial passed last",
        repeatable=False,
        risky="the position jumps by whatever the last fiducial measured",
    ),
    CommandRow(
        "OUTPUT.LIMIT",
        (),
        (_NONE, ("percent",)),
        "set the limit of the motor output; alone, tell it",
        assumed="name",
        risky="the motors may lose the strength to hold the axis, or gain that to break it",
    ),
    CommandRow(
        "P",
        (),
        (_NONE,),
        "drive the axis to the stow position",
        flushes=True,
        risky="the axis travels to a position that only the controller knows",
    ),
    CommandRow(
        "RESET",
        (),
        (_NONE,),
        "reset the controller's hardware and halt",
        flushes=True,
        ends_corrections=True,
        repeatable=False,
        risky="the controller starts anew and answers nothing meanwhile",
    ),
    CommandRow(
        "SET.LIMITS",
        (),
        (_NONE, ("position", "position")),
        "set the soft limits, in either order; alone, tell them",
        assumed="name, and that it answers without arguments",
        risky="the controller no longer stops where it did",
    ),
    CommandRow(
        "SET.POSITION",
        (),
        (_POSITION,),
        "declare the present position; only at rest",
        risky="every later position is wrong if this one is",
    ),
    CommandRow("SET.TIME", (), (_NONE,), "set the controller's clock by NTP", sdss_only=True),
    CommandRow("STATUS", (), (_NONE,), "tell position, velocity, time, status word and index position"),
    CommandRow("STOP", ("X",), (_NONE,), "stop abruptly, as the stop button does", flushes=True),
    CommandRow(
        "ZERO",
        (),
        (_NONE,),
        "declare the present position to be 0; only at rest",
        assumed="name",
        risky="every later position is wrong if this one is",
    ),
)

_ROWS = {word: row for row in TABLE for word in (row.name, *row.aliases)}


def row_of(word: str) -> CommandRow:
    """Return the row of a command by its name or an alias, in any case.

    Raises
    ------
    ImpossibleCommand
        There is none.
    """
    try:
        return _ROWS[word.upper()]
    except KeyError:
        names = ", ".join(row.name for row in TABLE)
        raise ImpossibleCommand(f"{word!r} is no command of an axis controller; there are {names}") from None


@dataclass(frozen=True)
class Command:
    """A command with its arguments, as the manual allows them.

    Parameters
    ----------
    name : str
        Its name or an alias; kept as the name.
    arguments : tuple
        Numbers, or one text.

    Raises
    ------
    ImpossibleCommand
        There is no such command, or not with these arguments.
    """

    name: str
    arguments: tuple[Argument, ...] = ()

    def __post_init__(self) -> None:
        row = row_of(self.name)
        object.__setattr__(self, "name", row.name)
        form = next((form for form in row.forms if len(form) == len(self.arguments)), None)
        if form is None:
            allowed = " | ".join(" ".join((row.name, *form)) for form in row.forms)
            raise ImpossibleCommand(f"{row.name} does not take {len(self.arguments)} arguments; it is {allowed}")
        words = (row.name, *(_word(row, meaning, value) for meaning, value in zip(form, self.arguments, strict=True)))
        text = " ".join(words)
        if len(text) >= MAX_LINE:
            raise ImpossibleCommand(
                f"{row.name}: its line has {len(text) + 1} characters, CR included; at most {MAX_LINE} are taken"
            )
        object.__setattr__(self, "_text", text)

    @property
    def row(self) -> CommandRow:
        """What the manual says of it."""
        return _ROWS[self.name]

    @property
    def text(self) -> str:
        """Its line without the CR."""
        text: str = self.__dict__["_text"]
        return text

    @property
    def is_node(self) -> bool:
        """Whether it is a node of an interpolated path, which is queued rather than obeyed at once."""
        return self.name == "MOVE" and len(self.arguments) == len(_NODE)

    @property
    def flushes(self) -> bool:
        """Whether it ends an interpolated path and empties the buffer."""
        return self.row.flushes and not self.is_node

    @property
    def ends_corrections(self) -> bool:
        """Whether the controller is in MS.OFF afterwards; of the moves only the one without arguments does that."""
        return self.row.ends_corrections and not self.arguments

    @property
    def repeatable(self) -> bool:
        """Whether it may be sent again when its answer was lost."""
        return self.row.repeatable or (self.name in {"MOVE", "+MOVE"} and not self.arguments) or self._goes_to_a_place

    @property
    def _goes_to_a_place(self) -> bool:
        return self.name == "MOVE" and len(self.arguments) == 1


def command(name: str, *arguments: Argument) -> Command:
    """Return a command, as in ``command("MOVE", 12.5, 0.004, 3600.0)``."""
    return Command(name, arguments)


def encode(what: Command, axis_word: str = "") -> bytes:
    """Return the line of a command, for the axis of this word where several share a line.

    Raises
    ------
    ImpossibleCommand
        The line with the word is too long.
    """
    text = f"{axis_word} {what.text}" if axis_word else what.text
    if len(text) >= MAX_LINE:
        raise ImpossibleCommand(
            f"{what.name}: with {axis_word} its line has {len(text) + 1} characters; at most {MAX_LINE} are taken"
        )
    return text.encode("ascii") + b"\r"


def decode(line: str) -> Command:
    """Return the command of a line as a person or a host wrote it, in any case, with any blanks.

    Raises
    ------
    ImpossibleCommand
        There is none such; a word is not the number it should be.
    """
    head, *rest = line.split(maxsplit=1) or [""]
    row = row_of(head)
    if row.forms == (("text",),):
        return Command(row.name, tuple(word.rstrip() for word in rest))
    words = rest[0].split() if rest else []
    form = next((form for form in row.forms if len(form) == len(words)), ())
    if len(form) != len(words):
        return Command(row.name, tuple(words))  # which says what it takes
    return Command(row.name, tuple(_values(row, form, words)))


def normal(line: str) -> str:
    """Return a line without the blanks and the case in which its echo may differ."""
    return " ".join(line.upper().split())


def _word(row: CommandRow, meaning: str, value: Argument) -> str:
    """Return an argument as it is sent."""
    match meaning:
        case "count" | "percent" if isinstance(value, int) and 0 <= value <= (100 if meaning == "percent" else 10**6):
            return str(value)
        case "state" if str(value).lower() in {"on", "off"}:
            return str(value).lower()
        case "command" if isinstance(value, str):
            return row_of(value).name
        case "text" if isinstance(value, str) and _is_sendable(value):
            return value
        case _ if meaning in _REALS and not isinstance(value, str) and isfinite(value):
            return number(value)
    raise ImpossibleCommand(f"{row.name}: {meaning} {value!r} is not {_wanted(meaning)}")


def number(value: float) -> str:
    """Return a number as it is sent; what rounds to nothing has no sign."""
    text = f"{value:.{DECIMALS}f}"
    return text.removeprefix("-") if float(text) == 0.0 else text


def _is_sendable(text: str) -> bool:
    return (
        text.isascii()
        and text.isprintable()
        and text == text.strip() != ""
        and not any(word == "OK" or word.startswith("ERR:") for word in text.split())
    )


def _wanted(meaning: str) -> str:
    if meaning == "text":
        return "printable ASCII without the words OK and ERR:, by which answers are told apart"
    return MEANINGS[meaning] + (", finite" if meaning in _REALS else "")


def _values(row: CommandRow, form: _Form, words: list[str]) -> Iterator[Argument]:
    for meaning, word in zip(form, words, strict=True):
        try:
            if meaning in {"count", "percent"}:
                yield int(word)
            elif meaning in {"state", "command"}:
                yield word
            else:
                yield float(word)
        except ValueError:
            raise ImpossibleCommand(f"{row.name}: {meaning} {word!r} is not {_wanted(meaning)}") from None
