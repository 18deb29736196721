"""How long an axis travels: what the planner asks of each drive, so that `pointing` needs nothing of `mounts`."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, TypeGuard, runtime_checkable

_ROUNDS = 60  # in which the beginning of a travel that waits is found
_SAME_S = 1e-6


class Travel(Protocol):
    """One axis on its way, from the moment its motion is commanded."""

    @property
    def duration(self) -> float:
        """Seconds until the axis has landed."""
        ...

    @property
    def landed(self) -> float:
        """The position in counts where it lands."""
        ...

    def position(self, elapsed: float) -> float:
        """The position in counts `elapsed` seconds after the start; `landed` from `duration` on."""
        ...


class SlewModel(Protocol):
    """The law by which a drive moves one axis; each drive implements it, the planner calls it."""

    @property
    def max_rate(self) -> float:
        """The largest speed during a slew, counts per second."""
        ...

    def travel(self, start: float, end: float, start_rate: float, end_rate: float) -> Travel:
        """Travel from `start` to `end` counts, beginning with `start_rate`, counts per second.

        A drive that can end a slew in motion ends it with `end_rate`; one that cannot lands at rest and ignores it.
        """
        ...

    def limited(self, max_rate: float) -> "SlewModel":
        """Return the law of the same axis held to a lower top speed, counts per second."""
        ...


class MeetingModel(SlewModel, Protocol):
    """The law of a drive that ends a slew in motion, and so can be asked how soon it is on a line.

    Asked so, the duration grows steadily with the distance, and the arrival at a target is found in few rounds. The
    duration to a place that is to be passed at speed leaps: there may be no arrival at which it fits.
    """

    def onto(self, start: float, start_rate: float, position: float, rate: float) -> Travel:
        """Travel from `start` counts onto a line, which is at `position` counts as the travel begins.

        It ends on the line, with the line's `rate`, counts per second.
        """
        ...


def meets(model: SlewModel) -> TypeGuard[MeetingModel]:
    """Whether a law can be asked how soon it is on a line; a protocol's own check costs a third of a plan."""
    return hasattr(model, "onto")


def travelled(
    model: SlewModel, start: float, start_rate: float, target: float, rate: float, due: float | None = None
) -> Travel:
    """Travel to `target` counts with `rate`; onto the line that is there in `due` seconds, of a model that meets."""
    if due is not None and meets(model):
        return model.onto(start, start_rate, target - rate * due, rate)
    return model.travel(start, target, start_rate, rate)


@dataclass(frozen=True)
class Waiting:
    """A travel that begins later; until then the axis drifts on.

    Attributes
    ----------
    start, start_rate : float
        Counts, and counts per second.
    wait : float
        Seconds until it begins.
    travel : Travel
        From where the axis has drifted by then.
    """

    start: float
    start_rate: float
    wait: float
    travel: Travel

    @property
    def duration(self) -> float:
        """Seconds until the axis has landed, those of the wait among them."""
        return self.wait + self.travel.duration

    @property
    def landed(self) -> float:
        """The position in counts where it lands."""
        return self.travel.landed

    def position(self, elapsed: float) -> float:
        """The position in counts `elapsed` seconds after the motion was commanded."""
        if elapsed < self.wait:
            return self.start + self.start_rate * elapsed
        return self.travel.position(elapsed - self.wait)


def arriving(model: SlewModel, start: float, start_rate: float, target: float, rate: float, due: float) -> Travel:
    """Travel that is at `target` counts with `rate` in `due` seconds, or as soon as it can where that is too soon.

    A model that meets begins as much later, but for a drift so fast that no such beginning is found; one that does
    not meet lands early and stands.
    """
    travel = soonest = travelled(model, start, start_rate, target, rate, due)
    if not meets(model):
        return soonest
    wait = 0.0
    for _ in range(_ROUNDS):
        later = max(0.0, due - travel.duration)
        if abs(later - wait) <= _SAME_S:
            return Waiting(start, start_rate, wait, travel) if wait else travel
        wait = later
        travel = travelled(model, start + start_rate * wait, start_rate, target, rate, due - wait)
    return soonest


class Part(Protocol):
    """One move of a slew."""

    @property
    def duration(self) -> float:
        """Seconds."""
        ...


@runtime_checkable
class Parted(Protocol):
    """A travel of several moves, as no command ends one."""

    @property
    def pieces(self) -> Sequence[Part]:
        """The moves, in order."""
        ...

    @property
    def in_one_s(self) -> float:
        """Seconds that one move of all its steps would last."""
        ...
