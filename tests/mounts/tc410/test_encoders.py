"""Absolute encoders: a position lost with the power comes back as exactly as they read, or not at all.

The oracle is the unit's true position, which the encoders see and the driver does not.
"""

from dataclasses import replace

import pytest
from tc410_bench import STEP_ARCSEC, Bench

from mounts.drive import AxisSlew
from mounts.errors import Unsynchronised
from mounts.tc410.registers import CENTRE, gray_to_binary

TURN_COUNTS = 1_425_000  # of the axis, with the manual's gears


def bench_with(bits=16, *, zero=(1234, 54321), **overrides):
    keys = {
        f"axis{axis}__{name}": value
        for axis in (1, 2)
        for name, value in {
            "encoder_bits": bits,
            "encoder_zero": zero[axis - 1],
            "min_deg": -90,
            "max_deg": 85,
        }.items()
    }
    return Bench(**{**keys, **overrides})


def moved(bench, one, two):
    bench.slew(AxisSlew(one), AxisSlew(two))
    bench.polled_until_landed()
    bench.wait(1.0)
    bench.drive.read(bench.now)
    bench.drive.read(bench.now)


def true_arcsec(bench, reading):
    """By how much each axis is read wrongly."""
    return [
        abs(axis.counts - bench.unit.true_position(i)) * STEP_ARCSEC for i, axis in enumerate(reading.axes, start=1)
    ]


@pytest.mark.parametrize("bits", [14, 16])
@pytest.mark.parametrize("backwards", [False, True])
@pytest.mark.parametrize("zero_at", ["centre", "zero"])
def test_after_a_power_cycle_the_position_is_as_exact_as_the_encoder(bits, backwards, zero_at):
    keys = {f"axis{axis}__encoder_{name}": value for axis in (1, 2)
            for name, value in (("reversed", backwards), ("zero_at", zero_at))}  # fmt: skip
    bench = bench_with(bits, simulator__encoder_zero_at=zero_at, **keys)
    moved(bench, CENTRE + 123_456, CENTRE - 77_777)
    assert bench.drive.notes == ()
    bench.unit.power_cycle()
    bench.wait(1.0)
    lost = bench.drive.read(bench.now)
    assert "power-cycled" in lost.unsynchronised  # once, so that whatever ran is ended
    reading = bench.drive.read(bench.now)
    assert reading.unsynchronised == ""
    bound = {14: 79.2, 16: 20.0}[bits]
    errors = true_arcsec(bench, reading)
    print(f"{bits} bits: off by {max(errors):.1f}″, stated {reading.axes[0].uncertainty_counts * STEP_ARCSEC:.1f}″")
    for axis, error in zip(reading.axes, errors, strict=True):
        assert error <= axis.uncertainty_counts * STEP_ARCSEC
        assert axis.uncertainty_counts * STEP_ARCSEC == pytest.approx(bound, abs=0.6)
    assert any("preset from the encoders" in note for note in bench.drive.notes)
    bench.slew(AxisSlew(CENTRE), AxisSlew(CENTRE))  # and it may move again


def test_the_next_process_presets_the_position_and_states_its_uncertainty():
    bench = bench_with()
    moved(bench, CENTRE + 200_000, CENTRE - 100_000)
    bench.drive.close(bench.now, keep_tracking=False)
    bench.keep(bench.drive.memory)
    bench.unit.power_cycle()
    bench.wait(3600.0)
    reading = bench.restarted()
    assert reading.unsynchronised == ""
    assert max(true_arcsec(bench, reading)) < 20.0
    bench.keep(bench.drive.memory)
    assert bench.restarted().axes[0].uncertainty_counts * STEP_ARCSEC == pytest.approx(20.0, abs=0.6)
    bench.drive.sync([bench.unit.true_position(1), bench.unit.true_position(2)], bench.now)
    assert bench.drive.read(bench.now).axes[0].uncertainty_counts < 1.0


@pytest.mark.parametrize(
    ("wrong", "word"),
    [
        ({"encoder_reversed": True}, "encoder_reversed"),
        ({"encoder_at_centre": 4000}, "encoder_zero = 4000 would agree"),
    ],
)
def test_an_encoder_that_is_configured_wrongly_is_told_and_never_believed(wrong, word):
    bench = bench_with()
    one, two = bench.unit.hardware
    bench.unit.hardware = (replace(one, **wrong), two)
    moved(bench, CENTRE + 200_000, CENTRE)
    assert any("axis 1: the encoder says" in note and word in note for note in bench.drive.notes), bench.drive.notes
    bench.unit.power_cycle()
    bench.drive.read(bench.now)
    reading = bench.drive.read(bench.now)
    assert "power-cycled" in reading.unsynchronised
    assert any("is not used" in note for note in bench.drive.notes)
    with pytest.raises(Unsynchronised):
        bench.slew(AxisSlew(CENTRE), AxisSlew(CENTRE))


def test_the_opposite_reading_of_the_encoder_zero_never_points_wrongly():
    bench = bench_with(simulator__encoder_zero_at="zero")
    moved(bench, CENTRE + 200_000, CENTRE)
    assert any("encoder_zero_at" in note for note in bench.drive.notes)
    bench.unit.power_cycle()
    bench.drive.read(bench.now)
    assert bench.drive.read(bench.now).unsynchronised


def test_a_sense_never_seen_is_not_believed_away_from_the_zero():
    bench = bench_with()
    bench.drive.close(bench.now, keep_tracking=False)
    bench.keep(bench.drive.memory)
    assert bench.kept["encoders"] == ["unproved", "unproved"]  # it was only ever at its zero
    for axis in bench.unit.axes:
        axis.offset += 300_000 << 24  # somebody turned the telescope by hand
    bench.unit.power_cycle()
    assert "power-cycled" in bench.restarted().unsynchronised
    assert any("never compared" in note for note in bench.drive.notes)


def test_a_turn_that_cannot_be_known_is_not_guessed():
    bench = bench_with(axis1__min_deg=-270, axis1__max_deg=270)
    moved(bench, CENTRE + TURN_COUNTS * 200 // 360, CENTRE)
    bench.unit.power_cycle()
    bench.drive.read(bench.now)
    assert bench.drive.read(bench.now).unsynchronised
    assert any("2 places a whole turn apart" in note for note in bench.drive.notes)


def test_an_absent_encoder_is_a_sentence():
    bench = bench_with()
    one, two = bench.unit.hardware
    bench.unit.hardware = (one, replace(two, encoder_bits=0))
    moved(bench, CENTRE + 1000, CENTRE)
    wanted = "axis 2: encoder_bits = 16, but the drive detects no encoder (input 0x0B); check its plug and supply"
    assert any(wanted in note for note in bench.drive.notes)


def test_a_position_given_up_by_a_person_is_not_taken_back_by_encoders():
    bench = bench_with()
    moved(bench, CENTRE + 200_000, CENTRE - 100_000)
    bench.drive.upkeep.act("load_configuration")
    bench.drive.read(bench.now)
    assert "loaded anew" in bench.drive.read(bench.now).unsynchronised
    assert "loaded anew" in bench.restarted().unsynchronised


def test_gray_and_binary_of_the_unit_are_one_angle():
    bench = bench_with(14)
    moved(bench, CENTRE + 123_456, CENTRE)
    raw, binary = bench.drive.unit.words("axis1_encoder_raw"), bench.drive.unit.words("axis1_encoder")
    assert gray_to_binary(raw[0]) == binary[0]
    expected = (1234 + 123_456 / TURN_COUNTS * 0x10000) % 0x10000
    assert abs(binary[0] - expected) <= 4
