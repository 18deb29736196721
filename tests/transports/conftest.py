"""Clocks and units for the tests of the wire."""

import time

import pytest

from transports.modbus_slave import ModbusSlave

START = 1_800_000_000.0


class HandClock:
    """Stands still until somebody sleeps."""

    def __init__(self, start=START):
        self.time = start

    def now(self):
        return self.time

    def sleep(self, seconds):
        assert seconds >= 0.0
        self.time += seconds


class CountingBank:
    """Every read is answered with other values, so that an answer given to the wrong request shows.

    A register holds the number of reads so far in its high bits, its address in the low eight.
    """

    def __init__(self):
        self.reads = 0
        self.written = {}

    def read_holding_registers(self, address, count):
        self.reads += 1
        return [(self.reads << 8 | address + place) & 0xFFFF for place in range(count)]

    read_input_registers = read_holding_registers

    def read_coils(self, address, count):
        self.reads += 1
        return [bool((self.reads * 0x9E3779B1 >> place) & 1) for place in range(address, address + count)]

    read_discrete_inputs = read_coils

    def write_coils(self, address, values):
        self.written |= {("coil", address + place): value for place, value in enumerate(values)}

    def write_registers(self, address, values):
        self.written |= {("register", address + place): value for place, value in enumerate(values)}


class Unit:
    """A slave as a device."""

    def __init__(self, bank):
        self.bank = bank
        self.requests = []
        self._slave = ModbusSlave(bank)

    def receive(self, data, t):
        self.requests.append((t, data))
        return self._slave.receive(data)


@pytest.fixture
def clock():
    return HandClock()


@pytest.fixture
def unit():
    return Unit(CountingBank())


class RealClock:
    """The computer's."""

    def now(self):
        return time.time()

    def sleep(self, seconds):
        time.sleep(seconds)


@pytest.fixture
def real_clock():
    return RealClock()
