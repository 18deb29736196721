"""One axis controller at the far end of a line: commands out, values back.

What a lost answer means, and what is safe then, is said in `line`.
"""

from dataclasses import dataclass
from typing import Generic, Literal, TypeVar

from mounts.apo.commands import Argument, Command, Kind, command, encode
from mounts.apo.errors import CommandRefused
from mounts.apo.line import Answer, Line, Request
from mounts.apo.readings import (
    Drift,
    FiducialPassage,
    Identity,
    Status,
    parse_drift,
    parse_dump,
    parse_identity,
    parse_limits,
    parse_max_velocity,
    parse_output_limit,
    parse_status,
)

AxisSelect = Literal["prefix", "line"]
"""How a command finds its axis on a shared line: a word before it, or a word on a line of its own, then it."""

AXIS_WORDS = ("AZ", "ALT", "ROT")
_MARKERS = (command("ID"), command("HELP", "ID"))
_Value = TypeVar("_Value")


@dataclass(frozen=True)
class Timed(Generic[_Value]):
    """A value, the POSIX times between which the controller took it, and when all of the answer was here."""

    value: _Value
    sent: float
    began: float
    received: float
    repeated: bool = False  # it was asked for again, as an earlier answer was lost


class Controller:
    """One axis controller.

    Parameters
    ----------
    line : Line
        Its own, or the one it shares.
    kind : str
        Whose status bits it has.
    axis_word : str
        On a shared line `AZ`, `ALT` or `ROT`; empty on a line of its own.
    axis_select : str
        How the word is given.
    limits_command : str
        The name of SET.LIMITS, which the manual's text has lost.
    """

    def __init__(
        self,
        line: Line,
        kind: Kind,
        axis_word: str = "",
        *,
        axis_select: AxisSelect = "prefix",
        limits_command: str = "SET.LIMITS",
    ) -> None:
        self._line = line
        self._kind: Kind = kind
        self._prefix = axis_word if axis_select == "prefix" else ""
        self._select = axis_word if axis_select == "line" else ""
        self._names = {"SET.LIMITS": limits_command}
        self._markers = tuple(self._text(marker) for marker in _MARKERS)
        self._word = axis_word

    @property
    def name(self) -> str:
        """Its line, and its word on that line."""
        return f"{self._line.name} {self._word}".rstrip()

    def ask(self, what: Command) -> Answer:
        """Give a command; return its answer.

        Raises
        ------
        CommandRefused
            The controller says `ERR:`; nothing was done.
        NoAnswer, WrongAnswer, LinkError
            As `Line.ask`: whether it was done is not known, unless it is one that was repeated.
        """
        request = Request(self._text(what), what.row.answer_bytes, what.repeatable, self._markers, self._select)
        answer = self._line.ask(request)
        if answer.reply.error:
            reason = answer.reply.error
            raise CommandRefused(f"{self.name} refuses {what.text}: {reason}", reason)
        return answer

    def tell(self, name: str, *arguments: Argument) -> Answer:
        """Give a command by its name, as in ``tell("MOVE", 12.5, 0.004, 3600.0)``; as `ask`."""
        return self.ask(command(name, *arguments))

    def line_time(self, what: Command) -> float:
        """Return the seconds that a command with its answer takes on the line."""
        return self._line.time_of(self._text(what))

    def status(self) -> Timed[Status]:
        """Ask STATUS; on the SDSS this clears its sticky bits, so whoever asks keeps them.

        An SDSS answer that is lost on the way takes the bits with it; what still holds is there in the next.
        """
        answer = self.tell("STATUS")
        status = parse_status(answer.reply, self._kind)
        return Timed(status, answer.sent, answer.began, answer.received, answer.repeated)

    def drift(self) -> Timed[Drift]:
        """Let the axis go on at its present velocity, and ask on what line."""
        answer = self.tell("DRIFT")
        return Timed(parse_drift(answer.reply), answer.sent, answer.began, answer.received)

    def identity(self) -> Identity:
        """Ask ID."""
        return parse_identity(self.tell("ID").reply)

    def fiducials(self) -> tuple[FiducialPassage, ...]:
        """Ask for the last passages of fiducials."""
        return parse_dump(self.tell("MS.DUMP").reply)

    def max_velocity(self) -> float:
        """Ask for the largest velocity, deg/s; `CommandRefused` or `MalformedReply` where it cannot tell."""
        return parse_max_velocity(self.tell("MAXV").reply)

    def limits(self) -> tuple[float, float]:
        """Ask for the soft limits, degrees; `CommandRefused` or `MalformedReply` where it cannot tell."""
        return parse_limits(self.tell("SET.LIMITS").reply)

    def output_limit(self) -> int:
        """Ask for the limit of the motor output, percent."""
        return parse_output_limit(self.tell("OUTPUT.LIMIT").reply)

    def close(self) -> None:
        """Close its line; the next command opens it again."""
        self._line.close()

    def _text(self, what: Command) -> str:
        """Return a command's line without the CR, as this controller takes it."""
        text = encode(what, self._prefix).decode("ascii").rstrip("\r")
        return text.replace(what.name, self._names.get(what.name, what.name), 1)
