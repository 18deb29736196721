"""The fault machine does what its faults are called."""

from itertools import islice

import pytest
from faults import ALL_FAULTS, Fault, FaultMachine, FaultyDevice, FaultyLink, by_chance

from transports.errors import LinkError
from transports.memory import MemoryLink


class Counting:
    """Answers `<n>` with n the number of the request, padded to a length that grows."""

    def __init__(self):
        self.count = 0

    def receive(self, _data, _t):
        self.count += 1
        return b"<" + b"%d" % self.count * self.count + b">"


ON_A_DEVICE = {
    None: [b"<1>", b"<22>", b"<333>"],
    Fault.DROP: [b"<1>", b"", b"<333>"],
    Fault.DELAY: [b"<1>", b"", b"<22><333>"],
    Fault.MERGE: [b"<1>", b"", b"<22><333>"],
    Fault.DUPLICATE: [b"<1>", b"<22><22>", b"<333>"],
    Fault.ECHO: [b"<1>", b"?", b"<333>"],
    Fault.WRONG: [b"<1>", b"<1>", b"<333>"],
}


@pytest.mark.parametrize("fault", ON_A_DEVICE)
def test_a_device_answers_as_planned(fault):
    device = FaultyDevice(Counting(), [None, fault])
    assert [device.receive(b"?", 0.0) for _ in range(3)] == ON_A_DEVICE[fault]


def test_a_device_garbles_one_byte():
    garbled = FaultyDevice(Counting(), [Fault.GARBLE]).receive(b"?", 0.0)
    assert sum(a != b for a, b in zip(garbled, b"<1>", strict=True)) == 1


def test_a_device_puts_noise_before_its_answer():
    noisy = FaultyDevice(Counting(), [Fault.NOISE]).receive(b"?", 0.0)
    assert noisy.endswith(b"<1>")
    assert len(noisy) > 3


def test_a_device_loses_the_connection():
    with pytest.raises(LinkError):
        FaultyDevice(Counting(), [Fault.DISCONNECT]).receive(b"?", 0.0)


def test_a_device_that_is_silent_stays_so():
    class Silent:
        def receive(self, _data, _t):
            return b""

    device = FaultyDevice(Silent(), [Fault.ECHO])
    assert device.receive(b"?", 0.0) == b""
    assert not device.happened


ON_A_LINK = {
    None: [(0.002, b"<1>"), (1.0, b"")],
    Fault.DROP: [(1.0, b""), (2.0, b"")],
    Fault.DELAY: [(0.502, b"<1>"), (1.502, b"")],
    Fault.MERGE: [(1.0, b""), (2.0, b"")],
}


@pytest.mark.parametrize("fault", ON_A_LINK)
def test_a_link_brings_the_answer_when_planned(fault, clock):
    start = clock.now()
    link = FaultyLink(MemoryLink(Counting(), clock), clock, FaultMachine([fault], delay_s=0.5))
    link.write(b"?")
    for lasts, answer in ON_A_LINK[fault]:
        assert link.read(100, 1.0) == answer
        assert clock.now() - start == pytest.approx(lasts if answer else max(lasts, 1.0), abs=3e-3)


def test_a_link_brings_an_answer_in_two_pieces(clock):
    link = FaultyLink(MemoryLink(Counting(), clock), clock, FaultMachine([Fault.SPLIT], pause_s=0.1))
    link.write(b"?")
    first = link.read(100, 1.0)
    between = clock.now()
    second = link.read(100, 1.0)
    assert first
    assert second
    assert first + second == b"<1>"
    assert clock.now() - between == pytest.approx(0.1, abs=1e-6)


def test_a_link_brings_what_it_held_with_the_next(clock):
    link = FaultyLink(MemoryLink(Counting(), clock), clock, FaultMachine([Fault.MERGE]))
    link.write(b"?")
    assert link.read(100, 1.0) == b""
    link.write(b"?")
    assert link.read(100, 1.0) == b"<1><22>"


def test_a_link_is_closed_when_the_connection_is_lost(clock):
    link = FaultyLink(MemoryLink(Counting(), clock), clock, FaultMachine([Fault.DISCONNECT]))
    link.write(b"?")
    with pytest.raises(LinkError, match="as planned"):
        link.read(100, 1.0)
    with pytest.raises(LinkError, match="closed"):
        link.write(b"?")


def test_a_seed_gives_the_same_faults_again_and_a_rate_how_many():
    plan = list(islice(by_chance(7, 0.1), 10_000))
    assert plan == list(islice(by_chance(7, 0.1), 10_000))
    assert 900 < sum(fault is not None for fault in plan) < 1100
    assert set(plan) == {None, *ALL_FAULTS}
