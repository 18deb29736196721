"""The asking side of Modbus-ASCII: one request at a time, and never a value that was not its answer.

Frames carry no transaction number, so the answer to an earlier request looks like the answer to this one when
function and count agree. Hence the rules of this file:

- A request is sent only on an idle line with nothing left over, and its answer must agree in unit, function,
  byte count and, for writes, echoed address and value. Anything else is passed over while time remains.
- After a time-out, a wrong answer or a lost connection the line is in doubt: it is closed and opened anew,
  drained until quiet, and then a marker is read: a request the unit has answered before, and whose answer
  differs in shape from every answer still missing. A unit answers in order, so when the marker's answer is
  there no older one can follow. Without a marker the line must stay quiet for a whole time-out.
- Reads are repeated within one deadline. Writes are not: whether one took effect is for the caller to find out.

PDUs are pymodbus's; link, deadlines and checks are here. (Modbus Application Protocol V1.1b3.)
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import cast

from pymodbus.pdu import DecodePDU, ModbusPDU
from pymodbus.pdu.bit_message import ReadCoilsRequest, ReadDiscreteInputsRequest, WriteSingleCoilRequest
from pymodbus.pdu.register_message import (
    ReadHoldingRegistersRequest,
    ReadInputRegistersRequest,
    WriteMultipleRegistersRequest,
    WriteSingleRegisterRequest,
)

from transports.ascii_frame import Frame, FrameDecoder, encode_frame
from transports.errors import ExceptionReply, LinkError, NoAnswer, TransportError, WrongAnswer
from transports.link import Clock, Link

IDLE_S = 0.004  # four characters at 9600 baud: a line silent this long is idle
QUIET_S = 0.1  # a line just opened must be silent this long
REOPEN_PAUSE_S = 0.1  # between attempts to open: a unit with one client at a time may still hold the last
READ_ATTEMPTS = 2
CHUNK = 4096

_ANSWERS = DecodePDU(is_server=False)

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


@dataclass(frozen=True)
class _Request:
    """A request with the shape of its answer."""

    text: str
    pdu: bytes
    head: bytes  # what the answer's PDU begins with
    size: int  # how long it is
    count: int

    def is_answered_by(self, pdu: bytes) -> bool:
        return len(pdu) == self.size and pdu.startswith(self.head)

    def is_refused_by(self, pdu: bytes) -> bool:
        return len(pdu) == 2 and pdu[0] == self.pdu[0] | 0x80


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
        self._open = open_link
        self._clock = clock
        self._unit = unit
        self._timeout = timeout_s
        self._deadline = max(deadline_s, timeout_s)
        self._link: Link | None = None
        self._name = "link"
        self._decoder = FrameDecoder()
        self._strays: list[Frame] = []  # came behind an answer
        self._missing: set[bytes] = set()  # heads of answers that may still come
        self._markers: dict[bytes, _Request] = {}  # reads that were answered, by the head of the answer
        self._last_heard = float("-inf")

    @property
    def name(self) -> str:
        """The address of the link last opened."""
        return self._name

    def read_coils(self, address: int, count: int) -> Answer:
        """Read `count` coils from `address` on.

        Raises
        ------
        NoAnswer, WrongAnswer, ExceptionReply, LinkError
            After `READ_ATTEMPTS` attempts, or when the deadline has passed. All methods raise these.
        """
        return self._read(ReadCoilsRequest(address=address, count=count), 2000, "coils")

    def read_discrete_inputs(self, address: int, count: int) -> Answer:
        """Read `count` discrete inputs from `address` on."""
        return self._read(ReadDiscreteInputsRequest(address=address, count=count), 2000, "discrete inputs")

    def read_holding_registers(self, address: int, count: int) -> Answer:
        """Read `count` holding registers from `address` on."""
        return self._read(ReadHoldingRegistersRequest(address=address, count=count), 125, "holding registers")

    def read_input_registers(self, address: int, count: int) -> Answer:
        """Read `count` input registers from `address` on."""
        return self._read(ReadInputRegistersRequest(address=address, count=count), 125, "input registers")

    def write_coil(self, address: int, value: bool) -> Answer:
        """Write one coil."""
        return self._write(WriteSingleCoilRequest(address=address, bits=[value]), [int(value)], "coil")

    def write_register(self, address: int, value: int) -> Answer:
        """Write one holding register."""
        return self._write(WriteSingleRegisterRequest(address=address, registers=[value]), [value], "register")

    def write_registers(self, address: int, values: Sequence[int]) -> Answer:
        """Write holding registers from `address` on, in one request."""
        request = WriteMultipleRegistersRequest(address=address, registers=list(values))
        return self._write(request, values, "registers")

    def close(self) -> None:
        """Close the link; the next request opens it again."""
        if self._link is not None:
            self._link.close()
            self._link = None

    def _read(self, pdu: ModbusPDU, most: int, noun: str) -> Answer:
        function, count = pdu.function_code, pdu.count
        _require_within(f"count of {noun}", count, 1, most)
        _require_within("address", pdu.address, 0, 0x10000 - count)
        size = 2 * count if function in (3, 4) else (count + 7) // 8
        request = _Request(
            f"read {count} {noun} at {pdu.address:#06x}",
            bytes((function,)) + pdu.encode(),
            bytes((function, size)),
            2 + size,
            count,
        )
        answer = self._ask(request, READ_ATTEMPTS)
        self._markers[request.head] = request
        return answer

    def _write(self, pdu: ModbusPDU, values: Sequence[int], noun: str) -> Answer:
        _require_within(f"number of {noun}", len(values), 1, 123)
        _require_within("address", pdu.address, 0, 0x10000 - len(values))
        for value in values:
            _require_within(f"value for {noun} at {pdu.address:#06x}", value, 0, 0xFFFF)
        raw = bytes((pdu.function_code,)) + pdu.encode()
        text = f"write {noun} at {pdu.address:#06x}: {', '.join(f'{value:#x}' for value in values)}"
        answer = self._ask(_Request(text, raw, raw[:5], 5, len(values)), 1)
        return Answer(tuple(values), answer.sent, answer.received)

    def _ask(self, request: _Request, attempts: int) -> Answer:
        """Return the answer, asking up to `attempts` times within the deadline."""
        latest = self._clock.now() + self._deadline - self._timeout  # the last moment to send a request
        while True:
            attempts -= 1
            try:
                return self._converse(self._link_in_step(latest), request)
            except (NoAnswer, WrongAnswer, LinkError):
                if not attempts or self._clock.now() >= latest:
                    raise

    def _link_in_step(self, latest: float) -> Link:
        """Return the link, open, idle and with no answer missing."""
        if self._link is not None and not self._is_clear(self._link, latest):
            self._doubt()
        while self._link is None:
            try:
                self._link = self._open()
                self._name = self._link.name
                self._settle(self._link, latest)
            except LinkError as error:
                self.close()
                if self._clock.now() + REOPEN_PAUSE_S > latest:
                    raise LinkError(
                        f"{error}; tried for {self._deadline:g} s: where the unit serves one client at a time, "
                        "close the other, or wait until it has given up the last connection"
                    ) from error
                self._clock.sleep(REOPEN_PAUSE_S)
        return self._link

    def _is_clear(self, link: Link, latest: float) -> bool:
        """Whether nothing but noise was left on the line."""
        idle_since = self._clock.now() - self._last_heard
        try:
            self._strays += self._drain(link, min(max(IDLE_S - idle_since, 0.0), IDLE_S), latest)
        except LinkError:
            return False
        return not self._strays and not self._decoder.begun

    def _drain(self, link: Link, quiet_s: float, latest: float) -> list[Frame]:
        """Read until nothing came for `quiet_s`; return the frames that came."""
        frames = []
        while data := link.read(CHUNK, quiet_s):
            frames += self._decoder.feed(data)
            if self._clock.now() > latest:
                raise LinkError(f"{link.name}: the line does not fall silent; check cable, baud rate and earth")
        return frames

    def _settle(self, link: Link, latest: float) -> None:
        """Bring a link just opened in step: nothing missing may come any more."""
        self._decoder = FrameDecoder()
        marker = next((self._markers[head] for head in self._markers if head not in self._missing), None)
        self._drain(link, QUIET_S if marker or not self._missing else self._timeout, latest)
        self._decoder = FrameDecoder()
        if marker and self._missing:
            self._converse(link, marker, refusable=False)
        self._missing.clear()

    def _converse(self, link: Link, request: _Request, *, refusable: bool = True) -> Answer:
        """Send the request and wait for its answer; anything but an answer leaves the line in doubt."""
        try:
            sent = link.write(encode_frame(self._unit, request.pdu))
            pdu = self._await(link, request, sent + self._timeout, refusable=refusable)
        except (NoAnswer, WrongAnswer, LinkError):
            self._missing.add(request.head)
            self._doubt()
            raise
        if request.is_refused_by(pdu):
            code = pdu[1]
            raise ExceptionReply(
                f"{self._name}: unit {self._unit} refuses to {request.text}: "
                f"exception {code}, {MEANING.get(code, 'unknown')}",
                code,
            )
        return Answer(_values(request, pdu), sent, self._last_heard)

    def _await(self, link: Link, request: _Request, until: float, *, refusable: bool) -> bytes:
        """Return the PDU that answers `request`, or refuses it."""
        wrong: Frame | None = None
        while (left := until - self._clock.now()) > 0.0:
            frames = self._decoder.feed(link.read(CHUNK, left))
            self._last_heard = self._clock.now()
            for place, frame in enumerate(frames, start=1):
                if frame.unit == self._unit and (
                    request.is_answered_by(frame.pdu) or (refusable and request.is_refused_by(frame.pdu))
                ):
                    self._strays = frames[place:]
                    return frame.pdu
                wrong = frame
        if wrong:
            raise WrongAnswer(
                f"{self._name}: asked unit {self._unit} to {request.text}, "
                f"answered by unit {wrong.unit} with {wrong.pdu.hex(' ')}; check that no other program uses the unit"
            )
        raise NoAnswer(
            f"{self._name}: unit {self._unit} did not answer within {self._timeout:g} s to: {request.text}; "
            "check power, cable, address and baud rate"
        )

    def _doubt(self) -> None:
        """Give the line up; the next request opens it anew and brings it in step."""
        self._missing.update(frame.pdu[:2] for frame in self._strays)
        self._strays = []
        self.close()


def _values(request: _Request, pdu: bytes) -> tuple[int, ...]:
    answer = cast("ModbusPDU", _ANSWERS.decode(pdu))
    return tuple(map(int, answer.registers or answer.bits))[: request.count]


def _require_within(what: str, value: int, least: int, most: int) -> None:
    if not least <= value <= most:
        raise TransportError(f"{what} {value} is not within {least} to {most}")
