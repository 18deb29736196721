"""The memory link keeps time exactly."""

import pytest

from transports.errors import LinkError
from transports.memory import MemoryLink

READ = b":FF0300500002AC\r\n"  # 17 bytes; its answer has 19


def test_a_request_and_its_answer_take_their_line_time_and_the_latency(clock, unit):
    link = MemoryLink(unit, clock, latency_s=0.003, baud=9600)
    start = clock.now()
    sent = link.write(READ)
    assert sent == clock.now() == pytest.approx(start + 170 / 9600, abs=1e-6)
    assert unit.requests == [(sent + 0.003, READ)]
    answer = link.read(100, 1.0)
    assert len(answer) == 19
    assert clock.now() == pytest.approx(sent + 0.006 + 190 / 9600, abs=1e-6)
    assert clock.now() - start == pytest.approx(0.0375 + 0.006, abs=1e-6)


def test_nothing_to_read_lasts_exactly_the_time_out(clock, unit):
    link = MemoryLink(unit, clock)
    start = clock.now()
    assert link.read(100, 0.25) == b""
    assert clock.now() == start + 0.25
    assert link.read(100, 0.0) == b""
    assert clock.now() == start + 0.25


def test_an_answer_later_than_the_time_out_is_there_afterwards(clock, unit):
    link = MemoryLink(unit, clock, latency_s=0.3)
    sent = link.write(READ)
    assert link.read(100, 0.5) == b""
    assert len(link.read(100, 0.5)) == 19
    assert clock.now() == pytest.approx(sent + 0.6, abs=1e-6)


def test_reads_no_more_than_asked_and_loses_nothing(clock, unit):
    link = MemoryLink(unit, clock)
    link.write(READ)
    pieces = [link.read(7, 1.0), link.read(7, 1.0), link.read(7, 1.0), link.read(7, 0.0)]
    assert [len(piece) for piece in pieces] == [7, 7, 5, 0]
    assert b"".join(pieces).startswith(b":FF03")


def test_closed_is_closed(clock, unit):
    link = MemoryLink(unit, clock, name="sim:tc410")
    link.close()
    link.close()
    for use in (lambda: link.write(READ), lambda: link.read(1, 0.0)):
        with pytest.raises(LinkError, match=r"sim:tc410.*open it again"):
            use()


def test_a_device_may_drop_the_connection(clock):
    class Dropping:
        def receive(self, _data, _t):
            raise LinkError("dropped")

    link = MemoryLink(Dropping(), clock)
    with pytest.raises(LinkError, match="dropped"):
        link.write(READ)
    with pytest.raises(LinkError, match="closed"):
        link.read(1, 0.0)
