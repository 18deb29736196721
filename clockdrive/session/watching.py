"""What is read of a telescope under control, and judged: every reading passes the same safety checks."""

from dataclasses import replace

from clockdrive.safety import moved_by_others, rests_at
from clockdrive.session.account import AT_REST
from clockdrive.session.stopping import Stopping
from mounts.drive import Reading, Telling
from mounts.errors import Unsynchronised
from pointing.limits import Check
from transports.errors import TransportError

_DURING = {"slewing": "the slew to {}", "waiting": "the wait for {}", "tracking": "the tracking of {}"}
MOVED_PERIOD_S = 0.5  # while something else moves what is at rest
HELD = {"idle": MOVED_PERIOD_S, "parked": MOVED_PERIOD_S, "waiting": 1.0}
"""Seconds from one look to the next at what stands and somebody else moves."""


class Watching(Stopping):
    """Reads, and stops what breaks a rule."""

    def poll(self) -> Reading | None:
        """Read the drive and check it; None while the link is silent.

        Raises
        ------
        Refused
            A safety rule was broken; the telescope was stopped.
        """
        doing = _DURING.get(self.doing, self.doing).format(self.target_name)
        for text in self.surroundings.follow(self.clock.now(), doing):
            self.note("surroundings", text)
        try:
            reading = self.drive.read(self.clock.now())
        except TransportError as error:
            self._link_lost(error)
            return None
        except Unsynchronised as error:  # what was read before may be as wrong
            if self.reading is not None:
                self.reading = replace(self.reading, unsynchronised=str(error))
            raise
        if self.link_lost_since is not None:
            self.note("link", f"the link is back after {reading.time - self.link_lost_since:.1f} s")
            self.link_lost_since = None
        if isinstance(self.drive, Telling):
            for text in self.drive.told():
                self.note("drive", text)
        self.taken(reading)
        self._guarded(reading)
        return reading

    def _guarded(self, reading: Reading) -> None:
        doing = "at rest" if self.doing in AT_REST else self.doing
        why = self.guard.why_stop(reading, doing, self._rests(reading), self._barred(reading))
        if not why and doing in {"at rest", "waiting"} and reading.tracking:
            why = "the drive tracks, but nothing is followed; it was stopped"
        if why:
            if doing == "at rest" and not self._others_stopped:  # what cannot be barred is stopped again and again
                self.note("stopped", why)
            self._others_stopped = doing == "at rest"
            self.halt(why)
        self._others_stopped = False

    def _rests(self, reading: Reading) -> tuple[float, float] | None:
        """Counts at which what is tracked, or what somebody else moves, would come to rest."""
        if self.pursuit is None:
            if self.doing not in HELD or not moved_by_others(reading):
                return None
            return rests_at(reading, self.drive.slew_models, HELD[self.doing])
        if self.pursuit.led or self.doing == "slewing":
            return None
        return rests_at(reading, self.drive.slew_models, self._period)

    def _barred(self, reading: Reading) -> tuple[Check, ...]:
        return () if self.pursuit is None else self.pursuit.barred(reading)

    def _link_lost(self, error: TransportError) -> None:
        if self.link_lost_since is None:
            self.link_lost_since = self.clock.now()
            self.note("link", f"the drive does not answer: {error}")
