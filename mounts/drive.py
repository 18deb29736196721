"""The contract that every drive keeps with the session.

Counts are raw drive units (degrees for drives that count in degrees), rates counts per second, times POSIX seconds.
Every sequence is in axis order; a rotator is the third element.
Decision record 0001 shows on paper that the four drives fit.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from pointing.plan import Leading, Units
from pointing.slew import SlewModel

ROTATOR = 2
"""Where an instrument rotator stands among the axes."""


@dataclass(frozen=True)
class Capabilities:
    """What a drive can do, so that the session never guesses."""

    has_position: bool  # reports where its axes are
    can_stop: bool  # has a command that ends any motion
    rate_control: bool  # takes a tracking rate for each axis
    path_nodes: bool  # takes positions and velocities against time
    holds_rate_alone: bool  # goes on tracking when the host is gone
    units: Units
    goes_on_at: float = 0.0  # counts per second that axis 1 tracks with, whatever it is told
    bounds_itself: bool = True  # by soft limits of its own, that were written and read back
    rests_within: float = 0.0  # counts to either side by which an axis at rest may be held off its place


@dataclass(frozen=True)
class AxisReading:
    """One axis as the drive reports it."""

    counts: float
    uncertainty_counts: float
    rate: float  # counts per second
    slewing: bool


@dataclass(frozen=True)
class Reading:
    """The drive at one moment."""

    time: float  # the moment all positions belong to
    axes: tuple[AxisReading, ...]
    motion: tuple[str, ...] = ()  # names of the sources moving the telescope now
    limits: tuple[str, ...] = ()  # names of the limits reached
    alarms: tuple[str, ...] = ()  # names of the alarms standing
    powered: bool = True  # the motors have power
    tracking: bool = False  # the drive's own tracking is on
    unsynchronised: str = ""  # why the position cannot be trusted; empty when it can

    @property
    def counts(self) -> tuple[float, float]:
        """Where axis 1 and axis 2 are."""
        return self.axes[0].counts, self.axes[1].counts


@dataclass(frozen=True)
class AxisSlew:
    """What one axis is told: where to go, how fast at most, and the rate to go on with."""

    target: float  # counts; a drive of whole steps rounds
    rate_after: float = 0.0  # counts per second once landed
    max_rate: float | None = None  # counts per second; None for the drive's own top speed
    arrival: float | None = None  # POSIX seconds at which it was planned to be there; a drive of path nodes meets it


class AxisPath(Protocol):
    """Where the axes must be at any time a little ahead."""

    @property
    def led(self) -> bool:
        """Whether it moves faster than a drive may go on at when nobody watches it."""
        ...

    @property
    def axes(self) -> int:
        """How many axes have a way of their own; a rotator may have none."""
        ...

    def at(self, time: float) -> Sequence[tuple[float, float]]:
        """(counts, counts per second) of each axis at POSIX `time`."""
        ...

    def axis_at(self, axis: int, time: float) -> tuple[float, float]:
        """The same of one axis, counted from 0, for whoever asks each at times of its own."""
        ...


class Drive(Protocol):
    """A telescope's drive. Every method is given the time and may block for one exchange on the link.

    All raise `DriveError`, or the `TransportError` of the link where that is what failed.
    """

    @property
    def capabilities(self) -> Capabilities:
        """What this drive can do."""
        ...

    @property
    def slew_models(self) -> tuple[SlewModel, ...]:
        """The laws by which its axes slew, with all that has been learnt of them."""
        ...

    @property
    def start_latency(self) -> float:
        """Seconds from calling `start` to the moment the axes begin to move."""
        ...

    @property
    def axes_land_together(self) -> bool:
        """Whether tracking resumes on both axes only when the later one has landed."""
        ...

    @property
    def memory(self) -> Mapping[str, object]:
        """What the drive must be given back when it is made again: position, boot cookie, all it has learnt."""
        ...

    @property
    def notes(self) -> tuple[str, ...]:
        """What a person should know: differences from the configuration, assumptions confirmed or refuted."""
        ...

    def connect(self, time: float, *, make_safe: bool) -> Reading:
        """Open the link, check that it is the right drive, say where it is; `make_safe` ends all motion first."""
        ...

    def read(self, time: float) -> Reading:
        """Ask the drive for its state."""
        ...

    def start(self, axes: Sequence[AxisSlew], time: float) -> float:
        """Begin a slew of all axes; return the time at which the motion began. A rotator not named is halted.

        A drive with `path_nodes` must be called by `follow` from then on: what it is to follow joins the slew's end.
        """
        ...

    @property
    def leading(self) -> Leading | None:
        """The speeds and accelerations at which `follow` can lead the axes; None for a drive that only slews."""
        ...

    def stand_by(self, time: float) -> None:
        """Get ready to lead the axes, which may take seconds; nothing moves otherwise for it."""
        ...

    def follow(self, path: AxisPath, time: float) -> float:
        """Keep the axes on `path`, from wherever they are; return the seconds until it must be called again."""
        ...

    def move_at(self, rates: Sequence[float], time: float) -> None:
        """Move the axes at these rates, counts per second, until told otherwise; `stop` ends it.

        Called again and again: the call is the host's sign of life as well. `DriveRefused` where a drive has no such
        motion, or would go on when the host is gone and no dead-man process can stand beside it.
        """
        ...

    def sync(self, counts: Sequence[float], time: float) -> None:
        """Declare the present position to be `counts`."""
        ...

    def stop(self, time: float) -> None:
        """End all motion, tracking included."""
        ...

    def power(self, *, on: bool) -> None:
        """Power the motors, or send the drive to standby; `DriveRefused` where a drive cannot."""
        ...

    def registers(self) -> Mapping[str, str]:
        """Everything the drive can be asked, by name, as a person reads it."""
        ...

    def close(self, time: float, *, keep_tracking: bool) -> None:
        """Leave the drive safe and close the link; with `keep_tracking` it goes on at its present rates."""
        ...


@runtime_checkable
class Telling(Protocol):
    """A drive that tells by itself what happens to it."""

    def told(self) -> tuple[str, ...]:
        """What happened since it was asked last, in sentences, for the event log."""
        ...


@runtime_checkable
class HoldsUnplaced(Protocol):
    """A drive that tracks on whatever it is told, and can be held though nobody knows where it stands."""

    def hold_unplaced(self, time: float) -> str:
        """Hold it where it stands; return how, as people read it, or nothing where it cannot be held."""
        ...

    def leave_unplaced(self) -> None:
        """Hold it so no more."""
        ...


@runtime_checkable
class Stowing(Protocol):
    """A drive whose controllers know a stow of their own."""

    def stow(self, time: float) -> bool:
        """Let parked axes go to it, if that is configured; return whether they do, and read as slewing meanwhile."""
        ...


@runtime_checkable
class Declares(Protocol):
    """A drive to which the position of one axis can be declared alone: that of a rotator, which no star tells."""

    def declare(self, number: int, counts: float, time: float) -> None:
        """Declare the present position of an axis, by its number from 0, to be `counts`."""
        ...
