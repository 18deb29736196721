"""Setting the clock of a controller, which it takes from its own NTP server, and seeing what came of it."""

from dataclasses import dataclass

from mounts.apo.axis import ControlledAxis
from mounts.apo.commands import Kind
from mounts.errors import DriveRefused

_LOOKS = 8  # each bounds the offset from both sides


@dataclass(frozen=True)
class ClockSet:
    """How far a clock was off before it was set and after, seconds; None while it was not set."""

    axis: str
    before_s: float | None
    after_s: float
    uncertainty_s: float


def require_settable(kind: Kind) -> None:
    """Refuse controllers that have no command for it.

    Raises
    ------
    DriveRefused
        Those of the 3.5 m telescope have none.
    """
    if kind != "sdss":
        raise DriveRefused(
            f"controllers of kind {kind} have no command that sets their clocks: set them as their manual says; "
            "`drive show clock` tells how far they are off"
        )


def set_clock(axis: ControlledAxis) -> ClockSet:
    """Have a clock set, initialise a controller that was halted for its clock, and look how far it is off then.

    Raises
    ------
    DriveRefused, TransportError
        It is refused, or is not set afterwards, or not right; the controller does not answer.
    """
    axis.look()
    before = None if axis.clock_trouble() and not axis.offset.known else axis.offset.value
    axis.asked(lambda: axis.controller.tell("SET.TIME"))
    axis.offset.forget()
    axis.forget_path()
    axis.look()
    if axis.must_init:
        axis.initialise()
    for _ in range(_LOOKS):
        axis.look()
    axis.clock_stepped = False
    if text := axis.clock_trouble():
        raise DriveRefused(f"{text.partition(';')[0]}, after SET.TIME too; check the controller's NTP server")
    return ClockSet(axis.name, before, axis.offset.value, axis.offset.uncertainty_s)
