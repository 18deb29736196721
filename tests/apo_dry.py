"""Whether a path that ran dry is the driver's fault: judged by what the bench did, not by what came of it.

An exchange is eaten where the bench took its command or its answer away, or the controller could not obey: it boots,
or somebody else has its semaphore. A command that the controller did not understand is not eaten; nor is a node that
was never sent.
"""

from collections.abc import Sequence
from typing import NamedTuple

from mounts.apo.following import AHEAD_S
from mounts.apo.tracking_nodes import LONGEST_S

POLL_S = 1.0
"""Between two looks of a session that tracks."""
REACHED_S = 3.0
"""In which a line that eats nothing has been given a node: a poll, and the node's own lead."""
KEPT_S = AHEAD_S - POLL_S
"""For which the buffer of an axis that tracks lasts at least: what came earlier is no reason."""
LEADS = frozenset({"MOVE", "DRIFT", "INIT", "STOP", "P"})
"""Commands that give an axis a way, or end the one it has."""


class Exchange(NamedTuple):
    """One thing said to a controller: when, its command, and whether the bench ate it."""

    time: float
    command: str
    eaten: bool = False


def could_have_been_given(said: Sequence[Exchange], dry: float) -> bool:
    """Whether an axis could have been given a way, or been halted, before its path ran out.

    It could where the line carried all that was said for 3 s on end, and where something was carried early enough
    and the driver did not try to lead the axis in the 5 s after it, in which a node is due.

    Parameters
    ----------
    said : sequence of Exchange
        All that was said to the controller, in order.
    dry : float
        POSIX seconds at which its path ran out.
    """
    return _was_carried(said, dry) or _was_left(said, dry)


def _was_carried(said: Sequence[Exchange], dry: float) -> bool:
    """Whether nothing was eaten for long enough, of the time since the buffer was full, or since it was flushed.

    Such a stretch begins with an answer and ends with the first that is eaten; where nobody asks it goes on.
    """
    since: float | None = None
    flushed = float("-inf")
    for each in said:
        if each.time > dry:
            break
        if not each.eaten:
            since = each.time if since is None else since
            flushed = each.time if each.command == "DRIFT" else flushed
            continue
        if since is not None and each.time - max(since, flushed, dry - KEPT_S) >= REACHED_S:
            return True
        since = None
    return since is not None and dry - max(since, dry - KEPT_S) >= REACHED_S


def _was_left(said: Sequence[Exchange], dry: float) -> bool:
    """Whether an axis that could be talked to was not even told where to go.

    A node that was eaten before may count as given, so that the next one is due only after it.
    """
    led = [each for each in said if each.command in LEADS]
    heard = (each.time for each in said if not each.eaten and dry - KEPT_S <= each.time <= dry - LONGEST_S)
    return any(
        not any(abs(each.time - at) <= LONGEST_S and (each.eaten or each.time > at) for each in led) for at in heard
    )
