"""A device that says things unasked, in memory and served: nothing is lost, each thing has its time."""

import threading

import pytest

from clockdrive.clock import SystemClock, VirtualClock
from transports.memory import MemoryLink
from transports.open_link import open_link
from transports.serve import serve

T0 = 1_800_000_000.0


class Ticking:
    """Answers with an echo, and says its number at each multiple of a period."""

    def __init__(self, start, period):
        self.next, self.period, self.number = start + period, period, 0
        self.lock = threading.Lock()

    def receive(self, data, _t):
        return data

    def says(self, until):
        with self.lock:
            if self.next > until:
                return None
            said = self.next, f"<{self.number}>".encode()
            self.next, self.number = self.next + self.period, self.number + 1
            return said


def heard(link, clock, seconds):
    end, come = clock.now() + seconds, []
    while (left := end - clock.now()) > 0.0:
        data = link.read(100, left)
        if data:
            come.append((clock.now(), data))
    return come


def test_what_is_said_unasked_comes_at_its_time_and_latency():
    clock = VirtualClock(T0)
    come = heard(MemoryLink(Ticking(T0, 0.5), clock, latency_s=0.01), clock, 1.6)
    assert [data for _, data in come] == [b"<0>", b"<1>", b"<2>"]
    assert [time - T0 for time, _ in come] == pytest.approx([0.51, 1.01, 1.51], abs=1e-6)


def test_what_a_bad_line_swallows_whole_holds_up_nothing_behind_it():
    class Swallowed(Ticking):
        def says(self, until):
            said = super().says(until)
            return said and (said[0], b"" if said[1] == b"<0>" else said[1])

    clock = VirtualClock(T0)
    link = MemoryLink(Swallowed(T0, 0.01), clock, latency_s=0.0, baud=9600)
    assert heard(link, clock, 0.05)[0] == (pytest.approx(T0 + 0.02 + 1 / 960, abs=1e-5), b"<")


def test_on_a_slow_line_answers_and_what_is_said_take_turns_byte_by_byte():
    clock = VirtualClock(T0)
    link = MemoryLink(Ticking(T0, 0.1), clock, latency_s=0.0, baud=960)
    clock.sleep(0.05)
    link.write(b"abcd")  # there at 0.0917, its answer until 0.1333, and the tick behind it
    come = heard(link, clock, 0.2)
    assert b"".join(data for _, data in come)[:7] == b"abcd<0>"
    assert come[4][0] - T0 == pytest.approx(0.05 + 9 * 10 / 960, abs=1e-4)


@pytest.mark.parametrize("listen", ["tcp://127.0.0.1:0", "pty:"])
def test_what_is_said_unasked_reaches_a_client_that_only_listens(listen):
    clock = SystemClock()
    with serve(Ticking(clock.now() + 0.2, 0.05), clock, listen) as server:
        link = open_link(server.address, clock)
        come = b""
        while b"<4>" not in come:
            data = link.read(100, 5.0)
            assert data
            come += data
        link.write(b"hello")
        while b"hello" not in come:
            come += link.read(100, 5.0)
        link.close()
    assert come.startswith(b"<0><1><2><3><4>")
