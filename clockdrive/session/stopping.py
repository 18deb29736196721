"""How a telescope under control is stopped, by command or because something is wrong."""

from typing import NoReturn

from clockdrive.errors import Refused
from clockdrive.session.account import AT_REST, MOVING
from clockdrive.session.aiming import Aiming
from mounts.errors import DriveError, StillMoving
from transports.errors import TransportError


class Stopping(Aiming):
    """Stops, and goes on stopping until the drive has heard it."""

    def require_free(self, *, parked: bool = False) -> None:
        """Refuse a command that cannot begin now; `parked` for one that a parked telescope may do.

        Raises
        ------
        Refused
            The telescope moves, or is parked.
        """
        if self._must_stop:
            self._try_to_stop()
        if self._must_stop:
            raise Refused(f"the telescope could not be stopped yet: {self._unstopped_because}")
        if self.doing in MOVING:
            raise Refused(f"the telescope is {self.doing}; wait for it, or `stop` first")
        if self.store.parked() and not parked:
            raise Refused("the telescope is parked; `unpark` first")

    def halt(self, why: str) -> NoReturn:
        """Stop for a reason, and refuse to go on.

        Raises
        ------
        Refused
            Always.
        """
        self._try_to_stop()
        self.fail(why)
        raise Refused(why)

    def fail(self, why: str) -> None:
        """Give up what was being done; the drive is left as it is."""
        self.trouble = why
        self.pursuit = None
        if self.doing not in AT_REST:
            self.note("stopped", why)
            self.doing = "idle"
            with self._unwritten():
                self.now_doing("idle")

    def stop_and_fail(self, why: str) -> None:
        """Stop after a failure that leaves the drive's state in doubt; what rests is left alone."""
        if self.doing not in AT_REST:
            self._try_to_stop()
        self.fail(why)

    def _try_to_stop(self) -> None:
        """Stop; where that fails, every cycle tries again."""
        try:
            self.drive.stop(self.clock.now())
        except StillMoving as moving:
            self._must_stop = False
            self.note("stopped", str(moving))
        except (DriveError, TransportError) as error:
            if not self._must_stop:
                self.note("stop failed", f"{error}; tried again and again; the drive's own switch stops it as well")
            self._must_stop, self._unstopped_because = True, str(error)
        else:
            self._must_stop = False

    def stop(self) -> None:
        """Stop everything, tracking included; a stop that does not reach the drive is tried again every cycle.

        Raises
        ------
        StillMoving
            All was done that can be: what is under way ends by itself.
        DriveError, TransportError
            It did not reach the drive.
        """
        stands = self.doing in AT_REST and not self._must_stop
        self.pursuit = None
        self._must_stop = True
        self.doing = self._at_rest()
        try:
            self.drive.stop(self.clock.now())
        except StillMoving as moving:
            self._stopped(f"by command: {moving}")
            raise
        self._stopped("" if stands else "by command")  # an interruption stops on its way out as well

    def _stopped(self, said: str) -> None:
        self._must_stop = False
        self.now_doing(self.doing)
        if said:
            self.note("stopped", said)
