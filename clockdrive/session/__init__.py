"""The telescope under control: it reads, checks, tracks, stops, and never points by a position that may be wrong.

Everything here runs on one thread, the control loop's. Between the steps of a command, and in the background, every
reading passes the same safety checks, whoever moved the telescope. The commands are in `slewing` and `adjusting`.
"""

import logging
from contextlib import suppress

from clockdrive.errors import Refused, StateError
from clockdrive.session.account import AT_REST, MOVING
from clockdrive.session.standing import Standing
from clockdrive.state import Activity
from mounts.drive import Reading
from mounts.errors import DriveError
from pointing.errors import PointingError, Unreachable
from transports.errors import TransportError

_LOG = logging.getLogger(__name__)
_LARGEST_ERROR_DEG = 2.0  # that tracking may close by itself; a person's offsets reach 1.4°
_LED = "has become fast: it is followed by direct speed control, with the dead-man process beside it"
_NOT_LED = "is slow again: it is left to the drive's own tracking"

__all__ = ["MOVING", "Session"]


class Session(Standing):
    """One telescope under control.

    Parameters
    ----------
    planner : Planner
        Sky, mount, axes, limits.
    drive : Drive
        Not yet connected.
    store : StateStore
        What outlives this process.
    clock : Clock
        The time.
    after_reading : callable
        Called after every reading; the embedded simulator is kept there.
    surroundings : Surroundings, optional
        The host's clock and the air; without it, the clock and the configured air.
    """

    def open(self, *, make_safe: bool) -> Reading:
        """Connect; a session that was cut short makes the drive safe first."""
        for text in self.surroundings.open(self.clock.now()):
            self.note("surroundings", text)
        cut_short = self.store.activity()
        self._opened = self.clock.now()
        reading = self.drive.connect(self.clock.now(), make_safe=make_safe or cut_short is not None)
        if cut_short is not None:
            ended = "the drive was stopped" if self.drive.capabilities.can_stop else "no command ends its last move"
            self.trouble = f"{cut_short.kind} {cut_short.detail} was cut short; {ended}"
            self.note("recovery", self.trouble)
            self.store.end_activity()
        for note in self.drive.notes:
            self.note("drive", note)
        if reading.tracking:  # left so by an earlier command; the safety rules bind it again
            self.doing = "tracking"
        self.taken(reading)
        with suppress(Refused):  # it was stopped, and `trouble` says why
            self._guarded(reading)
        return reading

    def close(self, *, keep_tracking: bool = False) -> bool:
        """Leave the drive safe; return whether it goes on tracking.

        With `keep_tracking` a drive that holds its rate alone goes on at it, bounded by its own soft limits, which
        were written and read back; any other is stopped, but for what was found tracking by itself and is left so.
        One that cannot be stopped tracks on in any case.
        """
        capabilities, pursuit = self.drive.capabilities, self.pursuit
        bounded = capabilities.bounds_itself or pursuit is None
        led = pursuit is not None and pursuit.led
        keep = keep_tracking and self.doing == "tracking" and capabilities.holds_rate_alone and bounded and not led
        self.pursuit = None
        try:
            self.drive.close(self.clock.now(), keep_tracking=keep)
        except (DriveError, TransportError) as error:  # it may move on: the next start makes it safe first
            self.store.begin(Activity("stopping", self.clock.now(), detail=str(error)))
            raise
        finally:
            self.remember()
            self._after_reading()
        self.store.end_activity()
        return keep or not self.drive.capabilities.can_stop

    def cycle(self) -> float:
        """Poll, check, track; return the seconds to the next cycle. Never raises: the loop must go on."""
        try:
            if self._must_stop:
                self._try_to_stop()
            self.poll()
            return self.follow()
        except Refused:
            pass  # it was stopped, and `trouble` says why
        except (DriveError, StateError, PointingError) as error:  # the last from a target that nobody knows further
            self.stop_and_fail(str(error))
        except Exception as error:  # noqa: BLE001 - a telescope that moves must not lose its control thread
            _LOG.exception("the control cycle failed; the telescope is stopped")
            self.stop_and_fail(
                f"internal error, the telescope was stopped: {error!r}; `clockdrive report` helps to find it"
            )
        return self._usual_period

    def follow(self) -> float:
        """Keep the drive on the target in pursuit, if there is one; return the seconds until that is due again.

        A silent link is waited for.

        Raises
        ------
        Refused
            The telescope is too far off its way: a hand or a step of the clock moved one of them; or the target has
            no place any more. The telescope was stopped.
        """
        self._period = self._usual_period
        if self.pursuit is None:
            self._period = self._held()
        if self.pursuit is None or self.link_lost_since is not None:
            return self._period
        name, now = self.pursuit.target.name, self.clock.now()
        try:
            off = 0.0 if self.reading is None else self.pursuit.astray_arcsec(self.reading) / 3600.0
            if (
                off > _LARGEST_ERROR_DEG and self.doing != "slewing"
            ):  # no path is checked on the way that tracking would close it
                self.halt(
                    f"the telescope is {off:.1f}° off {name}, more than {_LARGEST_ERROR_DEG:g}°: `goto` it again"
                )
            if self.pursuit.adapt(now):
                self.note("tracking", f"{name} {_LED if self.pursuit.led else _NOT_LED}")
            self._period = self.drive.follow(self.pursuit, now)
        except TransportError as error:
            self._link_lost(error)
        except Unreachable as error:  # the target has come to where the pointing origin does not
            self.halt(f"{name}: {error}")
        except PointingError as error:  # it has no place any more, as after the end of its table
            self.halt(str(error))
        return self._period

    def unpark(self) -> bool:
        """Allow motion again; return whether it was parked."""
        was = self.store.parked()
        self.store.record_parked(parked=False, time=self.clock.now())
        if self.doing in AT_REST:
            self.now_doing("idle")
        return was

    def power(self, *, on: bool) -> None:
        """Power the motors, or stop and send the drive to standby."""
        if not on:
            self.stop()
        self.drive.power(on=on)
        self.note("power", "on" if on else "standby")
