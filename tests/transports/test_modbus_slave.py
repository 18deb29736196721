"""The answering side, byte for byte."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from transports.ascii_frame import encode_frame
from transports.modbus_slave import IllegalAddress, IllegalValue, ModbusSlave


class Bank:
    """Sixteen of everything; register 15 is read-only."""

    def __init__(self):
        self.coils = [False] * 16
        self.registers = [0] * 16

    def _within(self, address, count):
        if address + count > 16:
            raise IllegalAddress("sixteen of everything")

    def read_coils(self, address, count):
        self._within(address, count)
        return self.coils[address : address + count]

    def read_discrete_inputs(self, address, count):
        return [not coil for coil in self.read_coils(address, count)]

    def read_holding_registers(self, address, count):
        self._within(address, count)
        return self.registers[address : address + count]

    def read_input_registers(self, address, count):
        return [0xFFFF - word for word in self.read_holding_registers(address, count)]

    def write_coils(self, address, values):
        self._within(address, len(values))
        self.coils[address : address + len(values)] = values

    def write_registers(self, address, values):
        self._within(address, len(values))
        if address + len(values) == 16:
            raise IllegalValue("register 15 is read-only")
        self.registers[address : address + len(values)] = values


class Wide(Bank):
    """Answers at any address, like the drive of the printed frames."""

    def read_holding_registers(self, address, count):  # noqa: ARG002 - the same everywhere
        return [0x0080, 0x0000][:count]

    def write_registers(self, address, values):
        self.written = address, values


@pytest.mark.parametrize(
    ("request_frame", "answer"),
    [
        (b":FF100050000204008000001B\r\n", b":FF10005000029F\r\n"),
        (b":FF0300500002AC\r\n", b":FF0304008000007A\r\n"),
        (b":FF050000FF00FD\r\n", b":FF050000FF00FD\r\n"),
    ],
)
def test_answers_the_frames_of_two_independent_stacks(request_frame, answer):
    assert ModbusSlave(Wide()).receive(request_frame) == answer


def test_answers_when_the_request_comes_byte_by_byte():
    slave = ModbusSlave(Wide())
    answers = [slave.receive(bytes((byte,))) for byte in b":FF0300500002AC\r\n"]
    assert b"".join(answers) == b":FF0304008000007A\r\n"


@pytest.mark.parametrize(
    ("request_pdu", "answer"),
    [
        ("0f 0001 000a 02 ff02", "0f 0001 000a"),
        ("01 0000 0010", "01 02 fe 05"),
        ("02 0000 0010", "02 02 01 fa"),
        ("05 0001 0000", "05 0001 0000"),
        ("01 0000 0002", "01 01 00"),
        ("06 0003 beef", "06 0003 beef"),
        ("10 0004 0002 04 12345678", "10 0004 0002"),
        ("03 0003 0003", "03 06 beef 1234 5678"),
        ("04 0003 0001", "04 02 4110"),
    ],
)
def test_reads_back_what_was_written(request_pdu, answer, session_slave):
    assert session_slave.answer(bytes.fromhex(request_pdu)) == bytes.fromhex(answer)


@pytest.fixture(scope="module")
def session_slave():
    return ModbusSlave(Bank())


@pytest.mark.parametrize(
    ("request_pdu", "code"),
    [
        ("07", 1),
        ("17 0000 0001 0000 0001 02 0000", 1),
        ("03 0010 0001", 2),
        ("03 000f 0002", 2),
        ("01 ffff 0002", 2),
        ("03 0000 0000", 3),
        ("03 0000 007e", 3),
        ("01 0000 07d1", 3),
        ("03 0000", 3),
        ("03", 3),
        ("05 0000 0001", 3),
        ("06 000f 0001", 3),
        ("06 0000", 3),
        ("10 0000 0002 04 1234", 3),
        ("10 0000 0002 02 12345678", 3),
        ("10 0000", 3),
        ("0f 0000 0009 01 ff", 3),
    ],
)
def test_refuses_with_the_exception_code(request_pdu, code):
    pdu = bytes.fromhex(request_pdu)
    assert ModbusSlave(Bank()).answer(pdu) == bytes((pdu[0] | 0x80, code))


@pytest.mark.parametrize("frame", [encode_frame(1, b"\x03\0\0\0\1"), b":FF0300500002AD\r\n", b":FF\r\n", b"\r\n"])
def test_is_silent_to_other_units_and_bad_frames(frame):
    assert ModbusSlave(Wide()).receive(frame) == b""


@given(st.integers(0, 127), st.binary(max_size=252))
def test_answers_every_request_there_is(function, body):
    answer = ModbusSlave(Bank()).answer(bytes((function,)) + body)
    assert answer[0] in (function, function | 0x80)


@given(st.binary(max_size=300))
def test_takes_any_bytes(data):
    slave = ModbusSlave(Wide())
    slave.receive(data)
    assert slave.receive(b":FF0300500002AC\r\n") == b":FF0304008000007A\r\n"
