"""The asking side of a line to axis controllers: one command at a time, and never an answer that was not its own.

A reply carries no number, only the echo of its command, so the late answer to an earlier STATUS looks like the answer
to this one. Hence the rules of this file:

- A command is sent only on an idle line with nothing left over. Its answer must echo it, blanks and case apart; what
  echoes another command is passed over while time remains. An answer with another on its heels is not taken.
- After a time-out, a wrong answer or a lost connection the line is in doubt: it is closed, opened anew and drained
  until quiet. If a late answer could have the echo of the next command, a marker is asked first, a harmless command
  whose echo is not among those missing. Controllers answer in order: behind the marker's answer no older one comes.
  Where every marker is missing itself, the line must stay quiet for a whole time-out.
- Only commands that mean the same when carried out twice are sent again, within one deadline.

**A node whose answer was lost may be in the buffer or not**, and STATUS cannot tell. Sending it again would put it in
twice or have it refused, so it is not sent again. What is safe: while tracking, go on with the *next* node; the cubic
then spans two intervals and its error is 16-fold, 16 mas where one interval makes 1 mas. Within a slew one cubic
cannot span two phases: DRIFT flushes whatever was taken and answers where the axis is, and the slew is planned anew
from there. MOVE alone ends the motion in either case; DRIFT, MOVE alone and INIT may be sent until one is echoed.
A command that came back *changed* was obeyed as it came back: `WrongAnswer`, and then too DRIFT or MOVE repairs.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

from mounts.apo.commands import normal
from mounts.apo.errors import MalformedReply
from mounts.apo.replies import Reply, ReplyDecoder
from transports.errors import LinkError, NoAnswer, WrongAnswer
from transports.kept_link import CHUNK, REOPEN_PAUSE_S, KeptLink
from transports.link import Clock, Link
from transports.memory import BITS_PER_BYTE

QUIET_S = 0.1  # a line just opened must be silent this long
_REMEDY = "check cable and power, and whether another program holds the line"


@dataclass(frozen=True)
class Request:
    """What is asked.

    Attributes
    ----------
    text : str
        The line without its CR.
    answer_bytes : int
        The longest answer to expect beyond the echo.
    repeatable : bool
        Whether it may be sent again when its answer was lost.
    markers : tuple of str
        Harmless lines by whose echo the line is brought in step.
    before : str
        A line that must have been answered before each attempt: the word that selects an axis; empty for none.
    """

    text: str
    answer_bytes: int = 128
    repeatable: bool = True
    markers: tuple[str, ...] = ("ID", "HELP ID")
    before: str = ""


@dataclass(frozen=True)
class Answer:
    """What was answered, and when.

    Attributes
    ----------
    reply : Reply
        Its echo is that of the request.
    asked : float
        POSIX time before any of the request was given to the link.
    sent : float
        POSIX time at which its last byte left; the controller acts from then on.
    began : float
        POSIX time at which its first byte can have left at the latest, by the line's speed.
    received : float
        POSIX time at which the whole answer was here.
    repeated : bool
        Whether it is to a request that was sent again, for the answer to an earlier one was lost.
    """

    reply: Reply
    asked: float
    sent: float
    began: float
    received: float
    repeated: bool = False


class Line:
    """A line to one controller, or to several that share it.

    Parameters
    ----------
    open_link : callable
        Opens the link, and opens it anew after a doubt; raises `LinkError`.
    clock : Clock
        Measures deadlines and lets pauses pass.
    baud : int, optional
        Speed of the line, from which the time of a long answer follows; none for a line that takes no time.
    timeout_s : float
        How long an answer may take, its line time apart.
    deadline_s : float
        How long a call may take with reopening and repeating.
    """

    def __init__(
        self,
        open_link: Callable[[], Link],
        clock: Clock,
        *,
        baud: int | None = None,
        timeout_s: float = 0.5,
        deadline_s: float = 2.0,
    ) -> None:
        self._clock = clock
        self._byte_time = BITS_PER_BYTE / baud if baud else 0.0
        self._timeout = timeout_s
        self._deadline = max(deadline_s, timeout_s)
        self._kept = KeptLink(open_link, clock, deadline_s=self._deadline, remedy=_REMEDY)
        self._decoder = ReplyDecoder()
        self._missing: set[str] = set()  # echoes of answers that may still come
        self._last_asked = float("-inf")

    @property
    def name(self) -> str:
        """The address of the link last opened."""
        return self._kept.name

    def time_of(self, text: str, answer_bytes: int = 32) -> float:
        """Return the line time of a command, its echo and its answer, seconds."""
        return self._byte_time * (2 * len(text) + 2 + answer_bytes)

    def ask(self, request: Request) -> Answer:
        """Return the answer to `request`; it may be one that refuses.

        Raises
        ------
        NoAnswer, WrongAnswer
            None came in time, or another; see above on what may have been carried out.
        LinkError
            The link cannot be opened, or was lost.
        """
        latest = self._clock.now() + self._deadline - self._timeout  # the last moment to send
        repeated = False
        while True:
            link = self._ready(request, latest)
            try:
                return replace(self._converse(link, request.text, request.answer_bytes), repeated=repeated)
            except (NoAnswer, WrongAnswer, LinkError):
                if not request.repeatable or self._clock.now() >= latest:
                    raise
                repeated = True

    def close(self) -> None:
        """Close the link; the next request opens it again."""
        self._kept.close()

    def _ready(self, request: Request, latest: float) -> Link:
        """Return the link, in step and with the axis selected; nothing of `request` has been sent yet."""
        while True:
            try:
                link = self._link_in_step(request, latest)
                if request.before:
                    self._converse(link, request.before)
            except (NoAnswer, WrongAnswer, LinkError):
                if self._clock.now() + REOPEN_PAUSE_S > latest:
                    raise
            else:
                return link

    def _link_in_step(self, request: Request, latest: float) -> Link:
        """Return the link, open and idle, on which no answer but its own can pass for that to `request`."""
        return self._kept.in_step(
            lambda link: self._is_clear(link, latest), lambda link: self._settle(link, request, latest), latest
        )

    def _is_clear(self, link: Link, latest: float) -> bool:
        """Whether nothing but line ends was left on the line."""
        try:
            strays = list(self._drain(link, 0.0, latest))
        except (LinkError, MalformedReply):
            return False
        self._missing.update(normal(reply.echo) for reply in strays)
        return not strays and not self._decoder.begun

    def _settle(self, link: Link, request: Request, latest: float) -> None:
        """Bring a link just opened in step."""
        known = [request.before] if request.before else []
        wanted = (*known, request.text, *request.markers)
        marker = next((text for text in wanted if normal(text) not in self._missing), None)
        self._decoder = ReplyDecoder()
        try:
            for _ in self._drain(link, QUIET_S if marker else self._timeout, latest):
                pass
        except MalformedReply as error:
            raise LinkError(f"{link.name}: {error}") from error
        self._decoder = ReplyDecoder()
        if marker is None:
            self._missing.clear()
        elif marker in request.markers:
            self._converse(link, marker)

    def _drain(self, link: Link, quiet_s: float, latest: float) -> Iterator[Reply]:
        """Read until nothing came for `quiet_s`; yield the replies that came."""
        for data in self._kept.drained(link, quiet_s, latest):
            yield from self._decoder.feed(data)

    def _converse(self, link: Link, text: str, answer_bytes: int = 128) -> Answer:
        """Send a line and wait for its answer; anything but an answer leaves the line in doubt."""
        try:
            self._last_asked = self._clock.now()
            sent = link.write(text.encode("ascii") + b"\r")
            reply = self._await(link, text, sent, self._timeout + self._byte_time * (len(text) + answer_bytes))
            received = self._clock.now()
        except (NoAnswer, WrongAnswer, LinkError):
            self._missing.add(normal(text))
            self.close()
            raise
        self._missing.clear()
        began = max(sent, received - self._byte_time * reply.size)
        return Answer(reply, self._last_asked, sent, began, received)

    def _await(self, link: Link, text: str, sent: float, wait_s: float) -> Reply:
        """Return the reply that echoes `text`."""
        echoed = ""
        while (left := sent + wait_s - self._clock.now()) > 0.0:
            data = link.read(CHUNK, min(left, wait_s))  # a clock set back must not make it longer
            if not data:
                break
            try:
                replies = self._decoder.feed(data)
            except MalformedReply as error:
                raise WrongAnswer(f"{link.name}: to {text!r}: {error}") from error
            for place, reply in enumerate(replies, start=1):
                if normal(reply.echo) != normal(text):
                    echoed = reply.echo or "an OK without an echo"
                elif replies[place:] or self._decoder.begun:
                    raise WrongAnswer(
                        f"{link.name}: {text!r} was answered more than once; check that no other program uses the "
                        "line"
                    )
                else:
                    return reply
        raise self._unanswered(link, text, echoed)

    def _unanswered(self, link: Link, text: str, echoed: str) -> NoAnswer | WrongAnswer:
        """What is to be raised where no reply echoed `text`, but perhaps another one did another line."""
        if echoed:
            return WrongAnswer(
                f"{link.name}: {text!r} was echoed as {echoed[:80]!r}; it may have been obeyed so: check cable and "
                "baud rate, and that no other program uses the line"
            )
        return NoAnswer(
            f"{link.name}: no answer within {self._timeout:g} s to {text!r}; check power, cable and baud rate, and "
            "drive.timeout_s of a slow link"
        )
