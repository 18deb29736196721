"""Gotos and keys that are held: the drives go as the target does, and the stages of a cascade follow one another."""

from collections.abc import Sequence
from contextlib import suppress

from mounts.awr.at_speed import Keys, held_at, keys_of
from mounts.awr.cascade import Cascade, Errors, Stage
from mounts.awr.following import require_slow
from mounts.awr.messages import Override
from mounts.awr.parts import Parts
from mounts.awr.supervision import SWITCHED, UNTOLD
from mounts.awr.unit import Happened
from mounts.drive import AxisSlew
from mounts.errors import DriveError, DriveRefused, Unsynchronised
from transports.errors import TransportError

_AHEAD_S = 0.5  # in which a key that is held until told otherwise is looked at again, and released
_STAGES = 40  # of one goto; more means that the keys do not do what they should


class Slewing:
    """What keys are to do now, with one unit.

    Parameters
    ----------
    parts : Parts
        The unit.
    """

    def __init__(self, parts: Parts) -> None:
        self._parts = parts
        self._aims: tuple[AxisSlew, AxisSlew] | None = None
        self._aimed = 0.0  # POSIX seconds at which the aims hold
        self._cascade: Cascade | None = None
        self._stages = 0
        self._jog: Keys | None = None  # the keys that are held until told otherwise
        self.course: list[Stage] = []
        """The stages of the last goto."""

    @property
    def wanted(self) -> bool:
        """Whether a goto has not ended, or keys are held until told otherwise."""
        return self._aims is not None or self._jog is not None

    @property
    def under_way(self) -> bool:
        """Whether keys move an axis or are going to."""
        return self.wanted or self._parts.keys.busy

    def require_ready(self) -> None:
        """See that keys may be pressed.

        Raises
        ------
        Unsynchronised, DriveRefused
            Nobody knows where it is; the override holds it; the rates contradict the configuration.
        """
        supervision = self._parts.supervision
        if supervision.unsynchronised:
            raise Unsynchronised(supervision.unsynchronised)
        supervision.require_free()
        if wrong := self._parts.words.usual.contradiction():
            raise DriveRefused(wrong)

    # To a target -----------------------------------------------------------------------------------------------

    def prepare(self, axes: tuple[AxisSlew, AxisSlew]) -> None:
        """See that keys may lead there, and let go of those that are held.

        Raises
        ------
        Unsynchronised, DriveRefused, DriveError, TransportError
            They may not; the unit does not obey.
        """
        self.require_ready()
        require_slow([slew.rate_after for slew in axes], self._parts.settings)
        now = self._parts.unit.now()
        self._parts.proof.require(
            [aim.target - axis.at(now).counts for axis, aim in zip(self._parts.axes, axes, strict=True)]
        )
        if self._parts.keys.busy:
            self._parts.keys.halt()
        self._parts.keys.unproven = self._parts.words.tells_ram
        if not self.is_proven():
            raise Unsynchronised(self._parts.supervision.unsynchronised)
        self.forget()

    def start(self, axes: tuple[AxisSlew, AxisSlew], time: float) -> float:
        """Set the drives to the rates of the target, and press the first keys; return when the first one acts.

        Raises
        ------
        DriveRefused, AwrError, TransportError
            There is no dead-man process, or the unit does not obey; no key leads there.
        """
        parts, (one, two) = self._parts, axes
        parts.beside.stand_by()
        parts.drives.go((one.rate_after, two.rate_after), resting=not (one.rate_after or two.rate_after))
        ladder = parts.pace.no_faster((one.max_rate, two.max_rate))
        self._cascade = Cascade(ladder)
        self._aims, self._stages = (one, two), 0
        self._aimed = time
        parts.keys.choose_anew()
        parts.remember()
        began = parts.unit.now() + parts.pace.exchange_s + parts.keys.delay_s
        try:
            self.go_on()
        except (DriveError, TransportError):
            self._aims = None
            raise
        return began

    def is_proven(self) -> bool:
        """Whether it is known where it is; a motion of which an event was lost may have ended by power or override.

        Raises
        ------
        TransportError
            The unit does not answer.
        """
        parts = self._parts
        if parts.keys.unproven and not parts.keys.busy:
            if not parts.words.tells_ram:
                parts.supervision.lose(UNTOLD)
            elif not parts.words.has_cookie():
                parts.supervision.lose(SWITCHED)
                parts.supervision.was_reset = True
            status, now = parts.unit.status(), parts.unit.now()
            if status is not None and status.override and not parts.supervision.stopped:
                parts.supervision.take([Happened(Override(stopped=True), now)])
                parts.drives.held(now, stopped=True)
            parts.keys.unproven = False
        return not parts.supervision.unsynchronised

    def go_on(self) -> None:
        """Begin the next stage, as long as a stage ends within this look."""
        parts = self._parts
        while self._aims is not None and not parts.keys.busy and self.is_proven():
            stage = None
            if self._cascade is not None and self._stages < _STAGES:
                now = parts.unit.now() + parts.keys.delay_s
                stage = self._cascade.next(self._errors(self._aims, now), parts.keys.speed)
            if stage is None:
                if all(axis.settled(parts.unit.now()) for axis in parts.axes):
                    self._arrived()
                return
            self._stages += 1
            self.course = [*self.course[: self._stages - 1], stage]
            parts.keys.begin(stage)
            parts.keys.look()

    def _errors(self, aims: tuple[AxisSlew, AxisSlew], time: float) -> Errors:
        """What both axes have to go once their drives have taken up the play, and by how much that grows."""
        steps, drifts, slacks = [], [], []
        for axis, aim in zip(self._parts.axes, aims, strict=True):
            due = self._aimed if aim.arrival is None else aim.arrival
            there = aim.target + aim.rate_after * (time - due)
            steps.append(there - axis.at(time).counts + axis.falls(time))
            drifts.append(aim.rate_after - axis.rate)
            slacks.append((axis.slack(time, 1.0), axis.slack(time, -1.0)))
        return Errors((steps[0], steps[1]), (drifts[0], drifts[1]), (slacks[0], slacks[1]))

    def _arrived(self) -> None:
        self._aims = None
        self._parts.beside.rest()
        if self._stages >= _STAGES:
            self._parts.supervision.note(
                f"the target was not reached within {_STAGES} presses; see `drive show` for its rates"
            )
        self._parts.remember()

    # At a speed ------------------------------------------------------------------------------------------------

    def at(self, rates: Sequence[float]) -> bool:
        """Hold the keys of the speed that comes nearest to the faster axis; return whether they were held already.

        Raises
        ------
        DriveRefused, AwrError, TransportError
            There is no dead-man process, or the unit does not obey; no key moves it so, or so far.
        """
        parts = self._parts
        stage = held_at(parts.pace.present, rates)
        wanted = keys_of(stage)
        if wanted == self._jog:
            parts.keys.look()
            self._require_near()
            return True
        parts.keys.halt()
        if stage is not None:
            parts.proof.require([press.key.way(_AHEAD_S) if press else 0.0 for press in stage.presses])
        self._jog = wanted
        if stage is not None:
            parts.remember()
            parts.keys.choose_anew()
            parts.keys.begin(stage)
        return False

    def _require_near(self) -> None:
        """Release keys that will have led farther by the next look than anybody has seen keys lead.

        Raises
        ------
        DriveRefused
            They will; they are released.
        """
        parts, soon = self._parts, self._parts.unit.now() + _AHEAD_S
        try:
            parts.proof.require([axis.leads(soon) for axis in parts.axes])
        except DriveRefused:
            self.forget()
            parts.keys.halt()
            raise

    # No more ---------------------------------------------------------------------------------------------------

    def forget(self) -> None:
        """Nothing is wanted any more; keys that are held are for others to release."""
        self._aims = self._jog = None

    def give_up(self) -> None:
        """Release all keys, as far as the unit listens."""
        self.forget()
        with suppress(TransportError):
            self._parts.keys.halt()
