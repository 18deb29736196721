"""The box at the far end of a link: commands out, the two answers back.

Nothing is acknowledged. A command goes out whole, in one write; where the link fails within one that has argument
bytes, the box may wait for the rest, and the next byte that it gets, whatever it is meant to be, would complete it: a
move of thousands of turns. So nothing is sent any more then, until a person has switched the box off and on.
"""

from collections.abc import Callable
from typing import NamedTuple

from mounts.avr_box.answers import LENGTH, AnswerDecoder, Pair
from mounts.avr_box.commands import COMMANDS, rest_of
from mounts.avr_box.trust import Trust
from mounts.errors import DriveRefused, WrongProtocol
from mounts.steady import SteadyClock
from transports.errors import LinkError, NoAnswer
from transports.kept_link import LinkAtNeed
from transports.link import Clock, Link
from transports.memory import BITS_PER_BYTE

ANSWER_S = 0.25  # in which an answer has begun, beyond its line time
_QUIET_S = 0.05
_TRIES = 3
_RUBBISH = 4096  # bytes of what nobody asked for that may wait to be read
_STRANGE = 64  # bytes of something else after which it is no box that talks
_MOST_ARGUMENTS = max(command.arguments for command in COMMANDS.values())
_STRANGER = (
    "{}: what talks there is no stepper box, which says nothing that it was not asked: check the port, 9600 baud, "
    "8N1, and [drive] kind"
)
HALF_A_COMMAND = (
    "the link failed or the program ended in the middle of a command, and the box may wait for the rest of it: the "
    "next byte would begin a move of any length, so nothing is sent any more. Switch the box off and on, then `sync`"
)


class Told(NamedTuple):
    """An answer, and the POSIX times between which it was true."""

    pair: Pair
    earliest: float
    latest: float

    @property
    def middle(self) -> float:
        """POSIX seconds."""
        return (self.earliest + self.latest) / 2.0


class Box:
    """The box.

    Parameters
    ----------
    open_link : callable
        Opens the link, and opens it anew where it was lost.
    clock : Clock
        Stamps the answers; the one that the link has.
    baud : int, optional
        Bits per second of the line; none for one that takes no time.
    """

    def __init__(self, open_link: Callable[[], Link], clock: Clock, baud: int | None = None) -> None:
        self._kept = LinkAtNeed(open_link, self._renewed)
        self._clock = clock
        self.byte_s = BITS_PER_BYTE / baud if baud else 0.0
        """Line time of a byte."""
        self._unsettled = True  # something may still come that nobody asks for any more
        self._fresh = True  # nothing was asked since it was opened: what comes is of others
        self._trips: list[float] = []  # seconds, the last few round trips without their line time
        self.in_doubt = False
        """Whether half a command may stand in the box; a program that begins is told so by the one before it."""
        self.trust = Trust()
        """What of all that was sent is believed."""

    @property
    def name(self) -> str:
        """The address of the link last opened."""
        return self._kept.name

    @property
    def delay_s(self) -> float:
        """Seconds in which a byte that has left comes to the box: half of the quickest of the last round trips."""
        return min(self._trips, default=0.0) / 2.0

    def now(self) -> float:
        """POSIX seconds, by the clock of the link: all of this is timed by it."""
        return self._clock.now()

    @property
    def behind(self) -> float:
        """Seconds that this time is behind the computer's, which may have been set while moves were timed."""
        return self._clock.behind() if isinstance(self._clock, SteadyClock) else 0.0

    def send(self, command: bytes) -> float:
        """Send a command whole; return the POSIX time at which the box has it.

        Raises
        ------
        DriveRefused
            Half a command may stand in the box; nothing was sent.
        LinkError
            The link was lost; half of this one may stand in the box from now on.
        """
        self._require_sound()
        link = self._kept.opened()
        try:
            begin = link.write(command) + self.delay_s
        except BaseException as error:  # whatever ends it, a person's Ctrl-C as well: part of it may have gone out
            self.in_doubt = COMMANDS[chr(command[0])].arguments > 0
            if isinstance(error, LinkError):
                self._kept.close()
            raise
        self.trust.sent(chr(command[0]), begin)
        return begin

    def repeat(self, letter: bytes, times: int) -> tuple[float, float]:
        """Send a command of one letter several times; return when the box has the first and the last, POSIX seconds.

        Raises
        ------
        DriveRefused, LinkError
            As `send`.
        """
        first = last = self.send(letter)
        for _ in range(times - 1):
            last = self._written(letter)
        return first, last

    def fill(self, command: bytes) -> None:
        """Send bytes that are no command, after which no part of the last one waits for its rest.

        Raises
        ------
        DriveRefused, LinkError
            As `send`; none of this stands in the box.
        """
        self._require_sound()
        self._written(rest_of(command))

    def _written(self, data: bytes) -> float:
        """Send what leaves nothing in the box; return when it has it, POSIX seconds."""
        try:
            return self._kept.opened().write(data) + self.delay_s
        except LinkError:
            self._kept.close()
            raise

    def ask(self, question: bytes, tries: int = _TRIES) -> Told:
        """Ask `P` or `Q`, again where the answer is lost or garbled.

        Raises
        ------
        DriveRefused
            Half a command may stand in the box; nothing was sent.
        NoAnswer, LinkError
            Nothing that is an answer came.
        WrongProtocol
            Something talks that is no stepper box.
        """
        self._require_sound()
        error: LinkError | NoAnswer | None = None
        for _ in range(tries):
            try:
                return self._asked(self._kept.opened(), question)
            except LinkError as lost:
                self._kept.close()
                error = lost
            except NoAnswer as silent:
                error = silent
            self.trust.flawed()
        assert error is not None  # noqa: S101 - there was a try
        raise error

    def pause(self, until: float) -> None:
        """Let time pass until POSIX `until` on the link's own clock; what comes meanwhile was not asked for."""
        while (left := until - self._clock.now()) > 0.0:
            self._kept.opened().read(LENGTH, left)

    def switched_on(self) -> None:
        """A person says that the box was switched off and on: nothing stands in it.

        Zeros, which are no command, are sent first. If it was not so, they complete what stands in the box to a move
        no longer than the one that was cut off.

        Raises
        ------
        LinkError
            The link was lost; it is as it was.
        """
        if not self.in_doubt:
            return
        try:
            self._kept.opened().write(bytes(_MOST_ARGUMENTS))
        except LinkError:
            self._kept.close()
            raise
        self.in_doubt = False

    def close(self) -> None:
        """Close the link."""
        self._kept.close()

    def _asked(self, link: Link, question: bytes) -> Told:
        self._clear(link)
        late = self._unsettled  # one before was not answered, and its answer may come ahead of this one's
        self._unsettled, self._fresh = True, False
        decoder = AnswerDecoder()
        sent = link.write(question)
        due, come = sent + ANSWER_S + LENGTH * self.byte_s, 0
        while (left := due - self._clock.now()) > 0.0 and come < _STRANGE:
            data = link.read(LENGTH, left)
            come += len(data)
            if pairs := decoder.feed(data):
                if come > LENGTH:
                    self.trust.flawed()
                self.trust.answered()
                told = self._told(pairs[0], sent)
                return self._told_last(link, told) if late else told
        if come >= _STRANGE:
            raise WrongProtocol(_STRANGER.format(link.name))
        what = "something that is no answer of a stepper box" if come else "nothing"
        raise NoAnswer(
            f"{link.name}: {what} came to {question.decode()!r}; check port, cable and power, and 9600 baud, 8N1"
        )

    def _told_last(self, link: Link, told: Told) -> Told:
        """The last of what comes while the line is not quiet."""
        decoder = AnswerDecoder()
        while data := link.read(LENGTH, LENGTH * self.byte_s + _QUIET_S):
            self.trust.flawed()
            if pairs := decoder.feed(data):
                told = self._told(pairs[-1], told.earliest)
        return told

    def _clear(self, link: Link) -> None:
        """Throw away what nobody asked for; a port that does not fall silent is not that of a box."""
        come = 0
        while data := link.read(256, _QUIET_S if self._unsettled else 0.0):
            if not self._fresh:
                self.trust.flawed()
            come += len(data)
            if come > _RUBBISH:
                raise WrongProtocol(_STRANGER.format(link.name))

    def _told(self, pair: Pair, sent: float) -> Told:
        """What was said was true between the question's last byte and the answer's first."""
        self._unsettled = False
        begun = self._clock.now() - LENGTH * self.byte_s
        self._trips = [*self._trips[-_TRIES:], max(0.0, begun - sent)]
        return Told(pair, sent, max(sent, begun))

    def _require_sound(self) -> None:
        if self.in_doubt:
            raise DriveRefused(HALF_A_COMMAND)

    def _renewed(self) -> None:
        """Whatever comes on a new link is of others."""
        self._unsettled = self._fresh = True
