"""SET.POSITION on an axis that was halted for it: taken as soon as the axis has come to rest, and read back."""

from mounts.apo.axis import ControlledAxis
from mounts.errors import DriveRefused

_SLOW_DEG_S = 0.1  # of an axis that may be synchronised while it tracks
_BRAKING = 1000  # looks, each as long as an exchange, in which an axis must have come to rest
_READ_BACK_DEG = 2e-5


def at_slow_speed(axis: ControlledAxis, time: float) -> float:
    """Where an axis is at POSIX `time`, degrees, if it is slow enough to be halted for a sync.

    Raises
    ------
    DriveRefused
        It is faster.
    TransportError
        It does not answer.
    """
    path = axis.queue.at(time)
    if path is None:
        sight = axis.look()
        path = sight.position + sight.velocity * (time - sight.time), sight.velocity
    if abs(path[1]) > _SLOW_DEG_S:
        raise DriveRefused(
            f"an axis moves at {abs(path[1]):.3f}°/s, at most {_SLOW_DEG_S}°/s is halted for a sync; `stop`"
        )
    return path[0]


def declare(axis: ControlledAxis, moved: float) -> None:
    """Add to the position of an axis as soon as its controller takes it: it may still swing back from a stop.

    Raises
    ------
    DriveRefused
        It does not come to rest, or reads back otherwise.
    TransportError
        It does not answer.
    """
    for _ in range(_BRAKING):
        target = axis.look().position + moved
        try:
            axis.set_position(target)
        except DriveRefused as error:
            refused = error
            continue
        if abs(axis.look().position - target) > _READ_BACK_DEG:
            raise DriveRefused(f"{axis.name} does not read back {target:.5f}°; `sync` again")
        return
    raise refused
