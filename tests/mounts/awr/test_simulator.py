"""The simulated AWR Microstep against sums by hand, a motor stepped millisecond by millisecond, and the manual."""

import math
import random
import statistics

import pytest

from mounts.awr.factory import factory
from mounts.awr.messages import (
    Backlash,
    Done,
    Error,
    IndexPulse,
    Lines,
    Moving,
    Override,
    Status,
    Word,
    Written,
    decoded,
)
from mounts.awr.packets import Packets
from mounts.awr.simulator import SimulatedAwr
from mounts.awr.simulator_settings import SimulatorSettings

T0 = 1_800_000_000.0
STILL = {"execution_s": 0.0, "execution_jitter_s": 0.0, "stamp_jitter_s": 0.0}


def unit(**ways):
    return SimulatedAwr(SimulatorSettings(**STILL | ways), T0)


def ask(awr, body, t):
    return [decoded(packet.text) for packet in Packets().feed(awr.receive(f":{body}#".encode(), t), t)]


def events(awr, until):
    heard = []
    while (said := awr.says(until)) is not None:
        heard += [(said[0] - T0, decoded(p.text)) for p in Packets().feed(said[1], 0.0)]
    return heard


def test_it_tracks_by_its_drive_register():
    awr = unit()
    awr.advance(T0 + 3600.0)
    assert awr.true_position(1) == pytest.approx(50.0 * 3600.0, rel=1e-12)
    assert awr.true_position(2) == 0.0


def test_a_press_is_the_trapezium_of_its_ramps():
    awr = unit()
    assert ask(awr, "9", T0) == [Done(ok=True)]
    assert ask(awr, "3", T0 + 1.0) == [Done(ok=True)]
    ask(awr, "5", T0 + 4.0)
    awr.advance(T0 + 10.0)
    climb = (24000.0 - 50.0) / 20000.0
    by_hand = 50.0 * 10.0 + (24000.0 - 50.0) * 3.0  # over the drive: speed times hold
    assert awr.true_position(1) == pytest.approx(by_hand, abs=0.01)
    assert events(awr, T0 + 10.0) == [
        (pytest.approx(1.0, abs=1e-6), Moving((True, False))),
        (pytest.approx(4.0 + climb, abs=1e-6), Moving((False, False))),
    ]


def test_it_goes_as_a_motor_that_is_stepped_millisecond_by_millisecond():
    rng = random.Random(5)  # noqa: S311
    for _ in range(20):
        awr, dt = unit(), 1e-3
        speeds = {"7": (15.0, -15.0), "8": (100.0, -100.0), "A": (1600.0, -1600.0), "9": (24000.0, -24000.0)}
        place, velocity, wanted, speed, t = 0.0, 0.0, 0.0, "7", 0.0
        script = sorted((rng.randrange(1, 8000), rng.choice("12667789A")) for _ in range(8))
        for ms in range(9000):
            for _, body in [each for each in script if each[0] == ms]:
                ask(awr, body, T0 + ms * dt)
                speed = body if body in speeds else speed
                key = {"1": 0, "2": 1}.get(body)
                held = key if body in "12" else None if body == "6" else held_now(wanted)
                wanted = 0.0 if held is None else speeds[speed][held]
            step = max(-20000.0 * dt, min(20000.0 * dt, wanted - velocity))
            place += (velocity + step / 2.0) * dt
            velocity += step
            t += dt
        awr.advance(T0 + t)
        assert awr.true_position(2) == pytest.approx(place, abs=1.0)


def held_now(wanted):
    return None if wanted == 0.0 else int(wanted < 0.0)


@pytest.mark.parametrize(
    ("speed", "key", "rate"),
    [
        ("7", "3", 65.0), ("7", "4", 35.0), ("8", "3", 150.0), ("8", "4", -50.0), ("A", "3", 1650.0),
        ("A", "4", -1550.0), ("9", "3", 24000.0), ("9", "4", -24000.0),
        ("7", "1", 15.0), ("7", "2", -15.0), ("8", "1", 100.0), ("A", "2", -1600.0), ("9", "1", 24000.0),
    ],
)  # fmt: skip
def test_keys_move_at_the_rates_of_their_registers(speed, key, rate):
    awr = unit()
    ask(awr, speed, T0)
    ask(awr, key, T0)
    axis = 1 if key in "34" else 2
    awr.advance(T0 + 10.0)
    before = awr.true_position(axis)
    awr.advance(T0 + 11.0)
    assert awr.true_position(axis) - before == pytest.approx(rate, rel=1e-4)


def test_words_are_read_written_and_kept_as_the_manual_says():
    awr = unit()
    assert ask(awr, "FF?", T0) == [Word(0xFF, 0x0077)]
    assert ask(awr, "0AX?", T0) == []
    assert events(awr, T0) == [(0.0, Error("C"))]
    assert ask(awr, "1a?", T0) == []  # lower case
    assert ask(awr, "FF0000", T0) == [Written(0xFF, ok=False)]
    assert ask(awr, "2C?", T0) == [Done(ok=False)]
    assert len(ask(awr, "??", T0)) == 29
    assert ask(awr, "814650", T0) == [Written(0x81, ok=True)]
    assert awr.ram[1] == 0x4650
    assert not awr.wear
    ask(awr, "812328", T0)  # 9000: twice the rate
    awr.advance(T0 + 100.0)
    assert awr.true_position(1) == pytest.approx(10000.0, rel=1e-3)
    ask(awr, "E", T0 + 100.0)
    assert (awr.lasting[1], dict(awr.wear)) == (0x2328, {1: 1})
    ask(awr, "811000", T0 + 100.0)
    ask(awr, "D", T0 + 100.0)
    assert awr.ram[1] == 0x2328


def test_a_rate_that_cannot_be_divided_by_is_told_and_stands():
    awr = unit()
    ask(awr, "810000", T0)
    ask(awr, "830001", T0)
    assert [event for _, event in events(awr, T0)] == [Error("8"), Error("9")]


def test_override_reset_index_lines_and_relays_are_told():
    awr = unit(worm_steps=500.0)
    assert ask(awr, "F21", T0) == [Done(ok=True)]
    assert ask(awr, "R?", T0) == [Status(2, override=False)]
    assert [each for each, event in events(awr, T0 + 25.0) if event == IndexPulse()] == pytest.approx([10.0, 20.0])
    ask(awr, "3", T0 + 25.0)
    awr.override(stopped=True)
    here = awr.true_position(1)
    assert ask(awr, "3", T0 + 30.0) == [Done(ok=False)]
    assert awr.true_position(1) == here
    awr.override(stopped=False)
    awr.levels("ACDE")
    ask(awr, "812328", T0 + 30.0)
    awr.reset("brownout")
    said = [event for _, event in events(awr, T0 + 31.0)]
    assert [each for each in said if not isinstance(each, Moving)] == [
        Override(stopped=True),
        Override(stopped=False),
        Lines((True, False, True, True, True, False)),
        Error("7"),
    ]
    assert awr.ram == awr.lasting


def test_play_is_taken_up_in_a_blip_that_is_told_and_leaves_the_way_as_it_was():
    awr, plain = unit(words=factory(backlash=(40, 30))), unit()
    for each in (awr, plain):
        for body, t in (("8", 0.0), ("4", 1.0), ("5", 6.0), ("2", 7.0), ("6", 9.0), ("1", 10.0), ("6", 12.0)):
            ask(each, body, T0 + t)
        each.advance(T0 + 20.0)
    told = [(round(t, 2), event) for t, event in events(awr, T0 + 20.0) if isinstance(event, Backlash)]
    assert told == [
        (1.0, Backlash(0, on=True)),
        (6.0, Backlash(0, on=False)),
        (7.0, Backlash(1, on=False)),
        (10.0, Backlash(1, on=True)),
    ]
    assert awr.true_position(1) == pytest.approx(plain.true_position(1))
    assert awr.true_position(2) == pytest.approx(plain.true_position(2))


def test_older_firmware_leaves_out_what_it_does_not_know():
    awr = unit(firmware=0.59, words=factory(backlash=(5, 5)))
    assert awr.receive(b":7#", T0) == b":Y\r\n"
    assert ask(awr, "R?", T0) == []
    awr.levels("A")
    assert [event for _, event in events(awr, T0)] == [Error("C")]


def test_presses_and_stamps_scatter_as_they_are_told_to():
    awr = SimulatedAwr(SimulatorSettings(), T0)
    late, off = [], []
    for i in range(400):
        sent = T0 + 10.0 * i
        ask(awr, "1", sent)
        ask(awr, "6", sent + 5.0)
        for t, event in events(awr, sent + 9.0):
            if event == Moving((False, True)):
                late.append(t - (sent - T0))
            else:
                off.append(t - (sent - T0) - 5.0)
    assert statistics.mean(late) == pytest.approx(0.025, abs=0.001)
    assert statistics.stdev(late) == pytest.approx(0.005, abs=0.0006)
    assert statistics.stdev(off) == pytest.approx(0.005, abs=0.0006)


def test_it_goes_on_from_a_snapshot_as_if_it_had_not_been_away():
    one = SimulatedAwr(SimulatorSettings(worm_steps=500.0), T0)
    ask(one, "A", T0)
    ask(one, "3", T0 + 1.0)
    one.advance(T0 + 2.0)
    other = SimulatedAwr(SimulatorSettings(worm_steps=500.0), T0)
    other.restore(one.snapshot())
    for each in (one, other):
        ask(each, "5", T0 + 3.0)
        each.advance(T0 + 60.0)
    assert other.true_position(1) == one.true_position(1)
    assert other.snapshot() == one.snapshot()


def test_the_wear_of_a_night_of_keys_and_soft_writes_is_none():
    awr, rng = unit(), random.Random(2)  # noqa: S311
    for i in range(500):
        ask(awr, rng.choice(("1", "2", "5", "6", "7", "8", "A", "81A000", "820403", "D")), T0 + i)
    assert not awr.wear
    assert math.isfinite(awr.true_position(1))


def test_bytes_come_late_either_way_in_their_order_and_none_is_lost():
    for seed in range(20):
        awr = unit(byte_delay=0.2, byte_delay_s=0.03, seed=seed)
        come = [(T0, awr.receive(b":FF?#:7#", T0)), (T0, awr.receive(b":1#", T0))]
        while (said := awr.says(T0 + 5.0)) is not None:
            come.append(said)
        texts = [packet.text for packet in Packets().feed(b"".join(data for _, data in come), 0.0)]
        assert [text for text in texts if text != "X01"] == ["FF?0077", "Y", "Y"]
        assert texts.count("X01") == 1
        assert [at for at, _ in come] == sorted(at for at, _ in come)
        assert come[-1][0] > T0
        assert awr.keys == [0, 1]


def test_when_its_power_was_cut_it_begins_anew_and_tells_nothing():
    awr = unit()
    for body in ("1", "9", "812328", "F21"):
        ask(awr, body, T0)
    awr.advance(T0 + 3.0)
    events(awr, T0 + 3.0)
    awr.switched_on()
    assert (awr.keys, awr.speed, awr.relays, awr.ram) == ([0, 0], "guide", 0, awr.lasting)
    assert not events(awr, T0 + 3.0)


@pytest.mark.parametrize(("blips", "lost"), [((0, 0), 30.0), ((0, 30), 0.0), ((0, 10), 20.0)])
def test_an_axis_falls_behind_by_the_play_that_blips_do_not_take_up(blips, lost):
    awr, plain = unit(plays=(0.0, 30.0), words=factory(backlash=blips)), unit()
    for one in (awr, plain):
        for at, body in ((0.0, "A"), (0.1, "1"), (1.1, "6"), (2.0, "2"), (3.5, "6")):
            one.receive(f":{body}#".encode(), T0 + at)
        one.advance(T0 + 6.0)
    assert awr.true_position(2) - plain.true_position(2) == pytest.approx(lost)
