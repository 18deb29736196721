"""The ways that the axes are given: from a DRIFT, whose answer says on what line the axis goes on, by nodes.

A node whose answer was lost, or that came too late, leaves the buffer in doubt: DRIFT flushes it, and the way is
planned anew.
"""

import math
from collections.abc import Callable

from mounts.apo.axis import Sight
from mounts.apo.axis_group import AxisGroup
from mounts.apo.meeting import Meeting, Where, excursion, meet, ramp
from mounts.apo.node_queue import PathNode
from mounts.apo.settings import LEAD_S, ApoSettings
from mounts.apo.slew_model import models_of
from mounts.drive import AxisSlew
from mounts.errors import DriveRefused
from transports.errors import TransportError

_MARGIN_S = 0.1  # for the solving
_SLEW_NODES = 9  # of a slew at most, with the one that holds it
_START_EXCHANGES = _SLEW_NODES + 4  # with two looks, a DRIFT, and one more
_HOLD_S = 5.0  # an axis that landed at rest is held by a node until MOVE lets it stand
_LANDED_S = 0.1
_ATTEMPTS = 3
_ANEW = 2.0  # times as long as a call may take, for a way given anew; till then no other path may run out
_STANDS = 1e-6  # deg/s; the last node lies on the grid of times, up to 0.5 µs before the end


class Ways:
    """The way that each axis was given last.

    Parameters
    ----------
    group : AxisGroup
        The axes.
    settings : ApoSettings
        Their bounds, and how many nodes they hold.

    Attributes
    ----------
    models : tuple of ApoSlewModel
        The law of each axis.
    arrivals : list
        POSIX seconds at which each slew under way arrives; None for an axis that does not slew.
    """

    def __init__(self, group: AxisGroup, settings: ApoSettings) -> None:
        self._group = group
        self._settings = settings
        self.models = models_of(settings)
        self.arrivals: list[float | None] = [None] * len(group.axes)
        self._holding = [False] * len(group.axes)  # at the end of a slew that ended at rest
        self._planned: dict[int, Callable[[PathNode, float], Meeting]] = {}  # the way of each axis, from any drift

    @property
    def latency_s(self) -> float:
        """Seconds until a slew begins: the lead of its first node, and the line time of all that is sent."""
        return LEAD_S + _MARGIN_S + sum(_START_EXCHANGES * axis.exchange_s for axis in self._group.axes)

    def slew(self, i: int, slew: AxisSlew, time: float) -> float:
        """Bring an axis to the target of a slew; return when it begins.

        Raises
        ------
        DriveRefused, TransportError
            The way leaves the travel, or the controller takes no nodes; it does not answer.
        """
        nodes = self.meet(i, _line_of(slew, time), slew.arrival, slew.max_rate)
        self.arrivals[i] = nodes[-1].time
        self._holding[i] = slew.rate_after == 0.0
        return nodes[0].time

    def meet(
        self, i: int, where: Where, arrival: float | None = None, max_rate: float | None = None
    ) -> tuple[PathNode, ...]:
        """Bring an axis onto a path by nodes that its controller has taken; raises as `slew`."""
        model = self.models[i]
        model = model if max_rate is None or max_rate >= model.max_rate else model.limited(max_rate)

        def planned(line: PathNode, earliest: float) -> Meeting:
            return meet(self._settings.axes[i], line, earliest, where, arrival, model.meeting)

        return self._led_by(i, planned)

    def ramp(self, i: int, rate: float, seconds: float) -> tuple[PathNode, ...]:
        """Bring an axis to a velocity, and after so many seconds of it to rest, if any; raises as `slew`."""
        settings, profile = self._settings.axes[i], self.models[i].profile

        def planned(line: PathNode, earliest: float) -> Meeting:
            if seconds:
                return excursion(settings, line, earliest, rate, seconds, profile)
            return ramp(settings, line, earliest, rate, profile)

        return self._led_by(i, planned)

    def settle(self, i: int, sight: Sight) -> None:
        """Go on with what an axis was given: nodes that wait for room, a slew that has landed; raises as `slew`."""
        axis = self._group.axes[i]
        try:
            axis.feed(sight.time, self._settings.max_nodes)
        except (DriveRefused, TransportError):
            self._led_by(i, self._planned[i])
        due = self.arrivals[i]
        if due is not None and sight.time >= due:
            self.arrivals[i] = None
        if self._holding[i] and self.arrivals[i] is None and sight.time >= axis.queue.ends - _HOLD_S + _LANDED_S:
            axis.halt()
            self._holding[i] = False

    def end(self) -> None:
        """No axis slews any more: all were halted."""
        self.arrivals = [None] * len(self.arrivals)
        self.go_on()

    def go_on(self) -> None:
        """What is given now goes on from where the slews end."""
        self._holding = [False] * len(self._holding)

    def _led_by(self, i: int, planned: Callable[[PathNode, float], Meeting]) -> tuple[PathNode, ...]:
        """Let an axis drift, plan from there, and give its nodes; anew where one of them is in doubt."""
        axis = self._group.axes[i]
        self._planned[i] = planned
        line_time = _SLEW_NODES * axis.exchange_s
        for attempt in range(_ATTEMPTS):
            line = axis.drift()
            earliest = line.time + (LEAD_S + line_time) * (1.0 + 0.5 * attempt) + _MARGIN_S / 2.0
            meeting = planned(line, earliest)
            try:
                axis.send_path(_held(meeting.nodes), self._settings.max_nodes)
            except (DriveRefused, TransportError) as error:
                if attempt == _ATTEMPTS - 1 or self._others_end(i) < line.time + _ANEW * self._settings.call_s:
                    raise
                if isinstance(error, DriveRefused) and line.velocity == 0.0:  # something may have halted it unseen
                    axis.look()
                    axis.must_init = True
                    self._group.free(i)
            else:
                if self.arrivals[i] is not None:  # a slew that had to be planned anew
                    self.arrivals[i] = meeting.arrival
                return meeting.nodes
        raise AssertionError("unreachable: the last attempt returns or raises")

    def _others_end(self, i: int) -> float:
        """POSIX seconds at which the first path of the other axes runs out."""
        others = (axis.queue for k, axis in enumerate(self._group.axes) if k != i)
        return min((queue.ends for queue in others if queue.is_path), default=math.inf)


def _held(nodes: tuple[PathNode, ...]) -> tuple[PathNode, ...]:
    """The nodes of a way, with one more behind an end at rest."""
    last = nodes[-1]
    return (*nodes, PathNode(last.time + _HOLD_S, last.position, 0.0)) if abs(last.velocity) < _STANDS else nodes


def _line_of(slew: AxisSlew, time: float) -> Where:
    """The path of a slew's target: where it is at the planned arrival, going on at its rate."""
    due = time if slew.arrival is None else slew.arrival
    return lambda when: (slew.target + slew.rate_after * (when - due), slew.rate_after)
