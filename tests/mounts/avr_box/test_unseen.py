"""An encoder whose cable came off, or a motor that stands: told before the telescope is led anywhere by it."""

import pytest
from avr_bench import COUNT, SIDEREAL, STEPS_PER_TURN, Bench, Line, like

from mounts.drive import AxisSlew
from mounts.errors import Unsynchronised

FAST = 20.0 / 1_296_000.0 * STEPS_PER_TURN[1]  # microsteps a second: 20″/s, by short moves


def opened(*targets, **settings):
    bench = Bench(unit=like(**settings))
    bench.connect()
    if targets:
        bench.slew(*targets)
    bench.read()
    return bench


def unplug(bench, axis):
    """From here on an encoder says what it said last."""
    seen = bench.box.encoders
    last = seen()[axis - 1]
    bench.box.encoders = lambda: (last, seen()[1]) if axis == 1 else (seen()[0], last)


def stall(bench, axis):
    """From here on a motor stands, whatever its box counts."""
    stands, there = bench.box._stands, bench.box._stands(axis)
    bench.box._stands = lambda which: there if which == axis else stands(which)


def told(bench, axis, began):
    """How far an axis went, degrees, once it is told that its encoder stands; every reading before is right."""
    reading = bench.read()
    if not reading.unsynchronised:
        for i, each in enumerate(reading.axes):
            bench.box.advance(reading.time)
            assert abs(each.counts - bench.box.true_position(i + 1)) <= each.uncertainty_counts
        return None
    assert f"the encoder of axis {axis} stands still" in reading.unsynchronised
    assert reading.alarms == (f"the encoder of axis {axis} stands still",)
    with pytest.raises(Unsynchronised, match="mend encoder or motor"):
        bench.slew(0.0, 0.0)
    for _ in range(40):  # what it had begun is ended
        assert bench.read().alarms == reading.alarms
        bench.clock.sleep(0.25)
    assert bench.box.moving == (False, False)
    assert bool(bench.drive.hold_unplaced(bench.clock.now())) is (axis == 2)  # by what encoder 1 sees
    return abs(bench.true()[axis - 1] - began) / STEPS_PER_TURN[axis - 1] * 360.0


def followed(bench, axis, path, seconds):
    """Follow a path as the session does until it is told; how far the axis went, degrees, and in how many seconds."""
    since, began = bench.clock.now(), bench.true()[axis - 1]
    while bench.clock.now() < since + seconds:
        if (far := told(bench, axis, began)) is not None:
            return far, bench.clock.now() - since - 10.0
        bench.clock.sleep(min(0.5, bench.drive.follow(path, bench.clock.now())))
    raise AssertionError("it was not told")


@pytest.mark.parametrize(("rate", "broken"), [(0.0, unplug), (SIDEREAL, unplug), (SIDEREAL, stall)])
def test_an_encoder_1_that_stands_is_told_within_a_minute_of_tracking(rate, broken):
    bench = opened(60_000.0, 50_000.0)
    place = bench.read().axes[0].counts
    broken(bench, 1)
    far, seconds = followed(bench, 1, Line((place, 50_000.0), (rate, 0.0), bench.clock.now()), 60.0)
    print(f"\n{rate:.0f} microsteps a second, {broken.__name__}: told after {seconds:.0f} s, {far:.3f}° away")
    assert far < 0.25


@pytest.mark.parametrize(("rate", "broken"), [(-FAST, unplug), (12.0, stall)])
def test_an_encoder_2_that_stands_is_told_within_ten_counts_of_way(rate, broken):
    bench = opened(60_000.0, 50_000.0)
    place = bench.read().axes[0].counts
    broken(bench, 2)
    path = Line((place, 50_000.0), (SIDEREAL, rate), bench.clock.now())
    far, seconds = followed(bench, 2, path, 12.0 * COUNT[1] / abs(rate) + 30.0)
    print(f"\n{rate:.0f} microsteps a second, {broken.__name__}: told after {seconds:.0f} s, {far:.3f}° away")
    assert far < 0.25


@pytest.mark.parametrize(("axis", "broken"), [(1, unplug), (2, unplug), (2, stall)])
def test_an_encoder_that_stands_is_told_in_the_second_piece_of_a_slew_and_no_other_is_made(axis, broken):
    bench = opened(60_000.0, 50_000.0)
    broken(bench, axis)
    began = bench.true()[axis - 1]
    targets = [60_000.0, 50_000.0]
    targets[axis - 1] += 1_200_000.0
    bench.drive.start([AxisSlew(targets[0], SIDEREAL), AxisSlew(targets[1])], bench.clock.now())
    while (far := told(bench, axis, began)) is None:
        bench.clock.sleep(0.25)
    piece = 2 * bench.drive.axes[axis - 1].model.longest_half / STEPS_PER_TURN[axis - 1] * 360.0
    print(f"\naxis {axis}, {broken.__name__}: told {far:.2f}° away, a piece is {piece:.2f}°")
    assert far < piece + 1.0
    bench.box.__dict__.pop("encoders", None)
    bench.box.__dict__.pop("_stands", None)
    bench.drive.sync(bench.true(), bench.clock.now())
    bench.slew(0.0, 0.0)
    assert bench.read().unsynchronised == ""


@pytest.mark.parametrize("axis", [1, 2])
def test_a_goto_that_an_encoder_did_not_see_states_the_whole_way_as_uncertain(axis):
    bench = opened(60_000.0, 50_000.0)
    unplug(bench, axis)
    targets = [60_000.0, 50_000.0]
    targets[axis - 1] += 20_000.0
    bench.slew(*targets)
    reading = bench.read()
    assert reading.unsynchronised == ""
    assert reading.axes[axis - 1].uncertainty_counts > 19_000.0


@pytest.mark.parametrize("axis", [1, 2])
def test_an_encoder_that_slips_is_believed_for_ten_degrees_in_all(axis):
    bench = opened()
    seen, zeros = bench.box.encoders, bench.box.encoders()
    slips = lambda i: 0.7 if i == axis - 1 else 1.0  # noqa: E731
    bench.box.encoders = lambda: tuple(
        zero + round(slips(i) * (each - zero)) for i, (each, zero) in enumerate(zip(seen(), zeros, strict=True))
    )
    sent, why = 0.0, ""
    for way in range(20):
        target = STEPS_PER_TURN[axis - 1] / 60.0 * (1 - way % 2)  # 6° to and fro
        here = [each.counts for each in bench.read().axes]
        targets = [target if i == axis - 1 else each for i, each in enumerate(here)]
        sent += abs(targets[axis - 1] - here[axis - 1])
        try:
            bench.slew(*targets, rates=(0.0, 0.0))
        except Unsynchronised as lost:
            why = str(lost)
            break
    short = 0.3 * sent / STEPS_PER_TURN[axis - 1] * 360.0
    print(f"\naxis {axis}: told when its encoder had seen {short:.1f}° too little")
    assert f"axis {axis} has fallen 10° short" in why
    assert 8.0 < short < 14.0


def test_one_move_that_is_lost_is_no_encoder_that_stands():
    bench = opened(60_000.0, 50_000.0)
    bench.box.__dict__["_begin"] = lambda *_: None
    bench.drive.start([AxisSlew(60_000.0, SIDEREAL), AxisSlew(250_000.0)], bench.clock.now())
    del bench.box.__dict__["_begin"]
    while any(axis.slewing for axis in bench.read().axes):
        bench.clock.sleep(0.25)
    for _ in range(2):
        bench.slew(60_000.0, 150_000.0)
        bench.slew(60_000.0, 50_000.0)
    reading = bench.read()
    assert (reading.unsynchronised, reading.alarms) == ("", ())
    assert max(axis.uncertainty_counts / count for axis, count in zip(reading.axes, COUNT, strict=True)) < 5.0


def test_an_encoder_that_was_still_all_night_is_told_to_the_next_program():
    bench = opened(-700_000.0, 50_000.0)
    bench.drive.close(bench.clock.now(), keep_tracking=False)
    memory = dict(bench.drive.memory)
    unplug(bench, 1)
    bench.clock.sleep(3600.0)
    again = Bench(memory=memory, box=bench.box, clock=bench.clock)
    reading = again.connect()
    off = abs(reading.counts[0] - bench.true()[0])
    print(f"\nafter an hour {off / STEPS_PER_TURN[0] * 360.0:.2f}° off, stated "
          f"{reading.axes[0].uncertainty_counts / STEPS_PER_TURN[0] * 360.0:.2f}°")  # fmt: skip
    assert off <= reading.axes[0].uncertainty_counts
    for _ in range(60):
        if (reading := again.read()).unsynchronised:
            break
        again.clock.sleep(0.5)
    assert "the encoder of axis 1 stands still" in reading.unsynchronised
