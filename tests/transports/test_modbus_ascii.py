"""The asking side against a unit in memory under a virtual clock, faultless and with every fault there is."""

import os
from collections import Counter

import pytest
from faults import ALL_FAULTS, Fault, FaultMachine, FaultyDevice, FaultyLink, by_chance

from transports.ascii_frame import encode_frame
from transports.errors import ExceptionReply, LinkError, NoAnswer, TransportError, WrongAnswer
from transports.memory import MemoryLink
from transports.modbus_ascii import ModbusAscii

CALLS = 40_000 if os.environ.get("CLOCKDRIVE_CAMPAIGN") == "full" else 3_000


def master(device, clock, **options):
    link_options = {key: options.pop(key) for key in ("latency_s", "baud") if key in options}
    return ModbusAscii(lambda: MemoryLink(device, clock, **link_options), clock, **options)


class Saying:
    """Answers the requests in turn with the frames given; then not at all."""

    def __init__(self, *answers):
        self.answers = list(answers)
        self.requests = []

    def receive(self, data, t):
        self.requests.append((t, data))
        return self.answers.pop(0) if self.answers else b""


def test_sends_the_frames_of_two_independent_stacks(clock):
    unit = Saying(b":FF10005000029F\r\n", b":FF0304008000007A\r\n", b":FF050000FF00FD\r\n")
    modbus = master(unit, clock)
    assert modbus.write_registers(0x50, [0x80, 0]).values == (0x80, 0)
    assert modbus.read_holding_registers(0x50, 2).values == (0x80, 0)
    assert modbus.write_coil(0, value=True).values == (1,)
    assert [data for _, data in unit.requests] == [
        b":FF100050000204008000001B\r\n",
        b":FF0300500002AC\r\n",
        b":FF050000FF00FD\r\n",
    ]


def test_reads_and_writes_everything(clock, unit):
    modbus = master(unit, clock)
    assert modbus.read_holding_registers(0x12, 3).values == (0x112, 0x113, 0x114)
    assert modbus.read_input_registers(3, 1).values == (0x203,)
    coils = modbus.read_coils(1, 13).values
    assert coils == tuple(0x9E3779B1 * 3 >> place & 1 for place in range(1, 14))
    assert len(modbus.read_discrete_inputs(0, 8).values) == 8
    modbus.write_register(0x10, 0xBEEF)
    modbus.write_registers(0x52, [1, 2])
    modbus.write_coil(2, value=False)
    assert unit.bank.written == {
        ("register", 0x10): 0xBEEF,
        ("register", 0x52): 1,
        ("register", 0x53): 2,
        ("coil", 2): False,
    }


def test_says_when_the_request_left_and_when_the_answer_was_here(clock, unit):
    modbus = master(unit, clock, baud=9600)
    modbus.read_coils(0, 1)
    clock.sleep(1.0)
    start = clock.now()
    answer = modbus.read_holding_registers(0x50, 2)
    assert answer.sent == pytest.approx(start + 170 / 9600, abs=1e-6)
    assert answer.received == pytest.approx(start + 0.0375 + 0.002, abs=1e-6)
    print(f"two registers at 9600 baud: {1e3 * (answer.received - start):.1f} ms")


@pytest.mark.parametrize(
    ("code", "meaning"), [(1, "illegal function"), (2, "illegal address"), (3, "illegal value"), (77, "unknown")]
)
def test_a_refusal_is_told_with_its_meaning_and_not_repeated(clock, code, meaning):
    unit = Saying(encode_frame(0xFF, bytes((0x83, code))))
    with pytest.raises(
        ExceptionReply, match=f"read 1 holding registers at 0x0021: exception {code}, {meaning}"
    ) as it:
        master(unit, clock).read_holding_registers(0x21, 1)
    assert it.value.code == code
    assert len(unit.requests) == 1


@pytest.mark.parametrize(
    "call",
    [
        lambda modbus: modbus.read_coils(0, 0),
        lambda modbus: modbus.read_coils(0, 2001),
        lambda modbus: modbus.read_holding_registers(0, 126),
        lambda modbus: modbus.read_holding_registers(-1, 1),
        lambda modbus: modbus.read_holding_registers(0xFFFF, 2),
        lambda modbus: modbus.write_register(0, 0x10000),
        lambda modbus: modbus.write_register(0, -1),
        lambda modbus: modbus.write_registers(0, []),
        lambda modbus: modbus.write_registers(0, [0] * 124),
    ],
)
def test_what_cannot_be_asked_is_refused_with_its_bounds_before_anything_is_sent(clock, unit, call):
    with pytest.raises(TransportError, match="is not within"):
        call(master(unit, clock))
    assert unit.requests == []


def test_silence_is_told_within_the_deadline(clock):
    unit = Saying()
    start = clock.now()
    with pytest.raises(
        NoAnswer, match=r"sim:: unit 255 did not answer within 0.5 s to: read . holding registers at 0x0050"
    ):
        master(unit, clock).read_holding_registers(0x50, 2)
    assert len(unit.requests) == 2
    assert clock.now() - start <= 2.0


def test_a_clock_set_back_makes_no_call_longer(clock):
    waited = []

    class SetBack:
        def receive(self, _data, _t):
            clock.time -= 3600.0
            return b""

    def sleep(seconds):
        waited.append(seconds)
        clock.time += seconds

    clock.sleep = sleep
    with pytest.raises(NoAnswer):
        master(SetBack(), clock).read_holding_registers(0x50, 2)
    assert sum(waited) <= 2.0


def test_a_write_is_sent_once(clock):
    unit = Saying()
    with pytest.raises(NoAnswer, match="write register at 0x0070: 0x1"):
        master(unit, clock).write_register(0x70, 1)
    assert len(unit.requests) == 1


def test_after_a_doubt_a_marker_of_another_shape_is_read_before_anything_else(clock, unit):
    faulty = FaultyDevice(unit, [None, None, Fault.DROP])
    modbus = master(faulty, clock)
    modbus.read_coils(0, 1)
    modbus.read_holding_registers(0x50, 2)
    modbus.read_holding_registers(0x60, 2)
    functions = [data[3:5] for _, data in unit.requests]
    assert functions == [b"01", b"03", b"03", b"01", b"03"]


@pytest.mark.parametrize("late", [Fault.DELAY, Fault.MERGE])
def test_an_answer_later_than_the_time_out_is_never_taken_for_the_next(clock, unit, late):
    """One link that outlives its being closed, as a serial line does."""
    line = FaultyLink(MemoryLink(unit, clock), clock, FaultMachine([None, None, late], delay_s=0.65))
    line.close = lambda: None
    modbus = ModbusAscii(lambda: line, clock)
    modbus.read_coils(0, 1)
    modbus.read_holding_registers(0x50, 2)
    for axis in (0x50, 0x60, 0x50, 0x60):
        values = modbus.read_holding_registers(axis, 2).values
        assert values == (unit.bank.reads << 8 | axis, unit.bank.reads << 8 | axis + 1)


def test_without_a_marker_an_answer_is_believed_only_when_no_other_follows(clock, unit):
    """The very first request, of a single register, is answered late, just before the second."""
    line = FaultyLink(MemoryLink(unit, clock), clock, FaultMachine([Fault.DELAY, Fault.SPLIT], 3, delay_s=1.003))
    line.close = lambda: None
    modbus = ModbusAscii(lambda: line, clock)
    with pytest.raises(WrongAnswer, match="answered 2 times"):
        modbus.read_holding_registers(0x50, 1)
    assert modbus.read_holding_registers(0x50, 1).values == (unit.bank.reads << 8 | 0x50,)


@pytest.mark.parametrize("baud", [None, 9600])
@pytest.mark.parametrize("outlives", [False, True], ids=["new link", "same line"])
@pytest.mark.parametrize("fault", ALL_FAULTS)
def test_no_fault_makes_a_wrong_value(clock, unit, fault, outlives, baud):
    """Half of the answers go wrong; every value that comes is that of the last request the unit saw."""
    machine = FaultMachine(by_chance(1, 0.5, (fault,)), 2, delay_s=0.65)
    line = FaultyLink(MemoryLink(unit, clock, baud=baud), clock, machine)
    line.close = lambda: None

    def open_link():
        return line if outlives else FaultyLink(MemoryLink(unit, clock, baud=baud), clock, machine)

    counts = converse(ModbusAscii(open_link, clock), unit, 300)
    print(f"{fault}: {dict(counts)}")
    assert machine.happened[fault] > 50
    assert counts["answered"] > 50


@pytest.mark.campaign
@pytest.mark.parametrize("outlives", [False, True], ids=["new link", "same line"])
@pytest.mark.parametrize("rate", [0.02, 0.2])
def test_no_mixture_of_faults_makes_a_wrong_value(clock, unit, rate, outlives):
    machine = FaultMachine(by_chance(3, rate), 4, delay_s=0.65)
    line = FaultyLink(MemoryLink(unit, clock, baud=9600), clock, machine)
    line.close = lambda: None

    def open_link():
        return line if outlives else FaultyLink(MemoryLink(unit, clock, baud=9600), clock, machine)

    counts = converse(ModbusAscii(open_link, clock), unit, CALLS)
    print(f"{CALLS} calls, {sum(machine.happened.values())} faults: {dict(counts)}")
    assert counts["answered"] > CALLS * (1.0 - 2.0 * rate)


def converse(modbus, unit, calls):
    """Read one thing after the other without a pause, and check each value; return how the calls ended."""
    ends = Counter()
    for call in range(calls):
        address = (0x50, 0x60, 0x12)[call % 3]
        try:
            if call % 5 == 4:
                values = modbus.read_input_registers(address, 4).values
            elif call % 7 == 6:
                modbus.write_registers(0x52, [call & 0xFF, 1])
                assert unit.bank.written["register", 0x52] == call & 0xFF
                ends["answered"] += 1
                continue
            else:
                values = modbus.read_holding_registers(address, 2).values
        except (NoAnswer, WrongAnswer, LinkError) as error:
            ends[type(error).__name__] += 1
            continue
        expected = tuple(unit.bank.reads << 8 & 0xFFFF | address + place for place in range(len(values)))
        assert values == expected, f"call {call}: {[f'{value:04x}' for value in values]}"
        ends["answered"] += 1
    return ends
