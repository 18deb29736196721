"""Keeping the axes on a path: their buffers filled with its nodes, and the path changed under way.

The buffer holds ten seconds, so that as long a silence of a line does no harm. What a person changes must not wait
for them to pass: a small displacement of what has been given is one `+MOVE`, which later nodes, taken from the new
path, contain; a larger one is a new meeting.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import cache, partial
from math import copysign

from mounts.apo.axis import ControlledAxis, Sight
from mounts.apo.meeting import Where
from mounts.apo.node_queue import PathNode
from mounts.apo.settings import ApoSettings, AxisSettings
from mounts.apo.slew_profile import MARGIN
from mounts.apo.tracking_nodes import interval_s, strays_deg
from mounts.drive import AxisPath
from mounts.errors import DriveRefused
from transports.errors import TransportError

AHEAD_S = 10.0  # that the buffer holds
SOONEST_S = 1.5  # by which a node is sent ahead
_PERIOD_S = 1.0
_SAME_DEG = 1.4e-7  # 0.5 mas, within which a path is the old one
_BLENDED_DEG = 1.0 / 3600.0  # by which the next node may lead over to a path that has changed
_SLIGHT_DEG = 0.05 / 3600.0  # likewise, of a slew that would arrive later if its way were planned anew
_DISPLACED_DEG = 30.0 / 3600.0  # at most, by one +MOVE
_SHARE = 2.0  # of the time that a node takes, for all else that is said
_STRAYS_DEG = 0.05 / 3600.0  # at most, where the lines do not carry the nodes that a milliarcsecond takes
_KNOWN_S = 1e-4  # to which a clock is known
_SHOWS_DEG = 0.01 / 3600.0  # by which one that is off must have displaced the axis
_SPARED = 0.5 * (1.0 - MARGIN)  # of the top speed, by which a slew that cruises can be displaced in a second
_CRUISES_S = 3.0
_ALONG_DEG_S = 1e-3
_MOVING_AHEAD_S = 3.0  # at a speed of one's own, which ends soon after the host
_MOVING_STEP_S = 1.0
_AT_SPEED_S = 4.0  # with the way to rest behind, where a controller would go on for ever
_RENEWED_S = 2.0  # by which that is given anew before it begins

Meet = Callable[[int, Where], Sequence[PathNode]]


class Follower:
    """Fills the buffers of all axes.

    Parameters
    ----------
    axes : tuple of ControlledAxis
        The axes.
    settings : ApoSettings
        Their bounds, and how many nodes they hold.
    meet : callable
        Brings an axis onto a path.
    ramp : callable
        Brings an axis to a velocity, and to rest after so many seconds of it; 0 for not.
    """

    def __init__(
        self,
        axes: tuple[ControlledAxis, ...],
        settings: ApoSettings,
        meet: Meet,
        ramp: Callable[[int, float, float], Sequence[PathNode]],
    ) -> None:
        self._axes = axes
        self._settings = settings
        self._meet = meet
        self._ramp = ramp
        self._path: AxisPath | None = None
        self._rates: tuple[float, ...] | None = None
        self._given = [0.0] * len(axes)  # POSIX seconds of the last node that was given, taken or not
        self._doubtful = [False] * len(axes)
        self._lines: dict[int, PathNode] = {}  # to move along at a speed of one's own

    @property
    def active(self) -> bool:
        """Whether a path is followed."""
        return self._path is not None or self._rates is not None

    def end(self) -> None:
        """Follow nothing any more."""
        self._path = self._rates = None
        self._given = [0.0] * len(self._axes)
        self._doubtful = [False] * len(self._axes)

    def follow(self, path: AxisPath, time: float) -> float:
        """Fill the buffers of all axes along a path; return the seconds until that is due again.

        Raises
        ------
        DriveRefused
            The path leaves an axis's travel, or is too fast for it.
        TransportError
            An axis did not answer, the others were served all the same.
        """
        changed, self._path, self._rates = path is not self._path, path, None
        # Nodes and their intervals are asked of a path at the same times; a rotator may have no way of its own.
        wheres = self._wheres(path)
        lost = self._served({i: partial(self._prepare, i, where, time, changed) for i, where in wheres.items()})
        return self._filled({i: where for i, where in wheres.items() if i not in lost}, time, lost)

    def go_on(self, answering: Mapping[int, Sight]) -> None:
        """Give axes that answer, as they were seen, nodes of the path that is followed, while another is silent.

        Raises
        ------
        DriveRefused, TransportError
            As for `follow`.
        """
        if self._path is None or not answering:
            return
        able = {i: where for i, where in self._wheres(self._path).items() if i in answering and self._is_led(i)}
        self._filled(able, max(sight.time for sight in answering.values()), {})

    def _is_led(self, i: int) -> bool:
        """Whether an axis has a path that can be gone on with."""
        axis = self._axes[i]
        return axis.queue.is_path and not (self._doubtful[i] or axis.clock_stepped or axis.waiting)

    def _wheres(self, path: AxisPath) -> dict[int, Where]:
        return {i: cache(partial(path.axis_at, i)) for i in range(min(len(self._axes), path.axes))}

    def keep_moving(self, rates: Sequence[float], time: float) -> float:
        """Fill the buffers along straight lines at these rates, from wherever the axes are."""
        changed, self._path, self._rates = tuple(rates) != self._rates, None, tuple(rates)
        self._served({i: partial(self._keep, i, rate, time, changed) for i, rate in enumerate(rates)}, final=True)
        return _PERIOD_S

    @staticmethod
    def _served(work: Mapping[int, Callable[[], None]], *, final: bool = False) -> dict[int, TransportError]:
        """Do what is to be done for each axis, whatever becomes of another one; return those that did not answer."""
        lost: dict[int, TransportError] = {}
        for i, each in work.items():
            try:
                each()
            except TransportError as error:
                lost[i] = error
        if final and lost:
            raise lost[min(lost)]
        return lost

    def _prepare(self, i: int, where: Where, time: float, changed: bool) -> None:
        """Let nodes of the path follow those that an axis was given, by a way onto it where that is needed."""
        axis = self._axes[i]
        if axis.waiting and not self._doubtful[i]:  # the slew is still being given, as there is room
            return
        if self._must_meet(axis, i, time) or not self._leads_over(axis, where, time, changed=changed):
            self._doubtful[i] = True  # until it has met
            self._given[i] = self._meet(i, where)[-1].time
            self._doubtful[i], axis.clock_stepped = False, False
            if self._lacks(i, axis.answered + AHEAD_S, axis.answered):  # what another axis needs may last longer
                self._give_next(i, where, axis.answered, partial(self._interval_s, i, where))
        elif not changed:
            self._keep_time(i, where, time)

    def _filled(self, wheres: dict[int, Where], time: float, lost: dict[int, TransportError]) -> float:
        """Give the axes nodes in turn, the one first that has least, for a second at most, as a look is due then."""
        now = time
        while now < time + _PERIOD_S:
            lacking = [i for i in wheres if self._lacks(i, now + AHEAD_S, now)]
            if not lacking:
                break
            i = min(lacking, key=lambda i: self._given[i])
            try:
                self._give_next(i, wheres[i], now, partial(self._interval_s, i, wheres[i]))
            except TransportError as error:
                lost[i] = error
                del wheres[i]
            else:
                now = self._axes[i].answered
        else:
            return 0.0
        if lost:
            raise lost[min(lost)]
        return _PERIOD_S

    def _interval_s(self, i: int, where: Where, when: float) -> float:
        """Seconds to the next node: as the path needs it, and as the lines carry it."""
        needed, carried = interval_s(where, when), _SHARE * sum(axis.exchange_s for axis in self._axes)
        if carried <= needed:
            return needed
        if (strays := strays_deg(where, when, carried)) > _STRAYS_DEG:
            raise DriveRefused(
                f"{self._axes[i].name}: the lines carry a node in {carried:.1f} s, and the path needs one in "
                f"{needed:.1f} s: it would be off by {3600.0 * strays:.2f}″, more than {3600.0 * _STRAYS_DEG:g}″; "
                "use faster lines, or `goto` a slower target"
            )
        return carried

    def _must_meet(self, axis: ControlledAxis, i: int, time: float) -> bool:
        """Whether no node can follow those given: they are in doubt, or run dry before one is there."""
        return self._doubtful[i] or axis.clock_stepped or axis.queue.ends <= time + axis.exchange_s

    def _leads_over(self, axis: ControlledAxis, where: Where, time: float, *, changed: bool) -> bool:
        """Whether nodes of the path can follow those given, which are displaced where that is enough."""
        if not changed:
            return axis.queue.ends >= time + AHEAD_S or abs(_off(axis.queue.last, where)) <= _BLENDED_DEG
        ahead = axis.queue.ahead(time)
        off = [_off(node, where) for node in (ahead[0], ahead[len(ahead) // 2], ahead[-1])]
        shift = off[-1]
        if abs(shift) <= _SAME_DEG:
            return True
        if max(off) - min(off) > _SLIGHT_DEG:  # it is on its way there
            return max(abs(shift), _bulge(ahead[-1], where)) <= _SLIGHT_DEG
        if abs(shift) > _DISPLACED_DEG:
            return False
        axis.displace(shift)
        return True

    def _keep_time(self, i: int, where: Where, time: float) -> None:
        """Displace what was given by a clock that is known better now, where that shows.

        An axis that slews has nothing to spare but where it cruises: there it is displaced a little at a time.
        """
        axis = self._axes[i]
        early, last = axis.early_s, axis.queue.last
        if last is None or abs(early) < _KNOWN_S or abs(early * last.velocity) < _SHOWS_DEG:
            return
        most = _DISPLACED_DEG
        if not _is_joined(axis.queue.at(time), where(time)):
            if not axis.queue.cruises(time, _CRUISES_S):
                return
            most = _SPARED * axis.settings.max_speed_deg_s * _PERIOD_S
        self._doubtful[i] = True  # until it is answered
        axis.come_in_time(last.velocity, copysign(min(abs(early), most / abs(last.velocity)), early))
        self._doubtful[i] = False

    def _lacks(self, i: int, until: float, time: float) -> bool:
        """Whether an axis is to be given a node, and has room for it."""
        axis = self._axes[i]
        if axis.waiting:
            return False
        self._given[i] = max(self._given[i], axis.queue.ends)
        return self._given[i] < until and axis.queue.pending(time) < self._settings.max_nodes - 1

    def _give_next(self, i: int, where: Where, time: float, interval: Callable[[float], float]) -> None:
        axis, last = self._axes[i], self._given[i]
        when = max(last + interval(last), time + SOONEST_S)
        node = PathNode(when, *where(when))
        _require_possible(axis.settings, node)
        self._given[i] = when
        axis.send(node)

    def _keep(self, i: int, rate: float, time: float, changed: bool) -> None:
        axis = self._axes[i]
        goes_on = rate != 0.0 and self._settings.on_expiry == "extrapolate"  # so the way to rest is given beforehand
        ending = goes_on and self._given[i] < time + _RENEWED_S
        if changed or self._must_meet(axis, i, time) or ending:
            self._doubtful[i] = True
            nodes = self._ramp(i, rate, _AT_SPEED_S if goes_on else 0.0)
            self._lines[i] = max((node for node in nodes if node.velocity == rate), key=lambda node: node.time)
            self._given[i] = self._lines[i].time
            self._doubtful[i], axis.clock_stepped = False, False
        if not goes_on:
            while self._lacks(i, time + _MOVING_AHEAD_S, time):
                self._give_next(i, self._line(i), time, lambda _: _MOVING_STEP_S)

    def _line(self, i: int) -> Where:
        line = self._lines[i]
        return lambda when: (line.at(when), line.velocity)


def _off(node: PathNode | None, where: Where) -> float:
    """Degrees by which a path has left a node."""
    return 0.0 if node is None else where(node.time)[0] - node.position


def _bulge(node: PathNode, where: Where) -> float:
    """Degrees by which the cubic to the next node leaves a path for a velocity that is not the path's.

    Of velocities that differ by v at one end of an interval h, 4/27 v h: the peak of Hermite's u (1 - u)².
    """
    return 4.0 / 27.0 * abs(where(node.time)[1] - node.velocity) * interval_s(where, node.time)


def _is_joined(here: tuple[float, float] | None, there: tuple[float, float]) -> bool:
    """Whether an axis goes along with its path."""
    return here is not None and abs(here[0] - there[0]) <= _DISPLACED_DEG and abs(here[1] - there[1]) <= _ALONG_DEG_S


def _require_possible(axis: AxisSettings, node: PathNode) -> None:
    """Refuse a node that leaves the travel, with the stop that must still be possible, or is too fast."""
    if abs(node.velocity) > axis.max_speed_deg_s:
        raise DriveRefused(
            f"{axis.name}: the path needs {abs(node.velocity):.3f}°/s, the axis has {axis.max_speed_deg_s:g}°/s; "
            "`goto` it again after that"
        )
    stop = node.velocity**2 / (2.0 * axis.acceleration_deg_s2) * copysign(1.0, node.velocity)
    reach = node.position + stop
    if not axis.lowest_deg <= reach <= axis.highest_deg and not _comes_back(axis, node):
        raise DriveRefused(
            f"{axis.name}: the path leads to {node.position:.4f}°, and with the way to stop to {reach:.4f}°, outside "
            f"{axis.lowest_deg:g}° to {axis.highest_deg:g}°; `goto` another target, or this one by another way"
        )


def _comes_back(axis: AxisSettings, node: PathNode) -> bool:
    """Whether it moves away from the limit that it is beyond."""
    return node.velocity < 0.0 if node.position > axis.highest_deg else node.velocity > 0.0
