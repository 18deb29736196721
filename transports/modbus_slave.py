"""The answering side of Modbus-ASCII: requests out of bytes, put to a bank of registers, and answered.

Function codes 1 to 6, 15 and 16. A frame for another unit or with a wrong LRC gets no answer; a request the
bank refuses gets the exception reply. (Modbus Application Protocol V1.1b3, sections 6 and 7.)
"""

import struct
from collections.abc import Callable, Sequence
from typing import ClassVar, Protocol, TypeVar

from transports.ascii_frame import FrameDecoder, encode_frame
from transports.errors import TransportError

_T = TypeVar("_T")
_COIL = {0x0000: False, 0xFF00: True}


class Refusal(TransportError):  # noqa: N818 - what the unit does
    """A request that is answered with an exception reply."""

    code: ClassVar[int]


class IllegalFunction(Refusal):
    """The function code is not implemented."""

    code = 1


class IllegalAddress(Refusal):
    """There is nothing at this address, or not this much."""

    code = 2


class IllegalValue(Refusal):
    """The value cannot be written, or the request is malformed."""

    code = 3


class RegisterBank(Protocol):
    """What a unit holds. Every method may raise `IllegalAddress` or `IllegalValue`."""

    def read_coils(self, address: int, count: int) -> list[bool]:
        """Return `count` coils from `address` on."""
        ...

    def read_discrete_inputs(self, address: int, count: int) -> list[bool]:
        """Return `count` discrete inputs from `address` on."""
        ...

    def read_holding_registers(self, address: int, count: int) -> list[int]:
        """Return `count` holding registers from `address` on."""
        ...

    def read_input_registers(self, address: int, count: int) -> list[int]:
        """Return `count` input registers from `address` on."""
        ...

    def write_coils(self, address: int, values: list[bool]) -> None:
        """Write coils from `address` on."""
        ...

    def write_registers(self, address: int, values: list[int]) -> None:
        """Write holding registers from `address` on."""
        ...


class ModbusSlave:
    """A unit on a Modbus-ASCII line.

    Parameters
    ----------
    bank : RegisterBank
        What is read and written.
    unit : int
        The address answered to; all other frames are ignored.
    """

    def __init__(self, bank: RegisterBank, unit: int = 0xFF) -> None:
        self._unit = unit
        self._decoder = FrameDecoder()
        self._functions: dict[int, Callable[[bytes], bytes]] = {
            1: lambda body: _bits(bank.read_coils(*_span(body, 2000))),
            2: lambda body: _bits(bank.read_discrete_inputs(*_span(body, 2000))),
            3: lambda body: _words(bank.read_holding_registers(*_span(body, 125))),
            4: lambda body: _words(bank.read_input_registers(*_span(body, 125))),
            5: lambda body: _write(bank.write_coils, body, *_one_coil(body)),
            6: lambda body: _write(bank.write_registers, body, *_one_register(body)),
            15: lambda body: _write(bank.write_coils, body, *_many_coils(body)),
            16: lambda body: _write(bank.write_registers, body, *_many_registers(body)),
        }

    def receive(self, data: bytes) -> bytes:
        """Take the next bytes off the line; return the answers to the requests they complete."""
        frames = self._decoder.feed(data)
        return b"".join(encode_frame(unit, self.answer(pdu)) for unit, pdu in frames if unit == self._unit)

    def answer(self, pdu: bytes) -> bytes:
        """Return the answer to one request."""
        function, body = pdu[0], pdu[1:]
        try:
            if function not in self._functions:
                raise IllegalFunction(f"function code {function} is not one of {sorted(self._functions)}")
            return bytes((function,)) + self._functions[function](body)
        except Refusal as refusal:
            return bytes((function | 0x80, refusal.code))


def _span(body: bytes, most: int) -> tuple[int, int]:
    """Return address and count of a read, or of the head of a write."""
    if len(body) != 4:
        raise IllegalValue(f"address and count take 4 bytes, here are {len(body)}")
    address, count = struct.unpack(">HH", body)
    if not 1 <= count <= most:
        raise IllegalValue(f"count {count} is not within 1 to {most}")
    if address + count > 0x10000:
        raise IllegalAddress(f"{count} from {address:#06x} on reach beyond 0xffff")
    return address, count


def _bits(values: Sequence[bool]) -> bytes:
    packed = sum(1 << place for place, value in enumerate(values) if value)
    size = (len(values) + 7) // 8
    return bytes((size,)) + packed.to_bytes(size, "little")


def _words(values: Sequence[int]) -> bytes:
    return struct.pack(f">B{len(values)}H", 2 * len(values), *values)


def _one_coil(body: bytes) -> tuple[int, list[bool]]:
    address, value = _pair(body)
    if value not in _COIL:
        raise IllegalValue(f"a coil is written 0xff00 or 0x0000, not {value:#06x}")
    return address, [_COIL[value]]


def _one_register(body: bytes) -> tuple[int, list[int]]:
    address, value = _pair(body)
    return address, [value]


def _pair(body: bytes) -> tuple[int, int]:
    if len(body) != 4:
        raise IllegalValue(f"address and value take 4 bytes, here are {len(body)}")
    address, value = struct.unpack(">HH", body)
    return address, value


def _many_coils(body: bytes) -> tuple[int, list[bool]]:
    address, count = _span(body[:4], 1968)
    packed = int.from_bytes(_payload(body, (count + 7) // 8), "little")
    return address, [bool(packed >> place & 1) for place in range(count)]


def _many_registers(body: bytes) -> tuple[int, list[int]]:
    address, count = _span(body[:4], 123)
    return address, list(struct.unpack(f">{count}H", _payload(body, 2 * count)))


def _payload(body: bytes, size: int) -> bytes:
    """Return the values of a multiple write, which must be as long as its count and its byte count say."""
    if len(body) != 5 + size or body[4] != size:
        raise IllegalValue(f"the values take {size} bytes, here are {len(body) - 5} announced as {body[4:5].hex()}")
    return body[5:]


def _write(write: Callable[[int, list[_T]], None], body: bytes, address: int, values: list[_T]) -> bytes:
    """Write, and return what a write is answered with: its own first four bytes."""
    write(address, values)
    return body[:4]
