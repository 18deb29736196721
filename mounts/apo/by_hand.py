"""Commands in a person's hands: what may be given, what it changes for the driver, what is answered."""

from dataclasses import dataclass

from mounts.apo.axis import ControlledAxis
from mounts.apo.commands import Command, decode
from mounts.apo.readings import FiducialPassage, parse_dump
from mounts.apo.replies import Reply

SETS_POSITION = frozenset({"SET.POSITION", "ZERO", "CORRECT"})
MOVES = frozenset({"MOVE", "+MOVE", "DRIFT", "P", "+", "-"})
_BEYOND = "it moves the axis by no plan: only the controller's own limits bound it, not horizon and Sun"


@dataclass(frozen=True)
class Given:
    """A command that was given, and what came back."""

    command: Command
    reply: Reply
    moved_deg: float | None = None  # by which it set the position, where it did

    @property
    def fiducials(self) -> tuple[FiducialPassage, ...]:
        """The passages of fiducials that MS.DUMP tells; none of another command."""
        return parse_dump(self.reply) if self.command.name == "MS.DUMP" else ()


def risk_of(text: str) -> str:
    """Why a person must confirm a command; empty where nothing must be.

    Raises
    ------
    ImpossibleCommand
        It is none of the manual.
    """
    what = decode(text)
    if what.name in MOVES and (what.name == "P" or what.arguments or what.name in {"+", "-"}):
        return what.row.risky or _BEYOND
    return what.row.risky if what.arguments or not _asks(what) else ""


def give(axis: ControlledAxis, text: str) -> Given:
    """Give a command to an axis; what it does to the buffer is taken note of."""
    what = decode(text)
    answer = axis.asked(lambda: axis.controller.ask(what))
    if what.flushes or what.name in MOVES | SETS_POSITION:
        axis.forget_path()
    if what.name == "INIT":
        axis.forget_bits()
    return Given(what, answer.reply)


def _asks(what: Command) -> bool:
    """Whether a command without arguments only asks for what it sets with them."""
    return () in what.row.forms and len(what.row.forms) > 1
