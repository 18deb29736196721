"""All axes as one telescope: looked at, made ready and halted together, whatever one of them does.

An axis that is silent costs its time-outs, so it is asked last, and told last to halt.
"""

import math
from collections.abc import Iterator

from mounts.apo import supervision
from mounts.apo.axis import STANDS_DEG_S, ControlledAxis, Sight
from mounts.apo.trust import Trust
from mounts.errors import DriveError, DriveRefused, Unsynchronised
from transports.errors import TransportError

_ANOTHERS = (
    "somebody else has its semaphore, so it takes no MOVE from this host; it goes to the end of its path, or is "
    "stopped by whoever has the semaphore, or by the stop button"
)


class AxisGroup:
    """The axes of a telescope.

    Parameters
    ----------
    axes : tuple of ControlledAxis
        Azimuth, altitude and perhaps a rotator.
    trust : Trust
        What is believed of their positions.

    Attributes
    ----------
    silent : dict
        Axes, by number, that did not answer when looked at last, and why.
    """

    def __init__(self, axes: tuple[ControlledAxis, ...], trust: Trust) -> None:
        self.axes = axes
        self.silent: dict[int, TransportError] = {}
        self._trust = trust
        self._heard = [-math.inf] * len(axes)  # POSIX seconds
        self._unhalted: dict[int, float] = {}  # POSIX seconds at which the buffers end of those that were not told to

    def named(self, name: str) -> int:
        """The number of the axis of a name.

        Raises
        ------
        DriveRefused
            There is none.
        """
        for i, axis in enumerate(self.axes):
            if axis.name == name:
                return i
        raise DriveRefused(f"no axis {name!r}; there is {', '.join(axis.name for axis in self.axes)}")

    def look(self) -> dict[int, Sight]:
        """Look at every axis; what answers is to be judged, whatever is silent."""
        sights: dict[int, Sight] = {}
        order = list(self._silent_last())
        self.silent = {}
        for i in order:
            try:
                sights[i] = self.axes[i].look()
                self._heard[i] = sights[i].time
            except TransportError as error:
                self.silent[i] = error
        return dict(sorted(sights.items()))

    def silence_s(self, time: float) -> float:
        """For how long the axes that did not answer have been silent, the longest of them."""
        return max(time - self._heard[i] for i in self.silent)

    @property
    def silent_names(self) -> str:
        """The axes that did not answer, as one reads them."""
        return " and ".join(self.axes[i].name for i in sorted(self.silent))

    def halt(self, *, abruptly: bool) -> None:
        """Tell every axis to halt, and raise the first error only then.

        Raises
        ------
        DriveError, TransportError
            An axis could not be told.
        """
        errors: list[DriveError | TransportError] = []
        for i in self._silent_last():
            axis = self.axes[i]
            try:
                axis.halt(abruptly=abruptly)
                self._unhalted.pop(i, None)
            except (DriveError, TransportError) as error:
                self._unhalted[i] = max(axis.queue.ends, self._unhalted.get(i, -math.inf))
                axis.let_expire()
                if left := _unhalted(axis, error):
                    errors.append(left)
        if errors:
            raise errors[0]

    def halt_late(self, i: int, sight: Sight) -> None:
        """Halt an axis that could not be told to, as soon as it can, while its buffer may lead it on."""
        if i not in self._unhalted or self.axes[i].is_anothers:
            return
        if sight.time <= self._unhalted[i]:
            try:
                self.axes[i].halt()
            except (DriveError, TransportError):
                return
        del self._unhalted[i]

    def free(self, i: int) -> None:
        """Initialise a controller that has halted; the position of one that has restarted is judged first."""
        axis = self.axes[i]
        if axis.sight is not None and axis.word.restarted:
            self._trust.restarted(i, axis.sight, led=axis.led)
            axis.confirming.jumped_deg = 0.0  # that was judged with it
            axis.offset.forget()
        if axis.must_init and not axis.is_anothers:
            axis.initialise()
            axis.look()

    def found(self, i: int) -> None:
        """Judge the position of an axis by where it was when it was driven last."""
        axis = self.axes[i]
        if axis.sight is not None:
            self._trust.found(i, axis.sight)

    def require_ready(self) -> None:
        """Initialise what has halted, and refuse to move what cannot be.

        Raises
        ------
        Unsynchronised, DriveRefused, TransportError
            The position may be wrong; an alarm stands, or a clock is off; an axis does not answer.
        """
        self.require_synchronised()
        self._unhalted = {}  # each is told to drift
        for i, axis in enumerate(self.axes):
            axis.look()
            self.free(i)
            axis.require_clock()
        self.require_synchronised()
        if theirs := [axis.name for axis in self.axes if axis.is_anothers]:
            raise DriveRefused(
                f"{' and '.join(theirs)} semaphore taken: somebody else moves this telescope, and its controllers "
                "take no moves from this host; have the semaphore given back there"
            )
        if standing := supervision.alarms(self.axes):
            raise DriveRefused(f"{', '.join(standing)}, after INIT too; find the cause before moving")

    def require_synchronised(self) -> None:
        """Refuse to move while the position may be wrong.

        Raises
        ------
        Unsynchronised
            Why it may be.
        """
        if self._trust.unsynchronised:
            raise Unsynchronised(self._trust.unsynchronised)

    def _silent_last(self) -> Iterator[int]:
        yield from sorted(range(len(self.axes)), key=lambda i: i in self.silent)


def _unhalted(axis: ControlledAxis, error: DriveError | TransportError) -> DriveError | TransportError | None:
    """What is to be said of an axis that could not be told to halt; nothing of one that stands in another's hands."""
    if isinstance(error, TransportError):
        return error
    try:
        sight = axis.look()
    except TransportError:
        return error
    if not axis.is_anothers:
        return error
    return DriveRefused(f"{axis.name}: {_ANOTHERS}") if abs(sight.velocity) >= STANDS_DEG_S else None
