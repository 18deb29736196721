"""Sending moves: each is remembered before it is sent, and the box asked after it.

A box that is silent then may have taken the question for the rest of a move of which a byte was lost.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

from mounts.avr_box import commands
from mounts.avr_box.axis import BoxAxis
from mounts.avr_box.box import Box
from mounts.avr_box.closing import TIMES, Closing
from mounts.avr_box.settings import AvrSettings
from mounts.avr_box.supervision import Supervision
from mounts.avr_box.tick_watch import TickWatch
from mounts.errors import DriveError
from transports.errors import TransportError

_COMMAND_BYTES = 6


class Moves:
    """Sends moves to one box.

    Parameters
    ----------
    box : Box
        Gets them.
    settings : AvrSettings
        What a count and the axis bit mean.
    supervision : Supervision
        Is told where the box was silent after one.
    closing : Closing
        Ends them where no encoder sees what became of them.
    watch : TickWatch
        Asks after one.
    remember : callable
        Keeps all that nobody can ask the box.
    """

    def __init__(
        self,
        box: Box,
        settings: AvrSettings,
        supervision: Supervision,
        closing: Closing,
        watch: TickWatch,
        remember: Callable[[], None],
    ) -> None:
        self._box, self._settings, self._supervision = box, settings, supervision
        self._closing, self._watch, self._remember = closing, watch, remember
        self.sending = False
        """Whether one may have been sent or not: what a program that ends now leaves behind."""
        self.unproved = False
        """Whether nothing was asked after the last one."""

    @property
    def line_s(self) -> float:
        """Seconds from sending one to its beginning; letters have as many bytes before the first."""
        return _COMMAND_BYTES * self._box.byte_s + self._box.delay_s

    @property
    def again_s(self) -> float:
        """Seconds from the first letter of 5′ to the last."""
        return (TIMES - 1) * self._box.byte_s

    @property
    def lag(self) -> float:
        """Microsteps by which axis 1 is behind once a move is over, and what it may have become."""
        return self._closing.lag

    def may_be(self, half: int, axis: BoxAxis) -> bool:
        """Whether a move of twice so many microsteps is short enough, and harmless were its letter lost."""
        wire, per_half = abs(half) * self._settings.wire_per_half, self._settings.wire_per_half
        return abs(half) <= axis.model.longest_half and commands.harmless_below(wire, per_half) == wire

    def send(self, axis: BoxAxis, half: int, *, slew: bool = False, others: bool = False) -> None:
        """Begin a move of twice `half` microsteps, signed; `others` of the axis will follow within seconds.

        Raises
        ------
        DriveRefused, LinkError
            As `Box.send`; whether it was made is not known then.
        """
        command = commands.move(
            axis.index,
            abs(half) * self._settings.wire_per_half,
            decreasing=half < 0,
            axis_bit=self._settings.axis_bit,
        )
        with self._remembered():
            begin = self._box.send(command)
            axis.moved(abs(half), 1 if half > 0 else -1, begin, slew=slew)
            self._closing.sent(command, begin, soon=not others)
        self.unproved = True

    def send_trial(self, axis: BoxAxis, command: bytes, half: int) -> None:
        """Send a move of which nobody knows yet where it leads, and remember it for what it should be.

        Raises
        ------
        DriveRefused, LinkError
            As `Box.send`.
        """
        with self._remembered():
            axis.moved(abs(half), 1 if half > 0 else -1, self._box.send(command))

    @contextmanager
    def _remembered(self) -> Iterator[None]:
        """Let a program that comes after one that ends meanwhile know that a move was being sent."""
        self.sending = True
        self._remember()
        try:
            yield
        except (DriveError, TransportError):
            raise  # what a link that failed may have left in the box is in doubt from here on
        except BaseException:  # it may have been made and is not reckoned
            self._box.in_doubt = True
            raise
        finally:
            self.sending = False
            self._remember()

    def send_short(self, axis: BoxAxis, half: int, *, others: bool = False) -> None:
        """Send as much of a move as one command may be, and ask after it; `others` will follow within seconds."""
        per_half = self._settings.wire_per_half
        most = min(abs(half), axis.model.longest_half)
        made = commands.harmless_below(most * per_half, per_half) // per_half
        if made:
            self.send(axis, made if half > 0 else -made, others=others)
            self.prove()

    def send_steps(self, axis: BoxAxis, steps: int) -> None:
        """Make single microsteps of axis 2, signed with its angle.

        They are remembered as made before they are sent: a program that ends in between leaves them within what is
        stated.

        Raises
        ------
        DriveRefused, LinkError
            As `Box.send`.
        """
        north = (steps > 0) is not axis.north_falls
        command = commands.north(abs(steps)) if north else commands.south(abs(steps))
        axis.stepped(steps * axis.sign, self._box.now() + len(command) * self._box.byte_s + self._box.delay_s)
        self._remember()
        self._box.send(command)

    def begin_way(self) -> None:
        """A slew begins: it goes from where the axes are."""
        self._closing.begin_way()

    def by_letters(self, axis: BoxAxis, sign: int) -> None:
        """Move an axis 5′ with its counts or against them, which ends what the moves before may have become.

        Raises
        ------
        DriveRefused, LinkError
            As `Box.send`.
        """
        self._closing.close(axis, sign)
        self._remember()

    def back(self, axis: BoxAxis) -> None:
        """Move an axis 5′ to smaller angles of its motor.

        Raises
        ------
        DriveRefused, LinkError
            As `Box.send`.
        """
        self._closing.once(axis)
        self._remember()

    def prove(self) -> None:
        """Ask after what was sent."""
        self.unproved = False
        with suppress(TransportError):
            self._watch.ask(tries=1)
            return
        self._supervision.suspect()
        if not self._box.in_doubt:
            self._closing.end_all()
