"""How an axis of an APO or SDSS telescope slews, as the planner asks: the quickest way, ending in motion."""

from dataclasses import dataclass, replace

from mounts.apo.rendezvous import Where, meeting
from mounts.apo.sendable import sendable
from mounts.apo.settings import ApoSettings
from mounts.apo.slew_profile import MARGIN, Limits, Line, Slew, SlewProfile, quickest


@dataclass(frozen=True)
class ApoTravel:
    """An axis on its quickest way; keeps `pointing.slew.Travel`."""

    way: SlewProfile
    shortest_s: float = 0.0

    @property
    def duration(self) -> float:
        """Seconds until it is on its target; a way that would be shorter begins later."""
        return max(self.way.duration, self.shortest_s)

    @property
    def landed(self) -> float:
        """Where it is then, degrees."""
        return self.way.end.position

    def position(self, elapsed: float) -> float:
        """Where it is so many seconds after the beginning, degrees; `landed` from `duration` on."""
        return self.landed if elapsed >= self.way.duration else self.way.at(max(0.0, elapsed))[0]


@dataclass(frozen=True)
class ApoSlewModel:
    """The law of one axis; keeps `pointing.slew.MeetingModel`.

    Parameters
    ----------
    max_rate, acceleration, jerk : float
        Its limits: degrees per second, per second², per second³.
    shortest_s : float
        Seconds that a slew lasts at least, so that no axis is at its end while another one is being told.
    """

    max_rate: float
    acceleration: float
    jerk: float
    shortest_s: float = 0.0

    def travel(self, start: float, end: float, start_rate: float, end_rate: float) -> ApoTravel:
        """Travel from drifting with `start_rate` to going along with a target of `end_rate`.

        A target that moves faster than the axis is met at the axis's own top speed, which the planner then refuses.
        """
        return self._travel(Slew.to(start, start_rate, end, self._possible(end_rate)))

    def onto(self, start: float, start_rate: float, position: float, rate: float) -> ApoTravel:
        """Travel onto a line that is at `position` as it begins and moves with `rate`; too fast ones as `travel`."""
        return self._travel(Slew(start, start_rate, Line(position, self._possible(rate))))

    def meeting(self, start: float, start_rate: float, where: Where) -> SlewProfile:
        """The soonest meeting with a path, as it can be sent, in nodes.

        Raises
        ------
        ApoError
            The path is faster than the axis, or runs away.
        """
        return meeting(start, start_rate, where, self.limits)

    def profile(self, start: float, start_rate: float, end: float, end_rate: float) -> SlewProfile:
        """The same way as it can be sent, in nodes.

        Raises
        ------
        ApoError
            The end moves faster than the axis may.
        """
        return sendable(Slew.to(start, start_rate, end, end_rate), self.limits)

    @property
    def limits(self) -> Limits:
        """Of velocity, acceleration and jerk."""
        return Limits(self.max_rate, self.acceleration, self.jerk)

    def limited(self, max_rate: float) -> "ApoSlewModel":
        """The same axis held to a lower top speed."""
        return replace(self, max_rate=min(max_rate, self.max_rate))

    def _travel(self, slew: Slew) -> ApoTravel:
        return ApoTravel(quickest(slew, self.limits), self.shortest_s)

    def _possible(self, rate: float) -> float:
        most = self.max_rate * MARGIN
        return min(max(rate, -most), most)


def models_of(settings: ApoSettings) -> tuple[ApoSlewModel, ...]:
    """The law of each axis."""
    return tuple(
        ApoSlewModel(axis.max_speed_deg_s, axis.acceleration_deg_s2, axis.jerk_deg_s3, settings.shortest_slew_s)
        for axis in settings.axes
    )
