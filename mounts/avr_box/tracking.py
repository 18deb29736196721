"""Keeping both axes on a path: axis 1 by `+`, `-` and short moves, axis 2 by `<`, `>` and short moves."""

import math

from mounts.avr_box import commands, following, guiding
from mounts.avr_box.axis import BoxAxis
from mounts.avr_box.box import Box
from mounts.avr_box.guiding import GuideRates
from mounts.avr_box.moves import Moves
from mounts.avr_box.settings import AvrSettings
from mounts.avr_box.tick_clock import TickClock
from mounts.avr_box.tick_watch import TickWatch
from mounts.drive import AxisPath

RECHECK_S = 0.5
_FOLLOW_S = 5.0  # at most until a path is looked at again
_LEAST_S = 0.05
_REACHED = 0.9  # of what guiding reaches, where no encoder sees moves beside it
_STEPPED = 60.0  # microsteps a second of axis 2, which single ones hold and catch up with, 6.5″


class Tracker:
    """Keeps the axes of one box on a path.

    Parameters
    ----------
    box : Box
        Gets the commands.
    settings : AvrSettings
        Of what it is capable.
    axes : tuple of BoxAxis
        Are kept.
    moves : Moves
        Sends the short ones.
    ticks, watch : TickClock, TickWatch
        Tell when a tick comes.
    """

    def __init__(
        self,
        box: Box,
        settings: AvrSettings,
        axes: tuple[BoxAxis, BoxAxis],
        moves: Moves,
        ticks: TickClock,
        watch: TickWatch,
    ) -> None:
        self._box, self._settings, self._axes = box, settings, axes
        self._moves, self._ticks, self._watch = moves, ticks, watch
        self._guided_last = -math.inf

    @property
    def rates(self) -> GuideRates:
        """The rates to which axis 1 can be trimmed, by the crystal as it is known."""
        return GuideRates.of(self._settings.own_rate, self._settings.guide_counts, self._ticks.crystal)

    def follow(self, path: AxisPath) -> float:
        """Do what is due; return the seconds until it must be looked at again."""
        others = self._follow_two(path) if path.axes > 1 else math.inf
        return min(self._follow_one(path), others, _FOLLOW_S)

    def _follow_one(self, path: AxisPath) -> float:
        axis, now, rates = self._axes[0], self._box.now(), self.rates
        ahead, wanted = _ahead(axis, path, now)
        alone = bool(wanted) and self._settings.blind and not rates.reach(wanted, _REACHED)
        band = following.band_of(wanted, rates, alone=alone)
        if now < axis.free_at:
            return axis.free_at - now
        drift = axis.at(now).rate * axis.sign - wanted
        if not band.low <= ahead <= band.high:
            return self._move_back(ahead, wanted, band, alone=alone)
        if wanted and not alone and now >= axis.guided_until:
            self._guide(path, rates)
            now = self._box.now()
            ahead, wanted = _ahead(axis, path, now)
            drift = axis.at(now).rate * axis.sign - wanted
            due = axis.guided_until - now if now < axis.guided_until else guiding.EVERY_S / 2.0
        else:
            due = axis.guided_until - now if now < axis.guided_until else math.inf
        return max(_LEAST_S, min(due, following.leaves_in(ahead, drift, band)))

    def _move_back(self, ahead: float, wanted: float, band: following.Band, *, alone: bool) -> float:
        """Bring axis 1 back into its band; return the seconds until it must be looked at again.

        Where no encoder sees it, letters hold it, and tracking brings it on; or the next move ends the one before.
        """
        axis = self._axes[0]
        if self._settings.blind and wanted == 0.0:
            if ahead > band.high:
                self._moves.back(axis)
            return max(RECHECK_S, axis.free_at - self._box.now())
        half = following.move_back(ahead - (0.0 if alone else self._moves.lag), wanted, band, axis.duration)
        self._moves.send_short(axis, half * axis.sign, others=alone)
        return axis.free_at - self._box.now()

    def _guide(self, path: AxisPath, rates: GuideRates) -> None:
        """Send `+` or `-` in the middle of a tick, where that is due."""
        axis, tick, now = self._axes[0], self._ticks.tick_s, self._box.now()
        if self._guided_last + guiding.EVERY_S > now and rates.reach(_ahead(axis, path, now)[1]):
            return
        begin = self._middle_of_a_tick()
        ahead, wanted = _ahead(axis, path, begin)
        pulse = guiding.pulse(ahead, wanted, rates, self._ticks.since_tick(begin), tick)
        self._guided_last = begin
        if pulse is None:
            return
        self._send_guide(pulse.ticks, faster=pulse.sign > 0)

    def guide_for(self, ticks: int) -> float:
        """Make axis 1 faster for so many ticks; return how many seconds that is."""
        self._middle_of_a_tick()
        return self._send_guide(ticks, faster=True)

    def _middle_of_a_tick(self) -> float:
        """Wait for it; return when a command that is sent now comes, POSIX seconds."""
        self._watch.freshen()
        lead = 2 * self._box.byte_s + self._box.delay_s
        since = self._ticks.since_tick(self._box.now() + lead)
        self._box.pause(self._box.now() + guiding.sent_after(since, self._ticks.tick_s))
        return self._box.now() + lead

    def _send_guide(self, ticks: int, *, faster: bool) -> float:
        axis, rates = self._axes[0], self.rates
        begin = self._box.send(commands.faster(ticks) if faster else commands.slower(ticks))
        lasts = ticks * self._ticks.tick_s - self._ticks.since_tick(begin)
        axis.guided(axis.sign * (rates.faster if faster else rates.slower), begin, lasts)
        return lasts

    def _follow_two(self, path: AxisPath) -> float:
        axis, now = self._axes[1], self._box.now()
        busy = max(axis.free_at, axis.guided_until) - now
        if busy > 0.0:
            return busy
        ahead, wanted = _ahead(axis, path, now)
        slow = self._settings.blind and abs(wanted) < _STEPPED
        if steps := following.single_steps(ahead, math.inf) if slow else following.single_steps(ahead):
            self._moves.send_steps(axis, steps)
        elif abs(ahead) >= 1.0:
            self._moves.send_short(axis, round(-ahead / 2.0) * axis.sign, others=bool(wanted))
        return RECHECK_S if wanted == 0.0 else min(_FOLLOW_S, max(RECHECK_S, 1.0 / abs(wanted)))


def _ahead(axis: BoxAxis, path: AxisPath, time: float) -> tuple[float, float]:
    """By how many microsteps an axis is ahead of its path, and the path's rate, both with the axis's angle."""
    counts, rate = path.at(time)[axis.index]
    return axis.sign * (axis.at(time).counts - counts), axis.sign * rate
