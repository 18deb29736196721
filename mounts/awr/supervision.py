"""What a unit tells of itself beside its motion: resets, the override, errors, the index of the worm, its lines.

Whatever makes its position doubtful makes it unsynchronised, with the reason, until a person says where it is.
"""

from collections.abc import Callable

from mounts.awr.commands import RELAYS
from mounts.awr.messages import Backlash, Error, IndexPulse, Lines, Override
from mounts.awr.registers import Register
from mounts.awr.unit import Happened
from mounts.errors import DriveRefused

_NOTES = 6
_OVERFLOW = "3"  # of the event buffer: some were lost
STOPPED = (
    "the override input stopped everything at once, and steps are lost; press the override button at the drive box, "
    "then `sync` on a known star"
)
UNHEARD = (
    "the override input was lifted, and nobody heard that it had stopped everything: steps are lost; `sync` on a "
    "known star"
)
RESET = "the unit began anew ({}): soft writes and position are lost; `sync` on a known star"
OVERFLOWED = "the unit lost events ({}), so nobody knows what moved; `sync` on a known star"
TURNED_BACK = (
    "the clock of this computer reads {:.0f} s earlier than when the position was kept, so it was or is wrong: "
    "set it, then `sync` on a known star"
)
DESERTED = "both drives were switched off, and nobody knows when: {}; `sync` on a known star"
STEPPED = (
    "the clock of the computer was set by {:+.1f} s while keys were held, which were released; check the time "
    "service, then `sync` on a known star"
)
SWITCHED = "the unit was switched off and on while no program looked; `sync` on a known star"
UNTOLD = (
    "this unit does not tell what its RAM holds, so it may have been switched off and on in the {:.0f} s in which no "
    "program listened"
)
OTHERWISE = (
    "the drives go otherwise than they were left {:.0f} s ago, as since a dead-man process switched them off, and "
    "nobody knows when that was"
)
STATED = "may be {:.0f} steps off, which is stated; leave `clockdrive run` running, or `sync` on a known star"
LOST_BY = "may be {:.0f} steps off; `sync` on a known star, and leave `clockdrive run` running from then on"
COMMITTED = (
    "soft writes stand in the non-volatile memory that nobody asked to commit: a command was damaged on the line. "
    "Compare `drive show` with the factory sheet, write with `drive set` what differs, then `drive save`"
)
OVERWRITTEN = (
    "the non-volatile word {0} is {1} and was {2}, which nobody asked for: a command was damaged on the line. "
    "`drive set {0} {2}`, then `drive save`"
)
RECALIBRATED = (
    "drive_ra (01, 02), from which all rates are reckoned, was changed since the last sync: compare `drive show` "
    "with the factory sheet, then `sync` on a known star"
)
_DIVISION = (
    "{}: {} holds what the unit cannot divide by; `drive reload` takes the non-volatile words again, `drive set` "
    "others"
)


class Supervision:
    """Knows why the position cannot be trusted, and what a person should know.

    Parameters
    ----------
    unsynchronised : str
        Why nobody knows where the axes are; empty where that is known.
    place : callable
        Where axis 1 is at a time, for the index of the worm.
    undivided : callable
        The rate register that it cannot divide by.
    """

    def __init__(
        self,
        unsynchronised: str,
        place: Callable[[float], float],
        undivided: Callable[[], Register | None],
        index: tuple[float, float] | None = None,
    ) -> None:
        self.unsynchronised = unsynchronised
        self.lost: Callable[[], None] = lambda: None
        """Called when the position is lost."""
        self.stopped = False
        """The override holds it."""
        self.was_reset = False
        """It began anew, and nobody has looked at its words since."""
        self.index = index
        """When the worm of axis 1 passed its index last, and where the axis was."""
        self.relays: int | None = None
        """Those that are on, bit by bit; None where nobody knows."""
        self.lines: Lines | None = None
        self.backlash: tuple[bool | None, bool | None] = (None, None)
        """The sense in which the play of each axis was taken up last."""
        self._place = place
        self._undivided = undivided
        self._notes: list[str] = []
        self._untold: list[str] = []
        self._fault = ""

    @property
    def notes(self) -> tuple[str, ...]:
        """What was seen, the newest last, and how relays and input lines are now."""
        return (*self._notes, *self._relays_now(), *((self.lines.said,) if self.lines is not None else ()))

    def _relays_now(self) -> tuple[str, ...]:
        if self.relays is None:
            return ()
        states = (f"{number} {'on' if self.relays >> number - 1 & 1 else 'off'}" for number in RELAYS)
        return (f"relays: {', '.join(states)}",)

    def switched(self, relays: int) -> None:
        """These relays are on, bit by bit; a change is an event."""
        if relays != (self.relays or 0):
            self.relays = relays
            self._untold += self._relays_now()
        self.relays = relays

    @property
    def alarms(self) -> tuple[str, ...]:
        """What stands."""
        return (self._fault,) if self._fault else ()

    def told(self) -> tuple[str, ...]:
        """What happened since this was asked last."""
        told, self._untold = tuple(self._untold), []
        return told

    def take(self, happened: list[Happened]) -> None:
        """Act on what the unit told."""
        for each in happened:
            event = each.event
            if isinstance(event, Error):
                self._error(event)
            elif isinstance(event, Override):
                self._override(event)
            elif isinstance(event, IndexPulse):
                self.index = each.time, self._place(each.time)
            elif isinstance(event, Lines):
                self.lines = event
                self._untold.append(event.said)
            elif isinstance(event, Backlash):
                one, two = self.backlash
                self.backlash = (event.on, two) if event.axis == 0 else (one, event.on)

    def _error(self, error: Error) -> None:
        said = f"e{error.code} {error.meaning}"
        if error.is_reset:
            self.was_reset = True
            self.lose(RESET.format(said))
        elif error.code == _OVERFLOW:
            self.lose(OVERFLOWED.format(said))
        elif error.is_division:
            register = self._undivided()
            name = "a rate register" if register is None else f"{register.name} ({register.address:02X})"
            self._fault = _DIVISION.format(said, name)
            self.note(self._fault)
        else:
            self.note(f"the unit says {said}")

    def _override(self, event: Override) -> None:
        was, self.stopped = self.stopped, event.stopped
        if event.stopped:
            self.lose(STOPPED)
        elif not was:
            self.lose(UNHEARD)
        else:
            self.note("the override was lifted; the axes go on at their drive rates")

    def lose(self, why: str) -> None:
        """The position is unknown from now on, for the first reason that there was."""
        self.unsynchronised = self.unsynchronised or why
        self.note(why)
        self.lost()

    def require_free(self) -> None:
        """See that the override does not hold it.

        Raises
        ------
        DriveRefused
            It does.
        """
        if self.stopped:
            raise DriveRefused("the override holds the telescope: press the override button at the drive box")

    def synchronised(self) -> None:
        """A person says where the axes are."""
        self.unsynchronised = ""

    def rates_are_sound(self) -> None:
        """The words were taken anew from the non-volatile memory."""
        self._fault = ""

    def note(self, text: str) -> None:
        """What a person should know."""
        self._untold.append(text)
        if text in self._notes:
            self._notes.remove(text)
        self._notes = [*self._notes[-(_NOTES - 1) :], text]
