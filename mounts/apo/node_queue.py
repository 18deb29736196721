"""The nodes that a controller has been given and has not passed: how long they last, and where they lead."""

import math
from bisect import bisect_right
from dataclasses import dataclass, replace


@dataclass(frozen=True)
class PathNode:
    """Where an axis must be, degrees, how fast, degrees per second, and when, POSIX seconds."""

    time: float
    position: float
    velocity: float

    def at(self, time: float) -> float:
        """Where the axis would be at `time` if it went on at this velocity."""
        return self.position + self.velocity * (time - self.time)


_SAME_DEG_S = 1e-5  # by which velocities differ that are meant to be the same


class NodeQueue:
    """What is left of an axis's path.

    Nodes that were passed are kept for a moment, as an answer on its way tells of the time before it.
    """

    _KEPT_S = 10.0

    def __init__(self) -> None:
        self._line: PathNode | None = None  # on which the axis drifts until the first node
        self._nodes: list[PathNode] = []
        self._times: list[float] = []  # of them
        self._forgotten = False  # whether there were nodes before the first

    def begin(self, line: PathNode) -> None:
        """Begin anew: the axis goes on along a line until the first node."""
        self._line, self._nodes, self._times, self._forgotten = line, [], [], False

    def clear(self) -> None:
        """Nothing is left: the axis was halted."""
        self._line, self._nodes, self._times, self._forgotten = None, [], [], False

    def append(self, node: PathNode) -> None:
        """Add a node that the controller has taken."""
        self._nodes.append(node)
        self._times.append(node.time)

    def forget_before(self, time: float) -> None:
        """Forget nodes long passed, but the one from which the path goes on."""
        first = bisect_right(self._times, time - self._KEPT_S) - 1
        if first > 0:
            del self._nodes[:first], self._times[:first]
            self._forgotten = True

    def shift(self, degrees: float) -> None:
        """Move the whole path, as `+MOVE` does."""
        self._nodes = [replace(node, position=node.position + degrees) for node in self._nodes]
        self._line = self._line and replace(self._line, position=self._line.position + degrees)

    def retime(self, seconds: float) -> None:
        """Let the whole path come so much later: the controller's clock is another than it was taken to be."""
        self._nodes = [replace(node, time=node.time + seconds) for node in self._nodes]
        self._times = [node.time for node in self._nodes]

    @property
    def last(self) -> PathNode | None:
        """The last node; the line on which it drifts where there is none yet; None where nothing is left."""
        return self._nodes[-1] if self._nodes else self._line

    @property
    def is_path(self) -> bool:
        """Whether there are nodes, and not a drift alone."""
        return bool(self._nodes)

    @property
    def ends(self) -> float:
        """POSIX seconds at which the path runs dry; −inf where there is none."""
        return self._nodes[-1].time if self._nodes else -math.inf

    def rests_from(self, time: float) -> bool:
        """Whether all that is left of it from a time on is at rest."""
        return not any(node.velocity for node in self.ahead(time))

    def cruises(self, time: float, seconds: float) -> bool:
        """Whether it goes on without acceleration from a time for so many seconds, or longer."""
        place = bisect_right(self._times, time)
        if not 0 < place < len(self._nodes):
            return False
        one, two = self._nodes[place - 1 : place + 1]
        return abs(two.velocity - one.velocity) < _SAME_DEG_S and two.time >= time + seconds

    def pending(self, time: float) -> int:
        """How many nodes are still to be passed at `time`."""
        return len(self._nodes) - bisect_right(self._times, time)

    def ahead(self, time: float) -> tuple[PathNode, ...]:
        """The nodes still to be passed at `time`."""
        return tuple(self._nodes[bisect_right(self._times, time) :])

    def drifted_s(self, time: float) -> float:
        """For how long it has been on the line of a DRIFT by then, seconds; 0 where nodes say where it is."""
        known = self._line is not None and not self._forgotten and bisect_right(self._times, time) == 0
        return max(0.0, time - self._line.time) if known and self._line else 0.0

    def at(self, time: float) -> tuple[float, float] | None:
        """Position and velocity that the path has at a time; None where it says nothing."""
        place = bisect_right(self._times, time)
        if place == 0:
            known = self._line is not None and not self._forgotten
            return (self._line.at(time), self._line.velocity) if known and self._line else None
        if place == len(self._nodes):
            last = self._nodes[-1]
            return (last.position, last.velocity) if time == last.time else None
        return between(self._nodes[place - 1], self._nodes[place], time)


def between(one: PathNode, two: PathNode, time: float) -> tuple[float, float]:
    """Position and velocity at `time` on the cubic through two nodes, by Hermite's form."""
    span = two.time - one.time
    if span <= 0.0:
        return two.position, two.velocity
    u = (time - one.time) / span
    rise, lead, trail = two.position - one.position, one.velocity * span, two.velocity * span
    c2, c3 = 3.0 * rise - 2.0 * lead - trail, lead + trail - 2.0 * rise
    position = one.position + u * (lead + u * (c2 + u * c3))
    return position, (lead + u * (2.0 * c2 + 3.0 * u * c3)) / span
