"""What the answers of the axes mean: what is wrong, and the reading of the telescope."""

from collections.abc import Mapping, Sequence

from mounts.apo import supervision
from mounts.apo.axis import STANDS_DEG_S, Sight
from mounts.apo.axis_group import AxisGroup
from mounts.apo.settings import ApoSettings
from mounts.apo.stowing import Stowing
from mounts.apo.trust import Trust
from mounts.apo.ways import Ways
from mounts.drive import AxisReading, Reading

_ANYWHERE_DEG = 360.0
_ABRUPT = 10.0  # times the configured acceleration, with which a stop button or a limit switch may halt an axis
_DRY_S = 0.5  # by which a path may have ended before the axis is halted


class Watch:
    """Judges what the axes tell.

    Parameters
    ----------
    group : AxisGroup
        The axes.
    ways, stowing : Ways, Stowing
        What they were given.
    trust : Trust
        What is believed of their positions.
    settings : ApoSettings
        Their limits.
    """

    def __init__(self, group: AxisGroup, ways: Ways, stowing: Stowing, trust: Trust, settings: ApoSettings) -> None:
        self._group = group
        self._ways = ways
        self._stowing = stowing
        self._trust = trust
        self._settings = settings

    @property
    def leads(self) -> bool:
        """Whether any axis has something of ours to do."""
        return bool(self._stowing) or any(axis.queue.last for axis in self._group.axes)

    def trouble(self, sights: Mapping[int, Sight]) -> str:
        """What is wrong with an axis, in words; empty where nothing is."""
        return next(filter(None, (self._trouble_of(i, sight) for i, sight in sights.items())), "")

    def _trouble_of(self, i: int, sight: Sight) -> str:
        axis = self._group.axes[i]
        if text := self._restart_of(i, sight):
            return text
        if jumped := axis.confirming.jumped_deg:
            axis.confirming.jumped_deg = 0.0
            self._trust.lose_axis(
                i, f"{axis.name}: its position has jumped by {jumped:.4f}°, lost or set by somebody; `sync`"
            )
            return self._trust.unsynchronised
        if text := self._stowing.trouble(i, axis, sight) or supervision.off_its_path(axis, sight):
            return text
        if axis.queue.is_path and sight.time > axis.queue.ends + _DRY_S:
            return f"{axis.name}: its path ended {sight.time - axis.queue.ends:.1f} s ago; `goto` again"
        return ""

    def _restart_of(self, i: int, sight: Sight) -> str:
        """What it means that a controller has restarted, or that an answer which would have said so was lost."""
        axis, doubted, surely = self._group.axes[i], self._trust.unsynchronised, self._group.axes[i].word.restarted
        if surely:
            self._group.free(i)
        elif axis.bits_lost:
            axis.bits_lost = False
            self._trust.restarted(i, sight, led=axis.led, surely=False)
        if self._trust.unsynchronised != doubted:
            return self._trust.unsynchronised
        return f"{axis.name}: the controller has restarted and was initialised; `goto` again" if surely else ""

    def reading(self, sights: Sequence[Sight], *, follows: bool, braking: bool) -> Reading:
        """All axes, carried to one time.

        Parameters
        ----------
        sights : sequence of Sight
            Of every axis.
        follows : bool
            Whether a path is followed.
        braking : bool
            Whether the axes were halted and may move still.
        """
        now = max(sight.time for sight in sights)
        axes = tuple(self._reading_of(i, sight, now, braking=braking) for i, sight in enumerate(sights))
        self._trust.seen(now, [axis.counts for axis in axes], [axis.rate for axis in axes])
        clocks = filter(None, (axis.clock_trouble() for axis in self._group.axes))
        slewing = any(axis.slewing for axis in axes)
        moves = not braking and any(abs(axis.rate) >= STANDS_DEG_S for axis in axes)
        told = "slewing" if slewing else "tracking" if follows else "another host" if moves and not self.leads else ""
        return Reading(
            time=now,
            axes=axes,
            motion=(told,) if told else (),
            limits=supervision.limits(self._group.axes),
            alarms=(*supervision.alarms(self._group.axes), *clocks),
            tracking=follows and not slewing,
            unsynchronised=self._trust.unsynchronised,
        )

    def _reading_of(self, i: int, sight: Sight, now: float, *, braking: bool) -> AxisReading:
        late = now - sight.time
        carried = sight.position + sight.velocity * late
        axis = self._group.axes[i]
        path = axis.queue.at(now)
        unsure = sight.uncertainty + self._unseen(i, sight.velocity, late, braking=braking)
        if path:  # as far as the clock is known by which it is followed
            unsure += abs(path[0] - carried) + abs(path[1] - sight.velocity) * axis.offset.uncertainty_s
        unsure += _ANYWHERE_DEG if i in self._trust.lost_axes else self._trust.unsure[i]
        slews = self._ways.arrivals[i] is not None or i in self._stowing
        return AxisReading(carried, unsure, sight.velocity, slews)

    def _unseen(self, i: int, velocity: float, late: float, *, braking: bool) -> float:
        """By how far an axis may be off the line on which it was seen, degrees: it may have been stopped since.

        One that was halted may be on its way back already.
        """
        stopped = 0.5 * _ABRUPT * self._settings.axes[i].acceleration_deg_s2 * late**2
        return stopped if braking else min(abs(velocity) * late, stopped)
