"""Modbus requests as values, each with the shape its answer must have.

PDUs are pymodbus's; bounds are checked here, and an answer is recognised by function, byte count and length, for a
write by the echo. (Modbus Application Protocol V1.1b3, section 6.)
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import cast

from pymodbus.pdu import DecodePDU, ModbusPDU
from pymodbus.pdu.bit_message import ReadCoilsRequest, ReadDiscreteInputsRequest, WriteSingleCoilRequest
from pymodbus.pdu.register_message import (
    ReadHoldingRegistersRequest,
    ReadInputRegistersRequest,
    WriteMultipleRegistersRequest,
    WriteSingleRegisterRequest,
)

from transports.errors import TransportError

_ANSWERS = DecodePDU(is_server=False)

# What can be read: the request, the most of them in one request, and the bits of one.
_READS: dict[str, tuple[type[ModbusPDU], int, int]] = {
    "coils": (ReadCoilsRequest, 2000, 1),
    "discrete inputs": (ReadDiscreteInputsRequest, 2000, 1),
    "holding registers": (ReadHoldingRegistersRequest, 125, 16),
    "input registers": (ReadInputRegistersRequest, 125, 16),
}
_MOST_WRITTEN = 123


@dataclass(frozen=True)
class Request:
    """What is asked of a unit."""

    text: str
    pdu: bytes
    head: bytes  # what the PDU of the answer begins with
    size: int  # how long that PDU is
    count: int
    narrowed: "Request | None" = None  # a read of less at the same place, whose answer has another shape

    def is_answered_by(self, pdu: bytes) -> bool:
        """Whether `pdu` has the shape of the answer."""
        return len(pdu) == self.size and pdu.startswith(self.head)

    def is_refused_by(self, pdu: bytes) -> bool:
        """Whether `pdu` is an exception reply to this function."""
        return len(pdu) == 2 and pdu[0] == self.pdu[0] | 0x80

    def values(self, pdu: bytes) -> tuple[int, ...]:
        """Return what the answer `pdu` of a read holds: register values, or bits as 0 and 1."""
        answer = cast("ModbusPDU", _ANSWERS.decode(pdu))
        return tuple(map(int, answer.registers or answer.bits))[: self.count]


def head_of(pdu: bytes) -> bytes:
    """Return that part of an answer by which requests tell it from others."""
    return pdu[:2] if pdu[0] <= 4 else pdu[:5]


@lru_cache(maxsize=256)  # a poll asks for the same again and again
def read_request(noun: str, address: int, count: int) -> Request:
    """Return the request for `count` coils, discrete inputs, holding registers or input registers."""
    kind, most, bits = _READS[noun]
    _require_within(f"count of {noun}", count, 1, most)
    _require_within("address", address, 0, 0x10000 - count)
    size = (count * bits + 7) // 8
    function = bytes((kind.function_code,))
    return Request(
        f"read {count} {noun} at {address:#06x}",
        function + kind(address=address, count=count).encode(),
        function + bytes((size,)),
        2 + size,
        count,
        read_request(noun, address, 1) if size > (bits + 7) // 8 else None,
    )


def write_coil_request(address: int, value: bool) -> Request:
    """Return the request that writes one coil."""
    return _write_request("coil", WriteSingleCoilRequest(address=address, bits=[value]), [int(value)])


def write_register_request(address: int, value: int) -> Request:
    """Return the request that writes one holding register."""
    return _write_request("register", WriteSingleRegisterRequest(address=address, registers=[value]), [value])


def write_registers_request(address: int, values: Sequence[int]) -> Request:
    """Return the request that writes several holding registers."""
    pdu = WriteMultipleRegistersRequest(address=address, registers=list(values))
    return _write_request("registers", pdu, values)


def _write_request(noun: str, pdu: ModbusPDU, values: Sequence[int]) -> Request:
    _require_within(f"number of {noun}", len(values), 1, _MOST_WRITTEN)
    _require_within("address", pdu.address, 0, 0x10000 - len(values))
    for value in values:
        _require_within(f"value for {noun} at {pdu.address:#06x}", value, 0, 0xFFFF)
    raw = bytes((pdu.function_code,)) + pdu.encode()
    text = f"write {noun} at {pdu.address:#06x}: {', '.join(f'{value:#x}' for value in values)}"
    return Request(text, raw, raw[:5], 5, len(values))


def _require_within(what: str, value: int, least: int, most: int) -> None:
    if not least <= value <= most:
        raise TransportError(f"{what} {value} is not within {least} to {most}")
