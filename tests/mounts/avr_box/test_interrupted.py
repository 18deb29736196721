"""A program that is interrupted while it sends a command: the next one is told, and completes nothing."""

from dataclasses import replace

import pytest
from avr_bench import SETTINGS, SIDEREAL, T0, Bench, Line

from mounts.avr_box.box import HALF_A_COMMAND
from mounts.avr_box.memory import at_park
from mounts.drive import AxisSlew


class Interrupted:
    """A line on which somebody ends the program after so many bytes of a move."""

    def __init__(self, device, bytes_sent, error):
        self.device, self.bytes_sent, self.error, self.armed = device, bytes_sent, error, False

    def receive(self, data, t):
        if self.armed and data[:1] == b"M":
            self.device.receive(data[: self.bytes_sent], t)
            raise self.error
        return self.device.receive(data, t)


@pytest.mark.parametrize("error", [KeyboardInterrupt, SystemExit, MemoryError])
@pytest.mark.parametrize("bytes_sent", [0, 3, 5, 6])
def test_what_is_interrupted_within_a_move_is_in_doubt_for_this_program_and_the_next(bytes_sent, error):
    lines = []
    first = Bench(line=lambda device: lines.append(Interrupted(device, bytes_sent, error)) or lines[-1])
    first.connect()
    lines[0].armed = True
    with pytest.raises(error):
        first.drive.start([AxisSlew(1_200_000.0, SIDEREAL), AxisSlew(5000.0)], first.clock.now())
    lines[0].armed = False
    assert first.kept["sending"]
    assert first.read().unsynchronised == HALF_A_COMMAND
    before, heard = first.box.motors[0].slew, []
    second = Bench(memory=dict(first.kept), box=first.box, clock=first.clock)
    receive, first.box.receive = first.box.receive, lambda data, t: heard.append(data) or receive(data, t)
    assert second.connect().unsynchronised == HALF_A_COMMAND
    second.follow(Line((0.0, 0.0), (SIDEREAL, 0.0), second.clock.now()), 5.0)
    assert heard == []
    assert first.box.motors[0].slew is before
    second.drive.sync((0.0, 0.0), second.clock.now())
    assert second.read().unsynchronised == ""


def test_what_is_interrupted_between_sending_and_reckoning_a_move_is_in_doubt(monkeypatch):
    bench = Bench()
    bench.connect()

    def interrupted(*_args, **_kwargs):
        raise KeyboardInterrupt

    monkeypatch.setattr(bench.drive.axes[0], "moved", interrupted)
    with pytest.raises(KeyboardInterrupt):
        bench.drive.start([AxisSlew(1_200_000.0, SIDEREAL), AxisSlew(5000.0)], bench.clock.now())
    assert bench.kept["sending"]
    assert bench.read().unsynchronised == HALF_A_COMMAND


@pytest.mark.parametrize("counts", [20000, 0], ids=["encoders", "blind"])
@pytest.mark.parametrize("rate", [SIDEREAL, 0.9 * SIDEREAL], ids=["guided", "beside short moves"])
@pytest.mark.parametrize("sent", [True, False])
def test_single_steps_are_known_to_the_next_program_wherever_this_one_was_killed(sent, rate, counts):
    settings = replace(SETTINGS, encoder_counts_per_turn=counts)
    first = Bench(settings, memory={**at_park((0, 0), T0, ""), "proved": True})
    first.connect()
    start = tuple(axis.counts for axis in first.read().axes)
    first.follow(Line((start[0] + 40.0, 0.0), (rate, 2.0), first.clock.now()), 6.0)
    receive, step = first.box.receive, []

    def killed(data, t):
        if data[:1] not in b"<>":
            return receive(data, t)
        step.append(data[1])
        if sent:
            receive(data, t)
        raise KeyboardInterrupt

    first.box.receive = killed
    here = tuple(axis.at(first.clock.now()).counts for axis in first.drive.axes)
    with pytest.raises(KeyboardInterrupt):
        first.follow(Line((here[0], here[1] + 57.0), (rate, 2.0), first.clock.now()), 6.0)
    first.box.receive = receive
    first.clock.sleep(8.0)
    second = Bench(settings, memory=dict(first.kept), box=first.box, clock=first.clock)
    reading = second.connect()
    off = abs(reading.axes[1].counts - second.true()[1])
    stated = reading.axes[1].uncertainty_counts
    print(f"\nkilled {'after' if sent else 'before'} {step[0]} steps: {off:.1f} microsteps off, stated {stated:.1f}")
    assert step[0] > 50
    assert off <= (0.5 if sent else stated)
    assert off <= stated + 0.5
