"""The simulated box against numbers worked out from the manual by hand."""

import json

import pytest
from avr_bench import STEPS_PER_TURN, T0, like

from mounts.avr_box import commands
from mounts.avr_box.simulator import SimulatedAvrBox

WORM_S = 66327.2727 / 276.548673  # of a turn of the worm at the default rate
TICK_S = 0.461888


def box(**changes):
    return SimulatedAvrBox(like(**changes), T0, STEPS_PER_TURN)


def plain(**changes):
    """One whose PEC is off."""
    unit = box(**changes)
    unit.receive(b"C\x12", T0)
    return unit


def test_what_the_driver_has_wrong_of_a_letter_or_of_a_flag_is_not_what_the_box_does(monkeypatch):
    monkeypatch.delitem(commands.COMMANDS, "N")
    monkeypatch.setitem(commands.FLAGS, "dec_guiding", 0x20)
    unit = plain()
    unit.receive(b"N", T0)
    unit.advance(T0 + 10.0)
    assert unit.true_position(2) == 2764  # twice 1382
    unit.receive(b">\x05", T0 + 10.0)
    unit.advance(T0 + 20.0)
    assert unit.true_position(2) == 2769


def test_it_tracks_at_the_rate_of_the_default_divisor():
    unit = plain()
    unit.advance(T0 + 1000.0)
    assert unit.true_position(1) == 276548  # 16 MHz / 128 / 226 / 2, for 1000 s
    assert unit.true_position(2) == 0


@pytest.mark.parametrize(("letter", "rate"), [(b"+", 125000 / 222 / 2), (b"-", 125000 / 230 / 2)])
def test_guiding_lasts_until_so_many_ticks_have_passed(letter, rate):
    unit, late = plain(), 0.3 * TICK_S
    unit.receive(letter + b"\x0a", T0 + late)
    unit.advance(T0 + 20.0)
    guided = 10 * TICK_S - late
    assert unit.true_position(1) == pytest.approx(276.548673 * (20.0 - guided) + rate * guided, abs=1.5)


def test_guiding_needs_its_flag():
    unit = box()
    unit.receive(b"C\x00+\xff>\x09", T0)
    unit.advance(T0 + 100.0)
    assert unit.true_position(1) == 27654
    assert unit.true_position(2) == 0


@pytest.mark.parametrize(
    ("changes", "sent", "moved"),
    [
        ({}, b"M\xe8\x03\x00\x00\x02", 1000),
        ({}, b"M\xe9\x03\x00\x00\x82", -1000),  # an odd one is halved: the last microstep is not made
        ({"move_count": "half"}, b"M\xe8\x03\x00\x00\x02", 2000),
        ({"axis_bit": 0}, b"M\xe8\x03\x00\x00\x00", 1000),
        ({"reversed2": True}, b"M\xe8\x03\x00\x00\x02", -1000),
        ({}, b"N", 2764),
        ({}, b"s", -2764),
        ({}, b">\x0c", 12),
        ({}, b"<\x0c", -12),
        ({}, b"D", 1),
    ],
)
def test_a_command_moves_axis_2_by_this(changes, sent, moved):
    unit = plain(**changes)
    unit.receive(sent, T0)
    unit.advance(T0 + 60.0)
    assert unit.true_position(2) == moved


def test_a_slew_of_axis_1_suspends_its_tracking():
    unit = plain()
    unit.receive(b"M\x00\x20\x03\x00\x80", T0)  # 204800 microsteps
    unit.advance(T0 + 5.0)
    assert unit.moving == (True, False)
    unit.advance(T0 + 100.0)
    slewed_s = (204800 - 32768) / 15625 + 2 * 2.083
    assert unit.true_position(1) == pytest.approx(-204800 + 276.548673 * (100.0 - slewed_s), abs=30.0)


@pytest.mark.parametrize(
    ("changes", "seconds"),
    [
        ({}, 2 * 100 * 2 * 256 * 256 / 16e6),  # 100 steps up and 100 down, each two counts of 256 clocks of 62.5 kHz
        ({"table_clocks": "byte"}, 2 * 100 * 2 * 255 * 256 / 16e6),
    ],
)
def test_the_steps_of_a_slew_last_by_the_law_of_its_bytes(changes, seconds):
    unit = plain(slew_table=(255,) * 1024, **changes)
    unit.receive(b"M\xc8\x00\x00\x00\x02", T0)
    unit.advance(T0 + seconds - 1e-3)
    assert unit.moving[1]
    unit.advance(T0 + seconds + 1e-6)
    assert unit.moving == (False, False)


@pytest.mark.parametrize(("ends", "guided_s"), [("tick", 1.5 * 0.461888), ("whole", 2.0 * 0.461888)])
def test_guiding_ends_at_the_nth_tick_or_lasts_as_many_whole_ones(ends, guided_s):
    unit = plain(guide_ends=ends)
    unit.advance(T0 + 0.5 * 0.461888)
    unit.receive(b"+\x02", T0 + 0.5 * 0.461888)
    unit.advance(T0 + 10.0)
    faster = 16e6 / 256 * (1 / 222 - 1 / 226)  # microsteps a second: 4 counts fewer
    assert abs(unit.true_position(1) - (16e6 / 256 / 226 * 10.0 + faster * guided_s)) < 1.0


@pytest.mark.parametrize(("compare", "seconds"), [(255, 0.8192), (63, 0.2048)])
def test_single_microsteps_go_by_the_compare_value_of_their_timer(compare, seconds):
    unit = plain(fine_compare=compare)
    unit.receive(b">\x64", T0)
    unit.advance(T0 + seconds - 1e-3)
    assert unit.true_position(2) == 99
    unit.advance(T0 + seconds + 1e-6)
    assert unit.true_position(2) == 100


@pytest.mark.parametrize(("interrupted", "later"), [("lost", 0.999), ("kept", 0.099)])
def test_the_microstep_that_a_slew_interrupts_is_lost_or_kept(interrupted, later):
    unit, step = plain(interrupted=interrupted), 1.0 / 276.548673
    begin, ends = (
        0.9 * step,
        2 * 2 * 256 * 256 / 16e6 / 2,
    )  # one microstep up and one down, at a prescaler of 128
    unit.receive(b"M\x02\x00\x00\x00\x00", T0 + begin)
    unit.advance(T0 + begin + ends + later * step)
    assert unit.true_position(1) == 2
    unit.advance(T0 + begin + ends + (later + 0.003) * step)
    assert unit.true_position(1) == 3


def test_half_a_command_waits_for_the_rest_for_ever():
    unit = plain()
    assert unit.receive(b"M\x0a\x00", T0) == b""
    assert unit.receive(b"Q", T0 + 50.0) == b""
    assert unit.receive(b"\x00\x02", T0 + 51.0) == b""
    unit.advance(T0 + 52.0)
    assert unit.moving == (False, True)  # 0x51 became a byte of the count


def test_a_new_move_ends_the_old_one_or_is_not_heard():
    for busy, far in (("restart", False), ("ignore", True)):
        unit = plain(busy=busy)
        unit.receive(b"M\x00\x00\x10\x00\x02", T0)
        unit.receive(b"S", T0 + 5.0)
        unit.advance(T0 + 20.0)
        assert unit.moving[1] is far


def test_the_bin_counts_ticks_and_the_index_pulse_sets_it():
    unit = plain(index_pulse=False)
    unit.receive(b"B\x00\x02", T0)
    assert unit.receive(b"P", T0 + 3.5 * TICK_S) == b"+00515\t+00000\r"
    assert unit.receive(b"P", T0 + 7.5 * TICK_S) == b"+00000\t+00000\r"  # 518 is the last one
    unit = plain()
    unit.receive(b"Z\x64\x00", T0)
    assert unit.receive(b"P", T0 + WORM_S + 0.1 * TICK_S) == b"+00100\t+00100\r"


def test_pec_drives_by_its_table():
    unit = box(pec_table=(220,) * 519)
    unit.advance(T0 + 100.0)
    assert unit.true_position(1) == pytest.approx(125000 / 221 / 2 * 100.0, abs=1.0)


def test_encoders_count_what_the_axes_did_not_what_the_motors_made():
    unit = plain()
    unit.receive(b"M\x00\x00\x04\x00\x02", T0)
    unit.advance(T0 + 60.0)
    unit.push(2, -STEPS_PER_TURN[1] / 20000 * 10)
    expected = round((262144 / STEPS_PER_TURN[1]) * 20000) - 10
    assert unit.encoders()[1] == pytest.approx(expected, abs=1)
    assert plain(encoder_counts_per_turn=0).encoders() == (0, 0)


@pytest.mark.parametrize(
    ("off", "seen"), [({"encoder_still1": True}, (0, 439)), ({"encoder_still2": True}, (220, 0))]
)
def test_an_encoder_whose_cable_is_off_counts_nothing(off, seen):
    unit = plain(**off)
    for axis in (b"\x00", b"\x02"):
        unit.receive(b"M\x00\x00\x04\x00" + axis, T0)
    unit.advance(T0 + 60.0)
    print(f"\n{unit.encoders()}")
    assert unit.encoders() == pytest.approx(seen, abs=15)  # axis 1 tracks for a minute at most
    assert 0 in unit.encoders()


def test_it_goes_on_from_its_snapshot():
    one, two = plain(), plain()
    one.receive(b"M\x00\x00\x01\x00\x80+\x20M\x10", T0)
    one.advance(T0 + 1.0)
    two.restore(json.loads(json.dumps(one.snapshot())))
    for unit in (one, two):
        unit.receive(b"\x00\x00\x00\x02", T0 + 2.0)
        unit.advance(T0 + 100.0)
    assert [one.true_position(axis) for axis in (1, 2)] == [two.true_position(axis) for axis in (1, 2)]
    assert one.true_position(2) == 16


def test_a_worn_line_loses_and_doubles_as_many_bytes_as_it_is_told_either_way():
    lost, doubled = plain(byte_loss=0.2), plain(byte_doubling=0.2)
    answers = [b"".join(unit.receive(b"P", T0) for _ in range(1000)) for unit in (lost, doubled)]
    print(f"\n{len(answers[0])} and {len(answers[1])} bytes of 14000 sent")
    assert len(answers[0]) == pytest.approx(14_000 * 0.8 * 0.8, rel=0.05)
    assert len(answers[1]) == pytest.approx(14_000 * 1.2 * 1.2, rel=0.05)


def test_somebody_at_the_hand_controller_moves_an_axis_five_arcminutes_as_often_as_is_told():
    unit, moves = plain(hand_every_s=60.0), 0
    moving = (False, False)
    for second in range(6000):
        unit.advance(T0 + second)
        moves += sum(now and not before for now, before in zip(unit.moving, moving, strict=True))
        moving = unit.moving
    print(f"\n{moves} moves in 100 minutes")
    assert 90 <= moves <= 110
    assert unit.true_position(2) % 2764 == 0
