"""Direct speed control: both axes at speeds of their own, for a bounded time.

The way is checked before it begins as that of a slew is; while it lasts every cycle checks where the telescope is
and where it could still come to rest. It ends in a ramp. A drive that would go on without its host has a dead-man
process beside it, which each cycle keeps quiet.
"""

import math
from dataclasses import dataclass, replace

from clockdrive.control import Steps
from clockdrive.errors import ArgumentError, Refused
from clockdrive.reporting import ReportFailed, tell
from clockdrive.safety import rests_at
from clockdrive.session import Session
from clockdrive.slewing import Progress, Report
from clockdrive.state import Activity
from mounts.drive import Reading

_PERIOD_S = 0.1
_LONGEST_S = 600.0
_AT_REST = 0.5  # counts/s
_STOPPING_S = 15.0  # beyond what the deceleration takes


@dataclass(frozen=True)
class Moved:
    """A motion at given speeds, ended."""

    seconds: float
    start: tuple[float, float]  # axis angles, radians
    end: tuple[float, float]


class DirectSpeed:
    """Moves the telescope of a session at speeds.

    Parameters
    ----------
    session : Session
        Reads, checks and stops it meanwhile.
    """

    def __init__(self, session: Session) -> None:
        self._session = session

    def move(self, rates: tuple[float, float], seconds: float, report: Report) -> Steps[Moved]:
        """Move both axes at `rates`, radians a second, for a time, and ramp them down.

        Raises
        ------
        Refused, Unreachable
            Not now, not so fast, or not that way; where it had begun, the telescope was stopped.
        """
        session = self._session
        session.require_free()
        if not 0.0 < seconds <= _LONGEST_S:
            raise ArgumentError(f"a speed for {seconds:g} s: above 0 up to {_LONGEST_S:g} s; give it again to go on")
        speeds = self._speeds(rates)
        reading = session.poll()
        began, here = session.clock.now(), session.start().counts
        check_way(session, rates, seconds, "direct speed")
        if reading is not None:
            self._look_ahead(reading, speeds)
        ends = (here[0] + speeds[0] * seconds, here[1] + speeds[1] * seconds)
        session.begin(Activity("jogging", began, began + seconds, here, ends, "direct speed"))
        try:
            yield from self._run(speeds, began + seconds, report)
            yield from self._ramp_down()
            session.drive.stop(session.clock.now())
        except (GeneratorExit, Refused):
            raise  # whoever ended it, or refused to go on, stops the telescope
        except ReportFailed as failed:
            session.stop_and_fail(str(failed))
            raise failed.error from None
        except BaseException as error:
            session.stop_and_fail(str(error) or repr(error))
            raise
        session.poll()
        session.now_doing("idle")
        angles = session.planner.angles
        return Moved(session.clock.now() - began, angles(here), angles(session.synchronised().counts))

    def _speeds(self, rates: tuple[float, float]) -> tuple[float, float]:
        """Counts per second of both axes.

        Raises
        ------
        Refused
            An axis cannot go so fast, or neither is to move.
        """
        speeds = []
        for i, (rate, axis, model) in enumerate(
            zip(rates, self._session.planner.axes, self._session.timing().slew, strict=True), start=1
        ):
            speed = rate * axis.gearing.counts_per_radian
            if not abs(speed) <= model.max_rate:
                highest = math.degrees(model.max_rate / abs(axis.gearing.counts_per_radian))
                raise Refused(f"a speed of {math.degrees(rate):g}°/s: axis {i} goes up to ±{highest:.3f}°/s")
            speeds.append(speed)
        if not any(speeds):
            raise Refused("a speed of 0 on both axes moves nothing; use `stop` to stop")
        return speeds[0], speeds[1]

    def _run(self, speeds: tuple[float, float], end: float, report: Report) -> Steps[None]:
        session = self._session
        began = session.clock.now()
        while (left := end - session.clock.now()) > 0.0:
            session.drive.move_at(speeds, session.clock.now())
            yield min(_PERIOD_S, left)
            reading = session.poll()
            if reading is None:
                session.halt("the drive does not answer during direct speed control; it was stopped. Check the link")
            self._look_ahead(reading, speeds)
            tell(report, Progress("direct speed", max(0.0, end - reading.time), end - began, reading.counts))

    def _look_ahead(self, reading: Reading, speeds: tuple[float, float]) -> None:
        """Stop while the telescope, on its way to these speeds, can still come to rest where it may stand."""
        session = self._session
        rests = rests_at(reading, session.timing().slew, _PERIOD_S, speeds)
        if why := session.guard.why_stop(reading, session.doing, rests):
            session.halt(f"direct speed control was {why}" if why.startswith("stopped") else why)

    def _ramp_down(self) -> Steps[None]:
        session = self._session
        deadline = session.clock.now() + _STOPPING_S
        session.drive.move_at((0.0, 0.0), session.clock.now())
        while True:
            yield _PERIOD_S
            reading = session.poll()
            if reading is not None and all(abs(axis.rate) < _AT_REST for axis in reading.axes):
                return
            if session.clock.now() > deadline:
                session.halt(f"the axes still move {_STOPPING_S:.0f} s after they were slowed down; all was stopped")


def check_way(session: Session, rates: tuple[float, float], seconds: float, name: str) -> None:
    """Check the whole way at `rates`, radians a second, for a time as that of a slew at these speeds.

    Raises
    ------
    Refused, Unreachable
        Nobody knows where it begins; a limit, the horizon or the Sun forbids it.
    """
    start, timing = session.start(), session.timing()
    one, two = (
        model.limited(max(1.0, abs(rate * axis.gearing.counts_per_radian)))
        for rate, axis, model in zip(rates, session.planner.axes, timing.slew, strict=True)
    )
    angles = session.planner.angles(start.counts)
    ends = (angles[0] + rates[0] * seconds, angles[1] + rates[1] * seconds)
    session.planner.plan_axes(name, ends, start, replace(timing, slew=(one, two)))
