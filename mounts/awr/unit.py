"""The unit at the far end of a link: one command outstanding, events collected whenever they come.

An answer has 100 ms for each packet. One that does not come in time may come later, and looks like any other `Y`: so
nothing is asked again before the line has been silent. Key releases alone are repeated at once, as they do no harm.
"""

import math
from collections import deque
from collections.abc import Callable, Mapping
from typing import NamedTuple

from mounts.awr import commands
from mounts.awr.errors import AwrError
from mounts.awr.messages import Done, Event, Message, Moving, Response, Status, Strange, Word, Written, decoded
from mounts.awr.packets import Packet, Packets
from mounts.awr.registers import (
    BY_ADDRESS,
    EARLIEST,
    RAM,
    REGISTERS,
    SURE,
    VERSION,
    WITH_STATUS,
    Register,
    supported,
    version_of,
)
from mounts.errors import DriveRefused, WrongProtocol
from mounts.steady import SteadyClock
from transports.errors import LinkError, NoAnswer
from transports.kept_link import LinkAtNeed
from transports.link import Clock, Link
from transports.memory import BITS_PER_BYTE

PACKET_S = 0.1  # for each packet of an answer, as the manual has it
KEY_S = 0.06  # for the answer to a key, as its release must not wait for it
RELEASE_AGAIN_S = 0.02  # after which a release that was not answered is sent again
_CHUNK = 256
_TRIES = 3
_RELEASES, _LINKS = 12, 3  # tries of a release, and links opened for it; opening one may take a second
_FAR_S = 1.0  # that an answer is waited for at last, on a link whose delay nobody knows yet
_ROUNDS = 30  # of waiting for silence, on a line that is never silent
_EVENTS = 500  # kept at most for one who does not listen
_AT_ONCE_S = 5e-4
_LOSSES = 3  # remembered
_PROMPT_S = 0.015  # within which a key that is answered was heard when it came


class Happened(NamedTuple):
    """An event, when it was, and how much earlier it may have been: the line was taken, or nobody listened."""

    event: Event
    time: float
    early_s: float = 0.0


class Heard(NamedTuple):
    """When the unit heard a command, POSIX seconds, at the earliest and at the latest."""

    first: float
    last: float


class Unit:
    """The unit.

    Parameters
    ----------
    open_link : callable
        Opens the link, and opens it anew where it was lost.
    clock : Clock
        Stamps what comes; the one that the link has.
    baud : int, optional
        Bits per second of the line; none for one that takes no time.
    timeout_s : float
        In which each packet of an answer must come at first, beside the line's own time; later tries wait longer.
    """

    def __init__(
        self, open_link: Callable[[], Link], clock: Clock, baud: int | None = None, timeout_s: float = PACKET_S
    ) -> None:
        self._kept = LinkAtNeed(open_link, self._renewed)
        self._clock = clock
        self.byte_s = BITS_PER_BYTE / baud if baud else 0.0
        """Line time of a byte."""
        self.timeout_s = timeout_s
        """For each packet of an answer."""
        self._packets = Packets(self.byte_s)
        self._events: deque[Happened] = deque(maxlen=_EVENTS)
        self._trips: deque[float] = deque(maxlen=8)  # seconds of the last round trips, without their line time
        self._strays = math.inf  # answers that nobody waits for any more and that may still come, at most
        self.version = EARLIEST
        """Firmware, once it was asked."""
        self.heard = Heard(-math.inf, -math.inf)
        """When the key or release that was sent last was heard."""
        self.written_for_good = False
        """The last soft write was answered as one into the non-volatile memory is."""
        self.damaged = 0
        """How often something was lost or mutilated on the line, as far as can be seen."""
        self.strange: deque[str] = deque(maxlen=_LOSSES)
        """Packets that say nothing."""
        self.before_each: Callable[[], object] = _nobody
        """Called before each command and each wait: a sign of life for whoever watches the host."""
        self.slice_s = float("inf")
        """The longest wait without it."""
        self.at_rest: Callable[[], bool] = _never
        """Whether no key is to be held: one that is told to move an axis is released, whatever is awaited."""
        self._promised: dict[int, float] = {}  # when the keys of axes are released, be another answer awaited
        self._kept_promises: dict[int, float] = {}  # when that was sent first

    @property
    def name(self) -> str:
        """The address of the link last opened."""
        return self._kept.name

    @property
    def delay_s(self) -> float:
        """Seconds in which a byte that has left comes to the unit: half of the quickest of the last round trips."""
        return min(self._trips, default=0.0) / 2.0

    @property
    def key_s(self) -> float:
        """Seconds from sending a key to its being heard."""
        return 3.0 * self.byte_s + self.delay_s

    @property
    def again_s(self) -> float:
        """Seconds after which a release that was not answered is sent again."""
        return RELEASE_AGAIN_S + 8.0 * self.byte_s + 2.0 * self.delay_s

    @property
    def debug(self) -> tuple[str, ...]:
        """The last debug output."""
        return tuple(self._packets.debug)

    def now(self) -> float:
        """POSIX seconds, by the clock of the link."""
        return self._clock.now()

    @property
    def clock_step(self) -> float:
        """Seconds by which the computer's clock was set while this one went on; 0 where it was not."""
        return self._clock.step() if isinstance(self._clock, SteadyClock) else 0.0

    def follow_clock(self) -> float:
        """Go by the computer's clock as it is now; return by how many seconds that differs from before."""
        off = self._clock.follow() if isinstance(self._clock, SteadyClock) else 0.0
        self._listened += off
        self._heard += off
        return off

    # What it says by itself ------------------------------------------------------------------------------------

    def events(self, *kinds: type[Event]) -> list[Happened]:
        """What happened since it was asked last, the oldest first; of some kinds only, where they are named."""
        wanted = kinds or (object,)
        found = [each for each in self._events if isinstance(each.event, wanted)]
        self._events = deque((each for each in self._events if not isinstance(each.event, wanted)), _EVENTS)
        return found

    def peek(self) -> tuple[Happened, ...]:
        """The same, left there."""
        return tuple(self._events)

    def listen(self, until: float, enough: Callable[[Event], bool] = lambda _: False) -> None:
        """Let time pass until POSIX `until`, or until an event that is enough; without waiting, take what is there.

        Raises
        ------
        LinkError
            The link was lost.
        """
        while True:
            self.before_each()
            before = len(self._events)
            self._hear(min(max(0.0, until - self.now()), self.slice_s))
            if any(enough(each.event) for each in list(self._events)[before:]) or self.now() >= until:
                return

    def _hear(self, seconds: float) -> list[tuple[Response, Packet]]:
        """Read once; collect events, return answers."""
        link = self._kept.opened()
        begun, since = self.now(), self._listened
        try:
            data = link.read(_CHUNK, seconds)
        except LinkError:
            self._kept.close()
            raise
        now = self.now()
        if data:
            self._heard = now
        # What was there at once may have come at any time since somebody waited for it last, and so may what is left.
        at_once = now - begun < _AT_ONCE_S
        unheard = max(0.0, begun - since) if at_once else 0.0
        self._listened = since if data and at_once else now
        answers = []
        for packet in self._packets.feed(data, self.now(), unheard):
            said: Message = decoded(packet.text)
            if isinstance(said, Strange):
                self.damaged += 1
                self.strange.append(said.why)
            elif isinstance(said, Response):
                answers.append((said, packet))
            else:
                time = packet.time - self.byte_s - self.delay_s
                self._events.append(Happened(said, time, packet.behind_s + packet.unheard_s))
        return answers

    # Commands --------------------------------------------------------------------------------------------------

    def key(self, body: str) -> float:
        """Press a key or choose a speed; return the POSIX time at which it was heard.

        Raises
        ------
        DriveRefused
            The unit does not obey: its override is on.
        NoAnswer, LinkError
            It does not answer; nobody knows whether it obeyed.
        """
        self._quiet()
        if self._answered(body, lambda said: isinstance(said, Done), KEY_S) != Done(ok=True):
            raise DriveRefused(
                f"the unit refuses {body!r}: its override input stopped it, or it is busy; press the override button "
                "at the drive box, then try again"
            )
        self._note_heard(self._sent)
        return self._sent + self.delay_s

    @property
    def silence_s(self) -> float:
        """Seconds of silence that must pass before a key is pressed, as an answer may still be on its way."""
        return self.timeout_s + 2.0 * self.delay_s if self._strays else 0.0

    def promise(self, releases: Mapping[int, float], axis: int | None) -> None:
        """Release other keys at their times, while one of an axis awaits its answer; of that it is known when."""
        self._promised = dict(releases)
        kept = self._kept_promises.items()
        self._kept_promises = {each: sent for each, sent in kept if each == axis or each in releases}

    def withdraw(self) -> None:
        """Nothing is to be released meanwhile any more."""
        self._promised.clear()

    def release(self, axes: tuple[int, ...] = (0, 1)) -> float:
        """Release the keys of axes, again and again until the unit has said so; return when the last one was heard.

        Raises
        ------
        NoAnswer, LinkError
            It does not answer, or the link was lost and could not be opened anew.
        """
        first = math.inf
        for i, axis in enumerate(axes):
            self._released(axis, axes[i:])
            first = min(first, self.heard.first)
        self.heard = Heard(first, self.heard.last)
        return self._sent + self.delay_s

    def _released(self, axis: int, rest: tuple[int, ...]) -> None:
        """Release the keys of an axis; those of the rest are to be released next.

        All answers are alike, so one counts only when more have come than may still come of other commands.
        """
        data, error = commands.packet(commands.RELEASES[axis]), None
        self._promised.pop(axis, None)
        first, lost_links, sends = math.inf, 0, 0
        silent_s = self.now() - max(self._sent, *self._kept_promises.values(), -math.inf)
        if math.isfinite(self._strays) and silent_s > self.timeout_s + 2.0 * self.delay_s:
            self._strays = 0  # what was not answered in time is lost
        for attempt in range(_RELEASES):
            try:
                if self._kept.opened() and math.isinf(self._strays):
                    first, sends = min(first, self.now()), 0
                    self._release_blindly(rest)
                self._sent = self._kept.opened().write(data)
                first, sends = min(first, self._sent), sends + 1
                due = self._sent + self.again_s
                due += _FAR_S if attempt == _RELEASES - 1 else 0.0
                while (left := due - self.now()) > 0.0:
                    if self._confirms(self._await(left), sends):
                        self._note_heard(min(first, self._kept_promises.pop(axis, math.inf)))
                        return
            except LinkError as lost:
                self._kept.close()
                error, lost_links, sends = lost, lost_links + 1, 0
                if lost_links == _LINKS:
                    break
            self.damaged += 1
        self._strays = math.inf  # so that the next time all keys are released at once, and no answer is awaited first
        raise error or NoAnswer(
            f"{self.name}: no unit confirms that its keys are released; check port, cable and power, and that the "
            "line is 9600 baud, 8N1. If the telescope moves, switch the drive box off"
        )

    def _release_blindly(self, axes: tuple[int, ...]) -> None:
        """On a new link nobody knows what is still answered: release the keys at once, then let it fall silent."""
        self._kept.opened().write(b"".join(commands.packet(commands.RELEASES[axis]) for axis in axes))
        since = self.now()
        self._quiet()
        if self._heard < since:
            self._strays = len(axes)  # it is farther than that, or nobody there

    def _confirms(self, answers: list[tuple[Response, Packet]], sends: int) -> bool:
        """Whether one of some answers is that of a release which was sent so often."""
        for said, packet in answers:
            if said == Done(ok=True) and not self._strays:
                self._strays = sends - 1
                self._answered_at = packet.time - self.byte_s - self.delay_s
                return True
            self._strays -= said == Done(ok=True)
        return False

    def _note_heard(self, first_sent: float) -> None:
        """A key was answered that was sent for the first time then."""
        first = first_sent + self.delay_s
        self.heard = Heard(first, first if self._answered_at - first < _PROMPT_S else self._answered_at)

    def read(self, address: int) -> int | None:
        """The word at an address, None where the unit does not tell it.

        Raises
        ------
        NoAnswer, LinkError
            It does not answer.
        """

        def mine(said: Response) -> bool:
            return said == Done(ok=False) or (isinstance(said, Word) and said.address == address)

        said = self._tried(commands.read(address), mine)
        return said.value if isinstance(said, Word) else None

    def read_all(self) -> dict[int, int]:
        """All words by address, as `??` tells them twice; those that differ, or are lost, are asked for one by one.

        Raises
        ------
        NoAnswer, LinkError
            It does not answer.
        """
        once, again = self._dump(), self._dump()
        words = {address: value for address, value in once.items() if again.get(address) == value}
        for register in REGISTERS:
            if register.address not in words:
                self.damaged += 1
                value = self._surely(register.address)
                if value is not None:
                    words[register.address] = value
        return words

    def _dump(self) -> dict[int, int]:
        self._quiet()
        words: dict[int, int] = {}
        self._send(commands.READ_ALL)
        due = self._sent + self.timeout_s + 12.0 * self.byte_s + 2.0 * self.delay_s
        while VERSION not in words and (left := due - self.now()) > 0.0:
            for said, _ in self._hear(left):
                if isinstance(said, Word) and said.address in BY_ADDRESS:
                    words[said.address] = said.value
                    due = self.now() + self.timeout_s + 12.0 * self.byte_s
        self._strays += VERSION not in words
        return words

    def _surely(self, address: int) -> int | None:
        """The word that two answers, one after the other, tell."""
        before = self.read(address)
        for _ in range(_TRIES):
            value = self.read(address)
            if value == before:
                break
            before = value
        return before

    def identify(self) -> str:
        """Find out the firmware; return what a person should know of it.

        Raises
        ------
        WrongProtocol
            What answers is no AWR Microstep, or an unknown firmware.
        NoAnswer, LinkError
            Nothing answers.
        """
        word = self._surely(VERSION)
        if word is None:
            raise WrongProtocol(
                f"{self.name}: it does not tell its VERSION: check the link, 9600 baud, 8N1, and [drive] kind; "
                f"firmware before {SURE} may speak without packets"
            )
        try:
            self.version = version_of(word)
            return supported(self.version)
        except AwrError as error:
            raise WrongProtocol(f"{self.name}: {error}") from None

    def soft_write(self, register: Register, value: int) -> float:
        """Write a word in RAM; return the POSIX time at which it was heard.

        Raises
        ------
        AwrError
            This register is never written, or not so.
        DriveRefused
            The unit does not take it.
        NoAnswer, LinkError
            It does not answer.
        """
        address = register.address | RAM

        def mine(said: Response) -> bool:
            return said == Done(ok=False) or (isinstance(said, Written) and said.address & ~RAM == register.address)

        said = self._tried(commands.soft_write(register, value), mine)
        if not (isinstance(said, Written) and said.ok):
            raise DriveRefused(
                f"the unit does not take {register.name} ({address:02X}) = {value}: `drive show` tells what it holds"
            )
        self.written_for_good = said.address == register.address
        return self._sent + self.delay_s

    def commit(self) -> None:
        """Have all soft writes kept for good: this wears its EEPROM, so only a person asks for it.

        Raises
        ------
        DriveRefused, NoAnswer, LinkError
            The unit refuses, or does not say that it has; it is not asked twice.
        """
        self._plain(commands.COMMIT, tries=1)

    def discard(self) -> float:
        """Have all soft writes forgotten; return the POSIX time at which it was heard.

        Raises
        ------
        DriveRefused, NoAnswer, LinkError
            The unit refuses, or does not answer.
        """
        self._plain(commands.DISCARD)
        return self._sent + self.delay_s

    def relay(self, number: int, *, on: bool) -> None:
        """Switch a relay.

        Raises
        ------
        AwrError
            There is no such relay.
        DriveRefused, NoAnswer, LinkError
            The unit refuses, or does not answer.
        """
        self._plain(commands.relay(number, on=on))

    def status(self) -> Status | None:
        """Relays and override; None where the firmware does not tell them.

        Raises
        ------
        NoAnswer, LinkError
            It does not answer.
        """
        if self.version < WITH_STATUS:
            return None
        said = self._tried(commands.ASK_STATUS, lambda said: isinstance(said, Status))
        return said if isinstance(said, Status) else None

    def close(self) -> None:
        """Close the link."""
        self._kept.close()

    # The line --------------------------------------------------------------------------------------------------

    _listened = float("-inf")  # POSIX seconds at which it was listened to last
    _heard = float("-inf")  # POSIX seconds at which something came last
    _sent = 0.0  # POSIX seconds at which the last command had left
    _answered_at = 0.0  # POSIX seconds at which the unit began to answer it

    def _plain(self, body: str, tries: int = _TRIES) -> None:
        said = self._tried(body, lambda said: isinstance(said, Done), tries)
        if said != Done(ok=True):
            raise DriveRefused(f"the unit refuses {body!r}; is its override on? `drive show` tells")

    def _tried(self, body: str, mine: Callable[[Response], bool], tries: int = _TRIES) -> Response:
        """Ask what does no harm when it is asked twice, again where the answer is lost."""
        error: LinkError | NoAnswer | None = None
        for attempt in range(tries):
            try:
                self._quiet(2.0**_TRIES * self.timeout_s if attempt and not self._trips else 0.0)
                return self._answered(body, mine, 2.0**attempt * self.timeout_s)
            except LinkError as lost:
                self._kept.close()
                error = lost
            except NoAnswer as silent:
                error = silent
            self.damaged += 1
        assert error is not None  # noqa: S101 - there was a try
        raise error

    def _answered(self, body: str, mine: Callable[[Response], bool], patience_s: float) -> Response:
        """Send a command and wait for its answer."""
        self._send(body)
        due = self._sent + patience_s + 12.0 * self.byte_s + 2.0 * self.delay_s
        while (left := due - self.now()) > 0.0:
            for said, packet in self._await(left):
                if mine(said):
                    self._trips.append(max(0.0, packet.time - self.byte_s - self._sent))
                    self._answered_at = packet.time - self.byte_s - self.delay_s
                    return said
                self.damaged += 1
        self._strays += 1
        raise NoAnswer(
            f"{self.name}: no answer to {body!r} within {patience_s:g} s; check port, cable and power, and that the "
            "line is 9600 baud, 8N1; a link that takes longer wants a longer timeout_s in [drive]"
        )

    def _send(self, body: str) -> None:
        self.before_each()
        try:
            self._sent = self._kept.opened().write(commands.packet(body))
        except LinkError:
            self._kept.close()
            raise

    def _quiet(self, longer_s: float = 0.0) -> None:
        """Take what has come; where an answer may still be on its way, wait until the line is silent.

        An answer to the last try would look like one to the next that came at once, so where nobody knows yet how far
        the unit is, that is waited for longer.
        """
        for _ in range(_ROUNDS):
            wait = max(longer_s, self.silence_s) if self._strays else 0.0
            since = self.now()
            while True:
                self._await(max(0.0, since + wait - self.now()))
                if self._heard >= since or self.now() - since >= wait * 0.999:
                    break
            if self.now() - self._heard >= wait * 0.999:
                break
        self._strays = 0

    def _await(self, seconds: float) -> list[tuple[Response, Packet]]:
        """Listen once for what is awaited, and release keys whose time has come meanwhile."""
        self.before_each()
        for axis, due in list(self._promised.items()):
            if due <= self.now():
                sent = self._kept.opened().write(commands.packet(commands.RELEASES[axis]))
                self._promised[axis] = math.inf if axis in self._kept_promises else sent + self.again_s
                self._kept_promises.setdefault(axis, sent)
                self._strays += 1
        soon = min(self._promised.values(), default=math.inf) - self.now()
        before = len(self._events)
        answers = self._hear(max(0.0, min(seconds, self.slice_s, soon)))
        if self.at_rest() and any(_moves(each) for each in list(self._events)[before:]):
            self._kept.opened().write(b"".join(map(commands.packet, commands.RELEASES)))
            self._strays += len(commands.RELEASES)
        return answers

    def _renewed(self) -> None:
        """Whatever was asked on the last link may be answered on a new one."""
        self._packets = Packets(self.byte_s)
        self._strays = math.inf


def _never() -> bool:
    """Nobody knows of keys."""
    return False


def _moves(happened: Happened) -> bool:
    """Whether it is told that an axis moves."""
    return isinstance(happened.event, Moving) and any(happened.event.axes)


def _nobody() -> None:
    """Nobody needs a sign of life."""
