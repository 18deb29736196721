"""The unit behind its link: one command outstanding, events in their time, a bad line."""

import pytest
from awr_bench import STILL, T0, Mutilating, Wire

from clockdrive.clock import VirtualClock
from mounts.awr import registers
from mounts.awr.errors import AwrError
from mounts.awr.factory import factory
from mounts.awr.messages import Moving, Override, Status
from mounts.awr.simulator import SimulatedAwr
from mounts.awr.simulator_settings import SimulatorSettings
from mounts.awr.unit import Unit
from mounts.errors import DriveRefused, WrongProtocol
from transports.errors import LinkError, NoAnswer
from transports.memory import MemoryLink


def test_it_reads_every_word_in_a_third_of_a_second_and_again():
    wire = Wire()
    wire.unit.identify()  # a new link is let fall silent first
    began = wire.clock.now()
    words = wire.unit.read_all()
    assert words == {**factory(), 0xFF: 0x0077}
    assert wire.clock.now() - began == pytest.approx(0.68, abs=0.05)


def test_events_have_the_time_of_what_they_tell_to_a_tenth_of_a_millisecond():
    wire = Wire(SimulatorSettings(**STILL | {"execution_s": 0.015}))
    wire.unit.identify()
    began = wire.unit.key("1")
    wire.unit.listen(wire.clock.now() + 1.0)
    (told,) = wire.unit.events()
    assert told.event == Moving((False, True))
    assert told.time == pytest.approx(began + 0.015, abs=1e-4)
    assert told.early_s == 0.0


def test_an_event_behind_an_answer_says_how_much_earlier_it_may_have_been():
    wire = Wire(SimulatorSettings(**STILL))
    wire.unit.key("1")
    wire.unit.listen(wire.clock.now() + 0.1)
    (told,) = wire.unit.events()
    assert told.early_s == pytest.approx(5 * 10 / 9600, abs=1e-6)


def test_what_comes_between_a_command_and_its_answer_is_kept():
    wire = Wire()
    wire.awr.override(stopped=True)
    assert wire.unit.read(0xFF) == 0x77
    assert [each.event for each in wire.unit.events()] == [Override(stopped=True)]
    wire.unit.identify()
    assert wire.unit.status() == Status(0, override=True)
    with pytest.raises(DriveRefused, match="override button"):
        wire.unit.key("1")


def test_a_key_is_sent_once_and_its_answer_is_waited_for_less_long_than_that_to_a_question():
    wire, heard = Wire(), []
    wire.unit.identify()
    wire.awr.receive = lambda data, _: heard.append(data) or b""
    waited = []
    for ask in (lambda: wire.unit.key("1"), lambda: wire.unit.read(0xFF)):
        began = wire.clock.now()
        with pytest.raises(NoAnswer):
            ask()
        waited.append(wire.clock.now() - began)
    assert heard == [b":1#"] + 3 * [b":FF?#"]
    assert waited[0] == pytest.approx(0.06 + 15 * 10 / 9600, abs=1e-3)
    assert waited[1] > 0.1 + 0.2 + 0.4


@pytest.mark.parametrize(("firmware", "hears"), [(0.59, None), (0.72, Status(2, override=False))])
def test_it_asks_only_for_what_the_firmware_tells(firmware, hears):
    wire = Wire(SimulatorSettings(firmware=firmware))
    assert wire.unit.identify() == ""
    wire.unit.relay(2, on=True)
    assert wire.unit.status() == hears
    assert wire.unit.damaged == 0


@pytest.mark.parametrize(
    ("firmware", "said"), [(0.53, "0.53 is older than the packets.*0.59 or later"), (99.99, None), (0.77, None)]
)
def test_unknown_firmware_is_named(firmware, said):
    wire = Wire(SimulatorSettings(firmware=firmware))
    if said is None:
        assert ("newer than 0.77" in wire.unit.identify()) is (firmware > 1.0)
        return
    with pytest.raises(WrongProtocol, match=said):
        wire.unit.identify()


@pytest.mark.parametrize("firmware", [0.54, 0.58])
def test_firmware_that_may_be_older_than_packets_is_driven_where_it_answers_in_them_and_that_is_said(firmware):
    wire = Wire(SimulatorSettings(firmware=firmware))
    assert "older than 0.59" in wire.unit.identify()
    wire.awr.receive = lambda *_: b"FF0054"
    with pytest.raises((WrongProtocol, NoAnswer)):
        wire.unit.identify()


def test_soft_writes_are_read_back_from_ram_and_wear_nothing():
    wire = Wire()
    row = registers.by_name("drive_ra_counts")
    wire.unit.soft_write(row, 17234)
    assert wire.unit.read(0x81) == 17234
    assert wire.unit.read(0x01) == 18000
    assert not wire.awr.wear
    wire.unit.discard()
    assert wire.unit.read(0x81) == 18000
    wire.unit.soft_write(row, 17000)
    wire.unit.commit()
    assert dict(wire.awr.wear) == {1: 1}
    with pytest.raises(AwrError, match="never written"):
        wire.unit.soft_write(registers.by_name("crc"), 1)


def test_a_unit_that_tells_no_ram_is_believed_nothing_of_it():
    wire = Wire(SimulatorSettings(reads_ram=False))
    assert wire.unit.read(0x81) is None


def test_nothing_at_the_far_end_is_said_with_what_to_do(monkeypatch):
    wire = Wire()
    monkeypatch.setattr(wire.awr, "receive", lambda _data, _t: b"")
    with pytest.raises(NoAnswer, match=r"cable and power.*9600 baud"):
        wire.unit.identify()


def test_a_late_answer_is_not_taken_for_that_of_the_next_command():
    wire = Wire()
    receive, late = wire.awr.receive, []

    def delaying(data, t):
        late.append(receive(data, t))
        return b"" if len(late) == 1 else late[-1]

    wire.awr.receive = delaying
    with pytest.raises(NoAnswer):
        wire.unit.key("7")
    wire.line.device = wire.awr
    wire.awr._queue.append((wire.clock.now() + 0.02, late[0]))  # the Y comes 20 ms after it was given up
    assert wire.unit.read(0xFF) == 0x77
    assert wire.unit.damaged == 0


def test_a_release_gets_through_a_line_that_loses_a_third_of_all_packets():
    worst = confirmed = 0.0
    for seed in range(60):
        wire = Wire(seed=seed)
        wire.unit.key("1")
        wire.unit.key("3")
        wire.line.garbles = False
        wire.line.rate = 0.3
        asked = wire.clock.now()
        acted, act = [], wire.awr._act

        def watched(body, awr=wire.awr, act=act, acted=acted):
            held = any(awr.keys)
            act(body)
            if held and not any(awr.keys):
                acted.append(awr._now)

        wire.awr._act = watched
        wire.unit.release()
        said = wire.clock.now()
        wire.awr.advance(said + 0.1)
        assert wire.awr.keys == [0, 0]
        worst, confirmed = max(worst, acted[0] - asked), max(confirmed, said - asked)
    print(f"\nboth keys were released within {worst * 1e3:.0f} ms, confirmed within {confirmed * 1e3:.0f} ms")
    assert worst < 0.6


class Losing:
    """Loses commands of the host."""

    def __init__(self, device, body, times):
        self.device, self.body, self.times = device, body, times

    def receive(self, data, t):
        self.device.advance(t)
        if self.body in data and self.times:
            self.times -= 1
            data = data.replace(self.body, b"")
        return self.device.receive(data, t) if data else b""

    def says(self, until):
        return self.device.says(until)


@pytest.mark.parametrize("latency_s", [0.0, 0.03, 0.05, 0.15])
@pytest.mark.parametrize("lost", [0, 1, 2])
def test_a_late_answer_to_one_release_is_not_taken_for_that_of_the_other(latency_s, lost):
    clock = VirtualClock(T0)
    awr = SimulatedAwr(SimulatorSettings(), clock.now())
    awr.press(2, 1)  # left held by a program that crashed
    line = Losing(awr, b":6#", lost)
    unit = Unit(lambda: MemoryLink(line, clock, baud=9600, latency_s=latency_s), clock, 9600)
    unit.release()
    awr.advance(clock.now() + 0.1)
    assert awr.keys == [0, 0]


def test_an_answer_left_on_a_new_link_confirms_no_release():
    wire = Wire()
    wire.awr.press(2, 1)
    wire.line.device = Losing(wire.awr, b":6#", 2)
    wire.line.device.advance = wire.awr.advance
    for at in (0.001, 0.002, 0.003):
        wire.awr._queue.append((T0 + at, b":Y\r\n#"))  # to a program that was killed
    wire.unit.release()
    wire.awr.advance(wire.clock.now() + 0.1)
    assert wire.awr.keys == [0, 0]


def test_a_late_answer_to_a_press_confirms_no_release():
    clock = VirtualClock(T0)
    awr = SimulatedAwr(SimulatorSettings(), clock.now())
    line = Losing(awr, b":6#", 1)
    link = MemoryLink(line, clock, baud=9600)
    unit = Unit(lambda: link, clock, 9600)
    unit.identify()
    link._latency = 0.04  # a serial server that is busy for a moment
    with pytest.raises(NoAnswer):
        unit.key("1")
    unit.release((1,))
    awr.advance(clock.now() + 0.1)
    assert awr.keys == [0, 0]


def test_a_bad_line_never_tells_a_word_that_is_not_there():
    for seed in range(40):
        wire = Wire(seed=seed, rate=0.1)
        try:
            words = wire.unit.read_all()
        except NoAnswer:
            continue
        wrong = {a: v for a, v in words.items() if {**factory(), 0xFF: 0x77}.get(a) != v}
        assert not wrong  # a garbled digit is a digit: only a second look tells


def test_a_link_that_is_lost_is_opened_anew_for_a_release():
    wire = Wire()
    wire.unit.key("1")
    wire.unit._kept._link.close()
    wire.unit.release()
    wire.awr.advance(wire.clock.now() + 0.1)
    assert wire.awr.keys == [0, 0]


def test_a_link_that_cannot_be_opened_is_said():
    wire = Wire()

    def no_link():
        raise LinkError("nobody there; see the cable")

    unit = Unit(no_link, wire.clock)
    with pytest.raises(LinkError, match="see the cable"):
        unit.release()


def test_debug_text_is_kept_and_disturbs_nothing():
    wire = Wire(SimulatorSettings(debug=0.5, seed=3))
    assert wire.unit.read_all()[0xFF] == 0x77
    assert any(line.startswith("dbg") for line in wire.unit.debug)
    assert wire.unit.damaged == 0


def test_bytes_lost_and_doubled_by_the_unit_itself_are_borne():
    settings = SimulatorSettings(byte_loss=0.01, byte_doubling=0.01, seed=4)
    wire = Wire(settings)
    heard = []
    for _ in range(50):
        try:
            heard.append(wire.unit.read(0x16))
        except NoAnswer:
            heard.append(None)
    assert heard.count(20000) > 40


def test_unasked_talk_and_answers_share_a_line():
    clock = VirtualClock(T0)
    awr = SimulatedAwr(SimulatorSettings(**STILL), clock.now())
    link = MemoryLink(Mutilating(awr, 1, 0.0), clock, baud=9600, latency_s=0.0)
    link.write(b":1#")
    come, times = b"", []
    while data := link.read(100, 0.5):
        come += data
        times.append(clock.now())
    assert come == b":Y\r\n#:X01\r\n#"
    assert times[-1] - times[0] == pytest.approx(11 * 10 / 9600, abs=1e-6)
