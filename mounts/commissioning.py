"""What finding out about a drive is made of: steps, what they find, and the bench they work on.

A step asks one question. It says beforehand how far it may move an axis, moves by `Bench.move` alone, and returns
what it found. Steps that all drives share are in `clockdrive.commission`; a drive's own stand in its folder.
"""

from collections.abc import Callable, Generator
from dataclasses import dataclass
from typing import Any, Literal, Protocol, TypeVar

from mounts.drive import Reading

T = TypeVar("T")
Steps = Generator[float, None, T]  # yields the seconds after which it wants to go on
Verdict = Literal["confirmed", "refuted", "measured", "untested"]


def _always(_bench: Any) -> bool:  # noqa: ANN401 - any bench
    return True


def judged(right: bool) -> Verdict:
    """The verdict on what was assumed or configured."""
    return "confirmed" if right else "refuted"


@dataclass(frozen=True)
class Finding:
    """One thing found out, or the reason why not.

    Attributes
    ----------
    subject : str
        What was asked, such as "axis1 gears".
    verdict : str
        "confirmed" or "refuted" where something was assumed or configured, "measured" where nothing was.
    detail : str
        Values with their uncertainty; for "untested" why, and what to do.
    key : str
        The configuration key concerned, dotted; empty for none.
    configured, found : object
        Its value, and what it must be instead when refuted.
    """

    subject: str
    verdict: Verdict
    detail: str
    key: str = ""
    configured: object = None
    found: object = None

    @property
    def changes(self) -> bool:
        """Whether the configuration must change."""
        return self.verdict == "refuted" and bool(self.key) and self.found is not None


@dataclass(frozen=True)
class Encoder:
    """One look at an absolute encoder: its 16 bits, binary, of a turn."""

    word: int

    @property
    def turns(self) -> float:
        """Fraction of a turn."""
        return self.word / 0x10000


@dataclass(frozen=True)
class Move:
    """A move to a place beside the one where the step began.

    Attributes
    ----------
    offsets_deg : tuple of float
        Of each axis, by the configured gears.
    top_deg_s : float, optional
        Not faster than this.
    rates_after_deg_s : tuple of float
        With which to go on once landed.
    until_s : float, optional
        Stop the telescope so many seconds after the start.
    """

    offsets_deg: tuple[float, float]
    top_deg_s: float | None = None
    rates_after_deg_s: tuple[float, float] = (0.0, 0.0)
    until_s: float | None = None


def alone(axis: int, degrees: float, *, top_deg_s: float | None = None, until_s: float | None = None) -> Move:
    """A move of axis 0 or 1, the other one where the step began."""
    return Move((degrees, 0.0) if axis == 0 else (0.0, degrees), top_deg_s=top_deg_s, until_s=until_s)


BACK = Move((0.0, 0.0))
"""To where the step began."""


class Bench(Protocol):
    """What a step works on."""

    @property
    def drive(self) -> Any:  # noqa: ANN401 - a drive's own steps know which one it is
        """The drive."""
        ...

    def configured(self, dotted: str) -> Any:  # noqa: ANN401 - any kind of value
        """The value of a configuration key."""
        ...

    def counts_per_deg(self, axis: int) -> float:
        """Counts of a degree of axis 0 or 1 by the configured gears."""
        ...

    def move(self, move: Move) -> Steps[list[Reading]]:
        """Go to a place within the step's reach; return the readings on the way."""
        ...

    def wait(self, seconds: float) -> Steps[list[Reading]]:
        """Let the drive go on as it does, for a time."""
        ...

    def halt(self) -> Steps[list[Reading]]:
        """Stop, and watch until the axes rest."""
        ...

    def encoders(self) -> tuple[Encoder | None, Encoder | None]:
        """What the absolute encoders read, None where there is none."""
        ...

    def encoder_sense(self, axis: int) -> tuple[float, float] | None:
        """Encoder turns for one count of axis 0 or 1, with sign, and the relative uncertainty, once measured."""
        ...

    def position_error_deg(self, axis: int) -> float | None:
        """How far the sky was seen from the position, degrees of axis 0 or 1; None where nobody saw it."""
        ...


@dataclass(frozen=True)
class Step:
    """One question asked of a telescope.

    Attributes
    ----------
    name : str
        As in `--only`.
    finds : str
        What it finds out.
    run : callable
        The step itself.
    reach_deg : float
        How far an axis is sent from where the step began, by the gears as known so far; 0 when nothing moves.
    bound_deg : float
        How far it may come, whatever the gears turn out to be.
    needs : tuple of str
        Steps that must come before.
    allows_motion : bool
        Whether nothing may be moved once it has refuted something.
    together : bool
        Whether it moves both axes at once; otherwise it needs room to the sides of each alone.
    applies : callable
        Whether there is anything to find out here; asked of the bench when its turn comes.
    """

    name: str
    finds: str
    run: Callable[[Any], Steps[list[Finding]]]
    reach_deg: float = 0.0
    bound_deg: float = 0.0
    needs: tuple[str, ...] = ()
    allows_motion: bool = False
    together: bool = True
    applies: Callable[[Any], bool] = _always

    @property
    def moves(self) -> bool:
        """Whether anything moves."""
        return self.reach_deg > 0.0

    def reaches(self, move: Move) -> bool:
        """Whether a move stays within the reach, and moves one axis alone where that is all there is room for."""
        within = max(map(abs, move.offsets_deg)) <= self.reach_deg * 1.000001
        return within and (self.together or not all(move.offsets_deg))
