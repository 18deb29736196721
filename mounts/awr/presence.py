"""Whether a unit is still as it was left: its words, its cookie, its override, and what it is after a reset."""

import math

from mounts.awr.messages import Override
from mounts.awr.parts import Parts
from mounts.awr.registers import BY_NAME, WITH_STATUS
from mounts.awr.supervision import (
    COMMITTED,
    LOST_BY,
    OTHERWISE,
    OVERWRITTEN,
    RECALIBRATED,
    STATED,
    SWITCHED,
    TURNED_BACK,
    UNTOLD,
)
from mounts.awr.unit import Happened
from mounts.awr.words import BACKLASHES

_COOKIE_EVERY_S = 2.0
_OTHER_WORDS = (
    "drive_ra holds {} counts at postscaler {}, otherwise than configured: give drive_ra_counts and "
    "drive_ra_postscaler so in [drive], for `rates` to tell its registers"
)
_UNREFERENCED = (
    'nobody has seen yet that rate_reference = "{}" is so, on which LEFT and RIGHT depend at GUIDE and CENTRE speed '
    "while it tracks: what is stated of axis 1 covers the other, 15″ a second; `commission` finds it out"
)
_UNASKED = (
    "this firmware cannot be asked whether the override holds it, {} can: a stop whose event is lost on the line is "
    "not seen, so `sync` on a known star after the override button was pressed"
)
_TURNED = "the direction senses of the unit (00) were changed since the last sync; `sync` on a known star"


class Presence:
    """Knows whether one unit was changed, switched off or reset unseen.

    Parameters
    ----------
    parts : Parts
        The unit.
    """

    def __init__(self, parts: Parts) -> None:
        self._parts = parts
        self._asked = -math.inf  # POSIX seconds at which it was seen last
        self.cookie = parts.kept.cookie
        """What it was given, to know it again; none when it never was."""
        self.discarded = False
        """All of RAM was discarded by this program, or may be, and nobody has seen what it holds since."""
        self.notes: tuple[str, ...] = ()
        """What a person should know of it since it was connected."""

    def connected(self, note: str) -> None:
        """It was identified, with a note on its firmware; nothing else is known yet."""
        self.notes = (f"firmware {self._parts.unit.version}", *((note,) if note else ()))

    def check_past(self, time: float) -> None:
        """See whether it is as it was left.

        Raises
        ------
        TransportError
            It does not answer.
        """
        parts, kept = self._parts, self._parts.kept
        lost = parts.supervision.unsynchronised
        directions, calibration = parts.words.directions, parts.words.calibration
        turned, recalibrated = kept.directions not in {None, directions}, kept.calibration not in {None, calibration}
        if turned or recalibrated:
            parts.proof.void()
        if not lost and turned:
            parts.supervision.lose(_TURNED)
        if not lost and recalibrated:
            parts.supervision.lose(RECALIBRATED)
        if not lost and kept.cookie is not None and not parts.words.is_there(kept.cookie):
            parts.supervision.lose(SWITCHED)
        away = time - kept.time
        if away < 0.0:
            parts.supervision.lose(TURNED_BACK.format(-away))

    def turned_round(self) -> None:
        """The senses in RAM are others from now on, maybe while a drive goes: nobody knows which way keys lead."""
        self._parts.proof.void()
        self._parts.supervision.lose(_TURNED)

    def doubt_drives(self, time: float) -> None:
        """Widen what is stated by how far the drives may have led otherwise than they were left, while nobody looked.

        Called when its words are as they are to be; `time` is when it was connected. Where the unit tells what they
        do now they may have done that all the while, as a dead-man process switches them off. Where it does not it
        may have been switched off, and on, so that they go as they usually do.
        """
        parts, words = self._parts, self._parts.words
        if parts.supervision.unsynchronised or parts.kept.cookie is None:
            return
        away = parts.unit.now() - parts.kept.time
        if parts.axes[0].rate and parts.axes[0].rate == words.speeds.drives[0]:
            self.notes = (*self.notes, f"the drives went on for {away:.0f} s while no program looked")
        why = OTHERWISE if words.tells_ram else UNTOLD
        for axis, now, usual, near in zip(
            parts.axes, words.speeds.drives, words.usual.drives, parts.settings.near, strict=True
        ):
            rates = {axis.rate, now} if words.tells_ram else {axis.rate, usual, 0.0}
            astray = (max(rates) - min(rates)) * away
            if astray > near:
                parts.supervision.lose(f"{why.format(away)}: axis {axis.index + 1} {LOST_BY.format(astray)}")
                return
            here = axis.at(time)
            axis.known(here.counts, time, here.uncertainty + astray)
            if astray >= 1.0:
                self.notes = (*self.notes, f"{why.format(away)}: axis {axis.index + 1} {STATED.format(astray)}")

    def bake(self) -> None:
        """Give it a cookie, and have it take up the play as configured.

        Raises
        ------
        DriveRefused, TransportError
            It does not take it, or does not answer.
        """
        if self._parts.words.take_up():
            self._parts.drives.as_the_words_say()
        self.know_again()
        self.discarded = False
        self._asked = self._parts.unit.now()

    def know_again(self) -> None:
        """The word that is its cookie was written, or committed: have it hold one.

        Raises
        ------
        DriveRefused, TransportError
            As for `bake`.
        """
        self.cookie = self._parts.words.bake()

    def warn_of_words(self) -> None:
        """Note what is unusual about its words."""
        words = self._parts.words
        plays = [name for name in BACKLASHES if words.lasting.get(BY_NAME[name].address)]
        if plays:
            self.notes = (*self.notes, f"it takes up backlash by itself: {', '.join(plays)}")
        held = words.sidereal
        if any(here not in {None, unit} for here, unit in zip(self._parts.settings.drive_ra, held, strict=True)):
            self.notes = (*self.notes, _OTHER_WORDS.format(*held))
        if wrong := words.usual.contradiction():
            self.notes = (*self.notes, wrong)
        if not self._parts.proof.referenced:
            self.notes = (*self.notes, _UNREFERENCED.format(self._parts.settings.rate_reference))
        if self._parts.unit.version < WITH_STATUS:
            self.notes = (*self.notes, _UNASKED.format(WITH_STATUS))
        if not words.tells_ram:
            said = "it does not tell what its RAM holds, so soft writes are taken to be as they were written"
            self.notes = (*self.notes, said)

    def ask_status(self, time: float) -> None:
        """Have relays and override told, by a firmware that tells them.

        Raises
        ------
        TransportError
            It does not answer.
        """
        status, supervision = self._parts.unit.status(), self._parts.supervision
        if status is None:
            return
        supervision.switched(status.relays)
        if status.override != supervision.stopped:
            supervision.take([Happened(Override(stopped=status.override), time)])
            self._parts.drives.held(time, stopped=supervision.stopped)

    @property
    def is_due(self) -> bool:
        """Whether nobody has looked at it for a while."""
        return self.discarded or self._parts.unit.now() - self._asked > _COOKIE_EVERY_S

    def is_lost(self) -> bool:
        """See whether it was reset unheard, so that its soft writes are gone.

        Raises
        ------
        TransportError
            It does not answer.
        """
        words = self._parts.words
        self._asked = self._parts.unit.now()
        for name, (now, was) in words.overwritten.items():
            self._parts.supervision.note(OVERWRITTEN.format(name, now, was))
        words.overwritten.clear()
        if words.was_committed():
            self._parts.supervision.note(COMMITTED)
        if self.discarded:
            words.read()
            words.insist()
            self._parts.pace.forget()
            self.bake()
        if self.cookie is None or words.is_there(self.cookie):
            return False
        self._parts.supervision.lose(SWITCHED)
        self._parts.supervision.was_reset = True
        return True

    def began_anew(self) -> None:
        """After a reset its words are the non-volatile ones, by which axis 1 tracks, and no key is pressed.

        Raises
        ------
        DriveRefused, TransportError
            It does not obey, or does not answer.
        """
        parts = self._parts
        # Where it does not obey at once this is done again, and then it is known that they were to rest.
        parts.drives.resting = parts.drives.resting or not any(axis.rate for axis in parts.axes)
        parts.words.ram = dict(parts.words.lasting)
        parts.keys.speed = None
        now = parts.unit.now()
        for axis in parts.axes:
            here = axis.at(now)
            axis.known(here.counts, now, here.uncertainty)
            axis.forget_side()
        parts.drives.as_the_words_say(now)
        parts.pace.forget()
        if parts.drives.resting:
            parts.drives.rest()
        self.bake()
        parts.supervision.was_reset = False

    def follow_clock(self) -> None:
        """At rest go by the computer's clock as it is set now; the axes are where they were."""
        parts = self._parts
        before = parts.unit.now()
        here = [axis.at(before) for axis in parts.axes]
        off = parts.unit.follow_clock()
        if off:
            for axis, was in zip(parts.axes, here, strict=True):
                axis.known(was.counts, before + off, was.uncertainty)
                axis.drives_at(axis.rate, before + off)
            self._asked += off
