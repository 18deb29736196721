"""The asking side of Modbus-ASCII: one request at a time, and never a value that was not its answer.

Frames carry no transaction number, so the answer to an earlier request looks like the answer to this one when
function and count agree. Hence the rules of this file:

- A request is sent only on an idle line with nothing left over, and its answer must agree in unit, function,
  byte count and, for writes, echoed address and value. Anything else is passed over while time remains.
- After a time-out, a wrong answer or a lost connection the line is in doubt: it is closed, opened anew and
  drained until quiet. If the next answer could be mistaken for one still missing, a marker is read first: a
  request whose answer has another shape than all those missing. A unit answers in order, so when the marker's
  answer is there no older one can follow. Where there is no marker the line must stay quiet for a whole
  time-out, and again after the answer.
- An answer with another frame on its heels is not taken: nothing tells which of them is the answer.
- Reads are repeated within one deadline. Writes are not: whether one took effect is for the caller to find out.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from transports.ascii_frame import Frame, FrameDecoder, encode_frame
from transports.errors import ExceptionReply, LinkError, NoAnswer, WrongAnswer
from transports.kept_link import CHUNK, KeptLink
from transports.link import Clock, Link
from transports.modbus_request import (
    Request,
    head_of,
    read_request,
    write_coil_request,
    write_register_request,
    write_registers_request,
)

IDLE_S = 0.004  # four characters at 9600 baud: a line silent this long is idle
QUIET_S = 0.1  # a line just opened must be silent this long
READ_ATTEMPTS = 2
_REMEDY = (
    "where the unit serves one client at a time, close the other, or wait until it has given up the last connection"
)

MEANING = {
    1: "illegal function",
    2: "illegal address",
    3: "illegal value",
    4: "device failure",
    5: "acknowledged, not done yet",
    6: "device busy",
    8: "memory parity error",
}


@dataclass(frozen=True)
class Answer:
    """What was read or written, and when."""

    values: tuple[int, ...]  # register values, or bits as 0 and 1
    sent: float  # POSIX time at which the request's last byte left
    received: float  # POSIX time at which the whole answer was here
    asked: float  # POSIX time before any of the request was given to the link


class ModbusAscii:
    """The master on a line to one unit.

    Parameters
    ----------
    open_link : callable
        Opens the link, and opens it anew after a doubt; raises `LinkError`.
    clock : Clock
        Measures deadlines and lets pauses pass.
    unit : int
        The unit's address.
    timeout_s : float
        How long an answer may take from the end of its request.
    deadline_s : float
        How long a call may take with reopening and repeating; one more time-out when the marker is late.
    """

    def __init__(
        self,
        open_link: Callable[[], Link],
        clock: Clock,
        *,
        unit: int = 0xFF,
        timeout_s: float = 0.5,
        deadline_s: float = 2.0,
    ) -> None:
        self._clock = clock
        self._unit = unit
        self._timeout = timeout_s
        self._deadline = max(deadline_s, timeout_s)
        self._kept = KeptLink(open_link, clock, deadline_s=self._deadline, remedy=_REMEDY)
        self._decoder = FrameDecoder()
        self._missing: set[bytes] = set()  # heads of answers that may still come
        self._answered: dict[bytes, Request] = {}  # reads that can serve as markers, by the head of the answer
        self._in_step = True  # no older answer can pass for the next
        self._last_heard = float("-inf")
        self._last_asked = float("-inf")

    @property
    def name(self) -> str:
        """The address of the link last opened."""
        return self._kept.name

    def read_coils(self, address: int, count: int) -> Answer:
        """Read `count` coils from `address` on.

        Raises
        ------
        NoAnswer, WrongAnswer, ExceptionReply, LinkError
            After `READ_ATTEMPTS` attempts, or when the deadline has passed. All methods raise these.
        """
        return self._read(read_request("coils", address, count))

    def read_discrete_inputs(self, address: int, count: int) -> Answer:
        """Read `count` discrete inputs from `address` on."""
        return self._read(read_request("discrete inputs", address, count))

    def read_holding_registers(self, address: int, count: int) -> Answer:
        """Read `count` holding registers from `address` on."""
        return self._read(read_request("holding registers", address, count))

    def read_input_registers(self, address: int, count: int) -> Answer:
        """Read `count` input registers from `address` on."""
        return self._read(read_request("input registers", address, count))

    def write_coil(self, address: int, value: bool) -> Answer:
        """Write one coil."""
        return self._write(write_coil_request(address, value), [int(value)])

    def write_register(self, address: int, value: int) -> Answer:
        """Write one holding register."""
        return self._write(write_register_request(address, value), [value])

    def write_registers(self, address: int, values: Sequence[int]) -> Answer:
        """Write holding registers from `address` on, in one request."""
        return self._write(write_registers_request(address, values), values)

    def close(self) -> None:
        """Close the link; the next request opens it again."""
        self._kept.close()

    def _read(self, request: Request) -> Answer:
        pdu, sent = self._ask(request, READ_ATTEMPTS)
        self._answered[request.head] = request
        return Answer(request.values(pdu), sent, self._last_heard, self._last_asked)

    def _write(self, request: Request, values: Sequence[int]) -> Answer:
        _, sent = self._ask(request, 1)
        return Answer(tuple(values), sent, self._last_heard, self._last_asked)

    def _ask(self, request: Request, attempts: int) -> tuple[bytes, float]:
        """Return the answer's PDU and when the request was sent, asking again while attempts and time remain."""
        latest = self._clock.now() + self._deadline - self._timeout  # the last moment to send a request
        while True:
            attempts -= 1
            try:
                return self._converse(self._link_in_step(request, latest), request)
            except (NoAnswer, WrongAnswer, LinkError):
                if not attempts or self._clock.now() >= latest:
                    raise

    def _link_in_step(self, request: Request, latest: float) -> Link:
        """Return the link, open and idle, on which no answer but its own can pass for that of `request`."""
        return self._kept.in_step(
            lambda link: self._is_clear(link, latest), lambda link: self._settle(link, request, latest), latest
        )

    def _is_clear(self, link: Link, latest: float) -> bool:
        """Whether nothing but noise was left on the line."""
        silence = self._clock.now() - self._last_heard
        try:
            strays = self._drain(link, min(max(IDLE_S - silence, 0.0), IDLE_S), latest)
        except LinkError:
            return False
        self._missing.update(head_of(frame.pdu) for frame in strays)
        return not strays and not self._decoder.begun

    def _settle(self, link: Link, request: Request, latest: float) -> None:
        """Bring a link just opened in step."""
        markers = [request, *self._answered.values(), *([request.narrowed] if request.narrowed else [])]
        marker = next((marker for marker in markers if marker.head not in self._missing), None)
        self._decoder = FrameDecoder()
        self._drain(link, QUIET_S if marker else self._timeout, latest)
        self._decoder = FrameDecoder()
        self._in_step = marker is not None
        if marker is None:
            self._missing.clear()
        elif marker is not request:
            self._converse(link, marker, is_marker=True)

    def _drain(self, link: Link, quiet_s: float, latest: float) -> list[Frame]:
        """Read until nothing came for `quiet_s`; return the frames that came."""
        return [frame for data in self._kept.drained(link, quiet_s, latest) for frame in self._decoder.feed(data)]

    def _converse(self, link: Link, request: Request, *, is_marker: bool = False) -> tuple[bytes, float]:
        """Send the request and wait for its answer; anything but an answer leaves the line in doubt."""
        refusable = not is_marker and all(head[0] != request.pdu[0] for head in self._missing)
        try:
            self._last_asked = self._clock.now()
            sent = link.write(encode_frame(self._unit, request.pdu))
            pdu, followers = self._await(link, request, sent + self._timeout, refusable=refusable)
            self._require_alone(link, request, followers)
        except (NoAnswer, WrongAnswer, LinkError):
            self._missing.add(request.head)
            self.close()
            raise
        self._missing.clear()
        if request.is_refused_by(pdu):
            code = pdu[1]
            raise ExceptionReply(
                f"{self.name}: unit {self._unit} refuses to {request.text}: "
                f"exception {code}, {MEANING.get(code, 'unknown')}",
                code,
            )
        return pdu, sent

    def _await(self, link: Link, request: Request, until: float, *, refusable: bool) -> tuple[bytes, list[Frame]]:
        """Return the PDU that answers `request`, or refuses it, and the frames that came right behind."""
        wrong: Frame | None = None
        while (left := until - self._clock.now()) > 0.0:
            data = link.read(CHUNK, min(left, self._timeout))  # a clock set back must not make it longer
            if not data:
                break
            frames = self._decoder.feed(data)
            self._last_heard = self._clock.now()
            for place, frame in enumerate(frames, start=1):
                if frame.unit == self._unit and (
                    request.is_answered_by(frame.pdu) or (refusable and request.is_refused_by(frame.pdu))
                ):
                    return frame.pdu, frames[place:]
                wrong = frame
        if wrong:
            raise WrongAnswer(
                f"{self.name}: asked unit {self._unit} to {request.text}, answered by unit {wrong.unit} with "
                f"{wrong.pdu.hex(' ')}; check that no other program uses the unit"
            )
        raise NoAnswer(
            f"{self.name}: unit {self._unit} did not answer within {self._timeout:g} s to: {request.text}; "
            "check power, cable, address and baud rate"
        )

    def _require_alone(self, link: Link, request: Request, followers: list[Frame]) -> None:
        """Refuse an answer that others follow; out of step, wait for them as long as for an answer."""
        if not self._in_step:
            self._in_step = True
            followers = followers + self._drain(link, self._timeout, self._clock.now() + self._timeout)
        if followers:
            self._missing.update(head_of(frame.pdu) for frame in followers)
            raise WrongAnswer(
                f"{self.name}: unit {self._unit} answered {1 + len(followers)} times to: {request.text}; "
                "check that no other program uses the unit"
            )
